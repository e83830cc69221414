"""Quantities of an actuator: the table that files, sizing, expressions, reports and plots read.

The keys of `parameters.yaml` and its schema, the names that expressions read, the rows of tables,
the titles of axes and the units of fits all come from the fields of `Quantities`.
"""

# ruff: noqa: RUF009 - `_line` gives a field, not a default.
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

from draft.values import Value

CORNER = "corner_speed"
# The law of a quantity that the fitted trend of its name predicts, from quantities above it.
TREND = "trend"
# Quantities that expressions read and nobody states; and friction, which no law predicts.
_READ_ONLY: dict[str, Any] = {"stated": False, "row": False}
_FREE: dict[str, Any] = {"row": False, "may_be_zero": True, "default": 0.0}


@dataclass(frozen=True, slots=True)
class Identity:
    """A law without coefficients, such as N^2 J.

    Attributes:
        text: the identity, with short symbols.
        inputs: names of the quantities that it depends on, above its own in the table.
        value: the quantity from its inputs, in SI units; floats or arrays of shape (N,).
    """

    text: str
    inputs: tuple[str, ...]
    value: Callable[..., Value]


@dataclass(frozen=True, slots=True)
class Quantity:
    """Line of the table of quantities.

    Attributes:
        unit: SI unit; "1" for none.
        label: words in tables and plots.
        text: description with the unit, for the reference of the files, editors and the studio.
        law: what gives it where it is not stated: `TREND`, an `Identity`, or None for those that
            follow from several others (`draft.design.actuators`).
        shown: unit in tables and plots, and the factor from the SI unit; "" for that unit.
        stated: whether files and callers can state it.
        row: whether tables of an actuator have a row for it.
        may_be_zero: whether zero is a valid value; all others are above zero.
        default: value unless stated, of a quantity without a law.
    """

    unit: str
    label: str
    text: str
    law: str | Identity | None = None
    shown: tuple[str, float] = ("", 1.0)
    stated: bool = True
    row: bool = True
    may_be_zero: bool = False
    default: float | None = None

    @property
    def table_unit(self) -> str:
        """Unit in tables; "" for none."""
        return self.shown[0] or ("" if self.unit == "1" else self.unit)

    @property
    def factor(self) -> float:
        """Factor from the SI unit to that of tables and plots."""
        return self.shown[1]

    @property
    def axis(self) -> str:
        """Title of an axis, with the unit."""
        return f"{self.label} [{self.table_unit or '1'}]"


def _line(unit: str, label: str, text: str, **more: Any) -> Any:
    """Field of `Quantities` with its line; the arguments are those of `Quantity`."""
    return field(metadata={"line": Quantity(unit, label, text, **more)})


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Quantities:
    """The numbers of an actuator, in the order of tables and files."""

    peak_torque: Value = _line("N m", "peak torque", "Peak torque at the output [N m].")
    rated_torque: Value = _line(
        "N m",
        "rated torque",
        "Rated torque at the output [N m]: what the module holds without end, turning, on the heat "
        "sink that its vendor names. Default: that of the part, else a share of the peak.",
    )
    no_load_speed: Value = _line("rad/s", "no-load speed", "No-load speed at the output [rad/s].")
    corner_speed: Value = _line(
        "rad/s",
        "corner speed",
        "Highest speed with full peak torque [rad/s], or `trend` for that of the part, else of "
        "modules with such a no-load speed. Default: 0, a straight line from standstill to the "
        "no-load speed.",
        may_be_zero=True,
    )
    gear_ratio: Value = _line("1", "reduction", "Reduction: motor turns per output turn.")
    peak_power: Value = _line(
        "W",
        "peak power",
        "Peak mechanical power [W]. Default: torque x speed / 4, or what a stated corner gives.",
    )
    aspect_ratio: Value = _line("1", "length / diameter", "Length over diameter of the module.")
    mass: Value = _line("kg", "mass", "Mass of the whole module [kg].", law=TREND)
    volume: Value = _line(
        "m3", "volume", "Volume of the enclosing cylinder [m3].", shown=("cm³", 1e6), **_READ_ONLY
    )
    radius: Value = _line(
        "m",
        "radius",
        "Radius of the module [m]; of a servo, that of a circle of the area of its box across the "
        "axis.",
        shown=("mm", 1e3),
    )
    length: Value = _line(
        "m", "length", "Length of the module along its axis [m].", shown=("mm", 1e3)
    )
    width: Value = _line(
        "m",
        "width",
        "Shorter edge across the axis of the box of a servo [m]; twice the radius of a module.",
        shown=("mm", 1e3),
        stated=False,
    )
    height: Value = _line(
        "m",
        "height",
        "Longer edge across the axis of the box of a servo [m]; twice the radius of a module.",
        shown=("mm", 1e3),
        stated=False,
    )
    rotor_inertia: Value = _line(
        "kg m2",
        "rotor inertia",
        "Inertia of the rotor about its axis, on the motor side [kg m2].",
        law=TREND,
        shown=("kg cm²", 1e4),
    )
    armature: Value = _line(
        "kg m2",
        "armature",
        "Rotor inertia at the output [kg m2]. Default: reduction squared x rotor inertia.",
        law=Identity("N^2 J", ("gear_ratio", "rotor_inertia"), lambda n, j: n * n * j),
        shown=("kg m²", 1.0),
    )
    friction_loss: Value = _line(
        "N m", "friction loss", "Dry friction at the output [N m].", **_FREE
    )
    damping: Value = _line(
        "N m s/rad", "damping", "Viscous friction at the output [N m s/rad].", **_FREE
    )


QUANTITIES: dict[str, Quantity] = {one.name: one.metadata["line"] for one in fields(Quantities)}
# A property of the torque-speed line.
QUANTITIES["stall_torque"] = Quantity(
    "N m", "stall torque", "Torque at standstill without the current limit [N m].", **_READ_ONLY
)
