"""Base of all primitives: compiled fields, geoms as plain data, and the end of a link.

A primitive is one module: the fields in the files (pydantic models, whose docstrings are the text
of the reference) and their numbers, which have a volume, a mass and geoms. Code that weighs, packs
or draws a robot reads the geoms and depends on no primitive.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import (
    TYPE_CHECKING,
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

import pydantic

from draft import geometry as g
from draft.errors import Location
from draft.geometry import Rotation, Vector
from draft.spec.evaluate import Evaluator
from draft.spec.expressions import Expression, Triple, parse
from draft.spec.field_types import Model, NamedAxis, Number, broken_rule
from draft.spec.reader import Path_, Source
from draft.values import Value, minimum

if TYPE_CHECKING:
    from draft.spec.primitives.loft import Loft
    from draft.spec.primitives.mesh import Mesh

AXES: dict[str, tuple[float, float, float]] = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
}
# Largest share of its segment's mass that an end has by default.
END_SHARE = 0.5
_NUMBER = get_args(Number)[0]  # the annotated type, which is all that pydantic keeps
Form = Literal["cylinder", "sphere", "box", "mesh"]
Color = tuple[float, float, float, float]
Fields = TypeVar("Fields", bound=Model)
# Colours of the kinds of geom that any robot may have.
COLORS: dict[str, Color] = {
    "trunk": (0.21, 0.38, 0.56, 1),
    "structure": (0.86, 0.87, 0.88, 1),
    "actuator": (0.24, 0.25, 0.28, 1),
    "foot": (0.16, 0.16, 0.17, 1),
    "drawn": (0.95, 0.55, 0.20, 1),
}
# Kind of the geoms of a part of one's own that are not drawn: what collides, and its inertia.
HIDDEN = "hidden"
HIDDEN_COLOR: Color = (0.9, 0.2, 0.2, 0)


@dataclass(frozen=True, slots=True, eq=False)
class Written(Generic[Fields]):
    """A part of a link as written, with every number compiled.

    Attributes:
        fields: the model of the part, for fields that are not numbers: names, segment classes.
        numbers: an expression, or three, for each number that is present.
        places: place of each key; for a key that is missing, place of the part.
    """

    fields: Fields
    numbers: Mapping[str, Expression | Triple]
    places: Mapping[str, Location]

    def number(self, key: str) -> Expression:
        """Number that is required or has a default."""
        return cast(Expression, self.numbers[key])

    def optional(self, key: str) -> Expression | None:
        """Number that may be missing; None then."""
        return self.number(key) if key in self.numbers else None

    def triple(self, key: str) -> Triple:
        """Three numbers, or an axis."""
        return cast(Triple, self.numbers[key])


def compile_part(fields: Fields, path: Path_, source: Source) -> Written[Fields]:
    """Compile every field of type `Number` of a part of a link.

    Raises:
        SpecError: an expression is invalid.
    """
    numbers: dict[str, Expression | Triple] = {}
    for key in _number_keys(type(fields)):
        value = getattr(fields, key)
        if isinstance(value, list):
            numbers[key] = read_triple(value, (*path, key), source)
        elif isinstance(value, str) and key in _axis_keys(type(fields)):
            numbers[key] = read_axis(value, (*path, key), source)
        elif value is not None:
            numbers[key] = parse(value, source.at((*path, key)))
    places = {key: source.at((*path, key)) for key in type(fields).model_fields}
    return Written(fields, numbers, places)


@lru_cache
def _number_keys(model: type[Model]) -> tuple[str, ...]:
    """Fields of a model that are numbers, in their order."""
    return tuple(key for key, hint in _hints(model) if _mentions(hint, _NUMBER))


@lru_cache
def _axis_keys(model: type[Model]) -> tuple[str, ...]:
    """Fields of a model that are axes."""
    return tuple(key for key, hint in _hints(model) if _mentions(hint, NamedAxis))


def _hints(model: type[Model]) -> Iterator[tuple[str, object]]:
    # As pydantic evaluated them: typing.get_type_hints takes a tenth of the time to read a spec.
    return ((key, field.annotation) for key, field in model.model_fields.items())


def _mentions(hint: object, wanted: object) -> bool:
    """Return whether a type is another type or contains it."""
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


# Configuration of a model whose mass is stated, either as `mass` or by `density`.
MASS_OR_DENSITY = pydantic.ConfigDict(
    json_schema_extra={"oneOf": [{"required": ["mass"]}, {"required": ["density"]}]}
)


def check_mass_or_density(part: str, mass: Number | None, density: Number | None) -> None:
    """Check that exactly one of mass and density is stated, for a validator of a part.

    Raises:
        ValueError: both are, or neither is.
    """
    if (mass is None) == (density is None):
        stated = "neither 'mass' nor" if mass is None else "both 'mass' and"
        remedy = "state one of them, 'mass: ...' [kg] or 'density: ...' [kg/m3]"
        raise broken_rule(f"a {part} with {stated} 'density'", remedy)


def stated_mass(
    written: Written[Fields], part: str, link: str, volume: Value, r: Evaluator
) -> Value:
    """Mass of a part [kg], stated or from its density and its volume [m3]."""
    stated = written.optional("mass")
    if stated is not None:
        return r.at_least_zero(stated, f"{part} mass of {link}")
    return r.at_least_zero(written.number("density"), f"{part} density of {link}") * volume


class Geom(NamedTuple):
    """A solid of a body in the frame of the body, as plain data; a tuple because many are made.

    Attributes:
        suffix: suffix of its name after that of the body.
        kind: part of the robot, such as "actuator", which determines its colour.
        form: its shape.
        center: its centre [m].
        size: radius and length of a cylinder, radius of a sphere, full sizes of a box along its own
            x, y and z [m]; nothing for a mesh.
        mass: its mass [kg]; None if it is only drawn and occupies no space.
        axis: unit direction of a cylinder.
        collides: whether it collides with the floor and with objects.
        rotation: frame of a box or a mesh in that of the body; None for parallel frames.
        mesh: the solid of a mesh; its centre is that of its frame.
    """

    suffix: str
    kind: str
    form: Form
    center: Vector
    size: tuple[Value, ...]
    mass: Value | None
    axis: Vector = (0.0, 0.0, 1.0)
    collides: bool = True
    rotation: Rotation = None
    mesh: Mesh | Loft | None = None

    @property
    def volume(self) -> Value:
        """Volume of the solid [m3]."""
        if self.mesh is not None:
            return self.mesh.volume
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
        """Principal moments about its centre [kg m2], except of a mesh.

        About its own x, y and z for a box; for a cylinder the last is about its axis.
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
    """End of a link with its numbers, in the frame of the link.

    Attributes:
        key: field of the link that holds it.
        of_segment: whether its mass is part of its segment's structure; else it is carried.
        sites: suffixes of the names of its sites; `site_places` has their places.
        colors: colours of the kinds of geom that only it has.
        mass: stated mass [kg]; None for a share of its segment's.
        site: name of its sites; None without sites.
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
        """Evaluate its numbers.

        Args:
            written: the end as written.
            link: name of the link, for messages.
            r: evaluator of expressions.

        Raises:
            ResolveError: a number is invalid.
        """

    @abstractmethod
    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Return its solid.

        Args:
            tip: tip of the link [m].
            mass: its mass [kg].
        """

    @property
    def center(self) -> Vector:
        """Centre of mass, from the tip of the link [m]."""
        return g.ZERO

    @property
    def depth(self) -> Value:
        """Depth below the tip of an upright link [m]."""
        return 0.0

    @property
    def is_foot(self) -> bool:
        """Whether the robot may stand on it."""
        return self.site is not None

    def site_places(self, tip: Vector) -> tuple[Vector, ...]:
        """Places of its sites [m], in the order of `sites`."""
        return (tip,)

    def mirrored(self, signs: Vector) -> Self:
        """Return its reflection; most ends are symmetric."""
        return self

    def weigh(self, segment: Value, density: Value) -> Value:
        """Mass of the end [kg], stated or as a share of its segment.

        Args:
            segment: mass of the segment [kg].
            density: mass over volume of surveyed ends [kg/m3].
        """
        if self.mass is not None:
            return self.mass
        return minimum(density * self.geom(g.ZERO, 0.0).volume, END_SHARE * segment)
