"""Quantities of an actuator: the table that files, sizing, expressions, reports and plots read.

The keys of `parameters.yaml` and its schema, the names that expressions read, the rows of tables,
the titles of axes and the units of fits all come from `QUANTITIES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from draft.values import Value

CORNER = "corner_speed"


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


# The law of a quantity that the fitted trend of its name predicts, from quantities above it.
TREND = "trend"


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number of an actuator class.

    Attributes:
        name: name in files, expressions and Python.
        unit: SI unit; "1" for none.
        label: words in tables and plots.
        text: description with the unit, for the reference of the files, editors and the studio.
        law: what gives it where it is not stated: `TREND`, an `Identity`, or None for those that
            follow from several others (`draft.design.actuators`).
        shown_in: unit in tables and plots; "" for the SI unit.
        factor: factor from the SI unit to that one.
        stated: whether files and callers can state it.
        row: whether tables of an actuator have a row for it.
        may_be_zero: whether zero is a valid value; all others are above zero.
        default: value unless stated, of a quantity without a law.
    """

    name: str
    unit: str
    label: str
    text: str
    law: str | Identity | None = None
    shown_in: str = ""
    factor: float = 1.0
    stated: bool = True
    row: bool = True
    may_be_zero: bool = False
    default: float | None = None

    @property
    def table_unit(self) -> str:
        """Unit in tables; "" for none."""
        return self.shown_in or ("" if self.unit == "1" else self.unit)

    @property
    def axis(self) -> str:
        """Title of an axis, with the unit."""
        return f"{self.label} [{self.table_unit or '1'}]"


# In the order of tables and files.
QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("peak_torque", "N m", "peak torque", "Peak torque at the output [N m]."),
        Quantity(
            "rated_torque",
            "N m",
            "rated torque",
            "Rated torque at the output [N m]: what the module holds without end, turning, on the "
            "heat sink that its vendor names. Default: that of the part, else a share of the peak.",
        ),
        Quantity("no_load_speed", "rad/s", "no-load speed", "No-load speed at the output [rad/s]."),
        Quantity(
            CORNER,
            "rad/s",
            "corner speed",
            "Highest speed with full peak torque [rad/s], or `trend` for that of the part, else of "
            "modules with such a no-load speed. Default: 0, a straight line from standstill to the "
            "no-load speed.",
            may_be_zero=True,
        ),
        Quantity(
            "stall_torque",
            "N m",
            "stall torque",
            "Torque of the motor at standstill without its current limit [N m].",
            stated=False,
            row=False,
        ),
        Quantity("gear_ratio", "1", "reduction", "Reduction: motor turns per output turn."),
        Quantity(
            "peak_power",
            "W",
            "peak power",
            "Peak mechanical power [W]. Default: torque x speed / 4, or what a stated corner "
            "gives.",
        ),
        Quantity("aspect_ratio", "1", "length / diameter", "Length over diameter of the module."),
        Quantity("mass", "kg", "mass", "Mass of the whole module [kg].", TREND),
        Quantity(
            "volume",
            "m3",
            "volume",
            "Volume of the enclosing cylinder [m3].",
            shown_in="cm³",
            factor=1e6,
            stated=False,
            row=False,
        ),
        Quantity("radius", "m", "radius", "Radius of the module [m].", shown_in="mm", factor=1e3),
        Quantity(
            "length",
            "m",
            "length",
            "Length of the module along its axis [m].",
            shown_in="mm",
            factor=1e3,
        ),
        Quantity(
            "rotor_inertia",
            "kg m2",
            "rotor inertia",
            "Inertia of the rotor about its axis, on the motor side [kg m2].",
            TREND,
            shown_in="kg cm²",
            factor=1e4,
        ),
        Quantity(
            "armature",
            "kg m2",
            "armature",
            "Rotor inertia at the output [kg m2]. Default: reduction squared x rotor inertia.",
            Identity(
                "N^2 J",
                ("gear_ratio", "rotor_inertia"),
                lambda ratio, inertia: ratio * ratio * inertia,
            ),
            shown_in="kg m²",
        ),
        Quantity(
            "friction_loss",
            "N m",
            "friction loss",
            "Dry friction at the output [N m].",
            row=False,
            may_be_zero=True,
            default=0.0,
        ),
        Quantity(
            "damping",
            "N m s/rad",
            "damping",
            "Viscous friction at the output [N m s/rad].",
            row=False,
            may_be_zero=True,
            default=0.0,
        ),
    )
}
