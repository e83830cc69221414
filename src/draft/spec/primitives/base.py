"""What all primitives share: compiled words, geoms as plain data, and the end of a link.

A primitive is one module: the words of the files (pydantic models, whose docstrings are the
reference's text) and the numbers that they come to, which know their volume, their mass and their
geoms. Whatever weighs, packs or draws a robot reads the geoms and needs to know no primitive.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import (
    Any,
    ClassVar,
    Generic,
    Literal,
    NamedTuple,
    Self,
    TypeVar,
    cast,
    get_args,
)

from draft import geometry as g
from draft.errors import Location
from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.expressions import Expression, Triple, parse
from draft.spec.reader import Path_, Source
from draft.spec.words import Model, NamedAxis, Number
from draft.values import Value, minimum

AXES: dict[str, tuple[float, float, float]] = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
}
# Most that an end takes of its segment's mass where none is stated.
END_SHARE = 0.5
_NUMBER = get_args(Number)[0]  # the type that is annotated, which is what pydantic keeps of it
Form = Literal["cylinder", "sphere", "box"]
Color = tuple[float, float, float, float]
Words = TypeVar("Words", bound=Model)


@dataclass(frozen=True, slots=True, eq=False)
class Written(Generic[Words]):
    """One part of a link as written: its words, with every number of them compiled.

    Attributes:
        words: as read, for what is no number: names, segment classes.
        numbers: an expression, or three, for each number that is written.
        places: where each key stands, or what it would be a key of.
    """

    words: Words
    numbers: Mapping[str, Expression | Triple]
    places: Mapping[str, Location]

    def number(self, key: str) -> Expression:
        """A number that must be written, or has a default."""
        return cast(Expression, self.numbers[key])

    def optional(self, key: str) -> Expression | None:
        """A number that may be left out."""
        return self.number(key) if key in self.numbers else None

    def triple(self, key: str) -> Triple:
        """Three numbers, or an axis."""
        return cast(Triple, self.numbers[key])


def compile_words(words: Words, path: Path_, source: Source) -> Written[Words]:
    """Compile every number of a part of a link; numbers are the fields that are a `Number`.

    Raises:
        SpecError: an expression that is none.
    """
    numbers: dict[str, Expression | Triple] = {}
    for key in _number_keys(type(words)):
        value = getattr(words, key)
        if isinstance(value, list):
            numbers[key] = read_triple(value, (*path, key), source)
        elif isinstance(value, str) and key in _axis_keys(type(words)):
            numbers[key] = read_axis(value, (*path, key), source)
        elif value is not None:
            numbers[key] = parse(value, source.at((*path, key)))
    places = {key: source.at((*path, key)) for key in type(words).model_fields}
    return Written(words, numbers, places)


@lru_cache
def _number_keys(words: type[Model]) -> tuple[str, ...]:
    """Keys of some words whose values are numbers, in their order."""
    return tuple(key for key, hint in _hints(words) if _mentions(hint, _NUMBER))


@lru_cache
def _axis_keys(words: type[Model]) -> tuple[str, ...]:
    """Keys of some words whose values are axes."""
    return tuple(key for key, hint in _hints(words) if _mentions(hint, NamedAxis))


def _hints(words: type[Model]) -> Iterator[tuple[str, Any]]:
    # As pydantic evaluated them: typing.get_type_hints takes a tenth of the time to read a spec.
    return ((key, field.annotation) for key, field in words.model_fields.items())


def _mentions(hint: Any, wanted: Any) -> bool:
    """Tell whether a type is another one or is made of it."""
    return hint is wanted or any(_mentions(part, wanted) for part in get_args(hint))


def read_triple(value: list[float | str], path: Path_, source: Source) -> Triple:
    """Compile three numbers."""
    x, y, z = (parse(item, source.at((*path, i))) for i, item in enumerate(value))
    return (x, y, z)


def read_axis(value: str | list[float | str], path: Path_, source: Source) -> Triple:
    """Compile an axis: a name or three components."""
    if isinstance(value, list):
        return read_triple(value, path, source)
    x, y, z = (parse(component, source.at(path)) for component in AXES[value])
    return (x, y, z)


class Geom(NamedTuple):
    """A solid of a body in the body's frame, as plain data. Resolving makes many: tuples are quick.

    Attributes:
        suffix: what its name adds to the body's.
        kind: what it is of the robot, which gives its colour.
        form: its shape.
        center: its centre [m].
        size: radius and length of a cylinder, radius of a sphere, full sizes of a box along the
            body's x, y and z [m].
        mass: its mass [kg]; None where it is only drawn and takes up no space.
        axis: unit direction of a cylinder.
        collides: whether it meets the floor and objects.
    """

    suffix: str
    kind: str
    form: Form
    center: Vector
    size: tuple[Value, ...]
    mass: Value | None
    axis: Vector = (0.0, 0.0, 1.0)
    collides: bool = True

    @property
    def volume(self) -> Value:
        """Volume of the solid [m3]."""
        if self.form == "cylinder":
            radius, length = self.size
            return math.pi * radius * radius * length
        if self.form == "sphere":
            (radius,) = self.size
            return 4 / 3 * math.pi * radius * radius * radius
        x, y, z = self.size
        return x * y * z

    @property
    def inertia(self) -> Vector:
        """Principal moments about its centre [kg m2].

        Along x, y and z of a box; of a cylinder the last is about its axis.
        """
        mass = 0.0 if self.mass is None else self.mass
        if self.form == "cylinder":
            radius, length = self.size
            across = mass * (radius * radius / 4 + length * length / 12)
            return (across, across, mass * radius * radius / 2)
        if self.form == "sphere":
            about = 2 / 5 * mass * self.size[0] * self.size[0]
            return (about, about, about)
        x, y, z = self.size
        return (
            mass * (y * y + z * z) / 12,
            mass * (z * z + x * x) / 12,
            mass * (x * x + y * y) / 12,
        )


@dataclass(frozen=True, slots=True)
class End(ABC):
    """Numbers of what a link ends in, in the link's frame.

    Attributes:
        key: the key of its words in the link's.
        of_segment: whether its mass is a share of its segment's structure; else it is carried.
        sites: suffixes of its sites' names; `site_places` has their places.
        colors: kinds of geom that are its own, with their colours.
        mass: stated mass [kg]; None where a share of its segment's is to be taken.
        site: name of its sites; None where it has none.
    """

    key: ClassVar[str]
    of_segment: ClassVar[bool] = True
    sites: ClassVar[tuple[str, ...]] = ("",)
    colors: ClassVar[Mapping[str, Color]] = {}

    mass: Value | None
    site: str | None

    @classmethod
    @abstractmethod
    def read(cls, written: Written[Any], link: str, r: Evaluator) -> Self:
        """Evaluate what is written.

        Args:
            written: its words.
            link: name of the link, for messages.
            r: evaluates expressions.

        Raises:
            ResolveError: a number that cannot be.
        """

    @abstractmethod
    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Give its solid.

        Args:
            tip: the link's far end [m].
            mass: what it weighs [kg].
        """

    @property
    def center(self) -> Vector:
        """Its centre of mass from the link's tip [m]."""
        return g.ZERO

    @property
    def depth(self) -> Value:
        """How far an upright one reaches below the link's tip [m]."""
        return 0.0

    @property
    def is_foot(self) -> bool:
        """Whether a robot may stand on it."""
        return self.site is not None

    def site_places(self, tip: Vector) -> tuple[Vector, ...]:
        """Places of its sites [m], in the order of `sites`."""
        return (tip,)

    def mirrored(self, signs: Vector) -> Self:
        """Give its reflection; most ends are their own."""
        return self

    def weigh(self, segment: Value, density: Value) -> Value:
        """Mass that it has of its segment's [kg].

        Args:
            segment: mass of the segment [kg].
            density: what surveyed ends weigh for their volume [kg/m3].
        """
        if self.mass is not None:
            return self.mass
        return minimum(density * self.geom(g.ZERO, 0.0).volume, END_SHARE * segment)
