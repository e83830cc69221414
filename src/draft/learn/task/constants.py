"""Numbers of the learning tasks with their unit, power of the scale, meaning and source."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, fields
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, overload

if TYPE_CHECKING:
    import torch
    from _typeshed import DataclassInstance

    from draft.values import Array

T = TypeVar("T")
CONTACT_TIME = 0.02  # MuJoCo's default time constant of contacts [s].
VELOCITY_NOISE = 0.5  # Largest error of the observed velocity, as of mjlab [m/s].


class Scaled(NamedTuple):
    """A number for a leg of 0.48 m that grows with a power of s = L / 0.48 m.

    Attributes:
        value: number at s = 1.
        power: power of s.
    """

    value: float
    power: float = 0.0

    @overload
    def at(self, scale: float) -> float: ...
    @overload
    def at(self, scale: Array) -> Array: ...
    @overload
    def at(self, scale: torch.Tensor) -> torch.Tensor: ...
    def at(self, scale: Any) -> Any:
        """Return the number at one scale or at an array or tensor of scales."""
        return self.value * scale**self.power


class Within(NamedTuple):
    """Values that a number may have; those of a tuple or ramp each.

    Attributes:
        words: what it must be, for messages.
        holds: whether a value, flat and as numbers, is one.
    """

    words: str
    holds: Callable[[Sequence[float]], bool]


ANY = Within("a number", lambda _: True)
LEAST_ZERO = Within("0 or more", lambda values: min(values) >= 0)
POSITIVE = Within("above 0", lambda values: min(values) > 0)
MOST_ITERATIONS = 10**7
JOINTS = 12  # Of the robots that the numbers of tasks and recipes are for.
ITERATIONS = Within(
    f"from 1 to {MOST_ITERATIONS}",
    lambda values: 1 <= min(values) <= max(values) <= MOST_ITERATIONS,
)
FRAMES = Within("from 1 to 20", lambda values: 1 <= min(values) <= max(values) <= 20)
SHARE = Within("a share, 0 to 1", lambda values: min(values) >= 0 and max(values) <= 1)
RANGE = Within(
    "a range from 0 or more, the smaller number first", lambda values: 0 <= values[0] <= values[-1]
)
POSITIVE_RANGE = Within(
    "a range above 0, the smaller number first", lambda values: 0 < values[0] <= values[-1]
)


def paper(value: T, unit: str, doc: str, power: float = 0.0, within: Within = LEAST_ZERO) -> T:
    """Field of a number that arXiv 2609.38405 states; see `choice`."""
    return _number(value, unit, doc, "paper", power, within)


def choice(
    value: T, unit: str, doc: str, by: str, power: float = 0.0, within: Within = LEAST_ZERO
) -> T:
    """Field of a number that the paper leaves open.

    Args:
        value: the number, or a tuple of numbers.
        unit: its unit.
        doc: its meaning.
        by: who chose it: "released code" (of the paper), "mjlab" (its default) or "Draft".
        power: power of s that it grows with.
        within: values that it may have.
    """
    return _number(value, unit, doc, f"choice: {by}", power, within)


def _number(value: T, unit: str, doc: str, source: str, power: float, within: Within) -> T:
    about = {"unit": unit, "doc": doc, "source": source, "power": power, "within": within}
    return field(default=value, metadata=about)


def scaled(group: DataclassInstance, name: str) -> Scaled:
    """Return a number of a group of the configuration, with its power of s."""
    for one in fields(group):
        if one.name == name:
            return Scaled(getattr(group, name), one.metadata["power"])
    raise KeyError(name)


class Row(NamedTuple):
    """A number as a row of a table.

    Attributes:
        name: GROUP.NAME.
        value: number for a leg of 0.48 m.
        scaled: number at the requested scale.
        unit, source, doc: unit, source and meaning.
    """

    name: str
    value: Any
    scaled: Any
    unit: str
    source: str
    doc: str


def rows(name: str, group: DataclassInstance, scale: float = 1.0) -> Iterator[Row]:
    """Yield the numbers of a group of the configuration.

    Args:
        name: name of the group.
        group: the group.
        scale: s = L / 0.48 m.
    """
    for one in fields(group):
        meta, value = one.metadata, getattr(group, one.name)
        at_scale = value
        if meta["power"]:
            factor = scale ** meta["power"]
            is_tuple = isinstance(value, tuple)
            at_scale = tuple(v * factor for v in value) if is_tuple else value * factor
        yield Row(f"{name}.{one.name}", value, at_scale, meta["unit"], meta["source"], meta["doc"])


def ramp_at(ramp: Sequence[tuple[int, float]], iteration: int) -> float:
    """Value of a ramp: that of the last step at or before an iteration.

    Args:
        ramp: (iteration, value), iterations rising from 0.
        iteration: iterations done.
    """
    return [value for start, value in ramp if start <= iteration][-1]
