"""Numbers of the learning tasks with their unit, power of the scale, meaning and source."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, fields
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, overload

if TYPE_CHECKING:
    import torch
    from _typeshed import DataclassInstance

    from draft.values import Array

REFERENCE_LEG = 0.48  # Thigh plus shank of the cheetah [m]; scale s = L / 0.48 m (paper).
T = TypeVar("T")


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


def paper(value: T, unit: str, doc: str, power: float = 0.0) -> T:
    """Field of a number that arXiv 2609.38405 states; see `choice`."""
    return _number(value, unit, doc, "paper", power)


def choice(value: T, unit: str, doc: str, by: str, power: float = 0.0) -> T:
    """Field of a number that the paper leaves open.

    Args:
        value: the number, or a tuple of numbers.
        unit: its unit.
        doc: its meaning.
        by: who chose it: "released code" (of the paper), "mjlab" (its default) or "Draft".
        power: power of s that it grows with.
    """
    return _number(value, unit, doc, f"choice: {by}", power)


def _number(value: T, unit: str, doc: str, source: str, power: float) -> T:
    return field(
        default=value, metadata={"unit": unit, "doc": doc, "source": source, "power": power}
    )


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
