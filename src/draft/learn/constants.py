"""Numbers of the learning tasks that know their unit, their scale and where they come from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, fields
from typing import Any, NamedTuple

REFERENCE_LEG = 0.48  # Thigh plus shank of the cheetah [m]; scale s = L / 0.48 m (paper).


class Scaled(NamedTuple):
    """A number for a leg of 0.48 m, and the power of s = L / 0.48 m that it grows with."""

    value: float
    power: float = 0.0

    def at(self, scale: Any) -> Any:
        """The number at a scale: a float, or an array or tensor of one."""
        return self.value * scale**self.power


def paper(value: Any, unit: str, doc: str, power: float = 0.0) -> Any:
    """A number that arXiv 2609.38405 states."""
    return _number(value, unit, doc, "paper", power)


def choice(value: Any, unit: str, doc: str, by: str, power: float = 0.0) -> Any:
    """A number that the paper leaves open.

    Args:
        value: the number, or a tuple of numbers.
        unit: its unit.
        doc: what it is.
        by: who chose it: "released code" (of the paper), "mjlab" (its stock value) or "Draft".
        power: power of s that it grows with.
    """
    return _number(value, unit, doc, f"choice: {by}", power)


def _number(value: Any, unit: str, doc: str, source: str, power: float) -> Any:
    return field(
        default=value, metadata={"unit": unit, "doc": doc, "source": source, "power": power}
    )


def scaled(group: Any, name: str) -> Scaled:
    """A number of a group, with the power of s that it grows with."""
    for one in fields(group):
        if one.name == name:
            return Scaled(getattr(group, name), one.metadata["power"])
    raise KeyError(name)


class Row(NamedTuple):
    """A number as a table shows it.

    Attributes:
        name: GROUP.NAME.
        value: for a leg of 0.48 m.
        scaled: at the scale that was asked for.
        unit, source, doc: as it was stated.
    """

    name: str
    value: Any
    scaled: Any
    unit: str
    source: str
    doc: str


def rows(name: str, group: Any, scale: float = 1.0) -> Iterator[Row]:
    """Numbers of a group.

    Args:
        name: the group's name.
        group: the group.
        scale: s = L / 0.48 m.
    """
    for one in fields(group):
        told, value = one.metadata, getattr(group, one.name)
        scaled_ = value
        if told["power"]:
            factor = scale ** told["power"]
            several = isinstance(value, tuple)
            scaled_ = tuple(v * factor for v in value) if several else value * factor
        yield Row(f"{name}.{one.name}", value, scaled_, told["unit"], told["source"], told["doc"])
