"""Energy metrics: power while standing, endurance and range of the battery."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.battery import battery
from draft.design.electronics import electronics
from draft.design.legs import GRAVITY
from draft.design.loads import LegLoad, loads
from draft.errors import DraftError
from draft.metrics.limiting import Limit, shared_end
from draft.metrics.registry import metric
from draft.metrics.statics import cost_of_standing, heat
from draft.values import Value, divide, scalar

JOULES_PER_WATT_HOUR = 3600.0


@metric(
    unit="W",
    formula="electronics_power + cost_of_standing M",
    source="power of robots that stand, docs/limits.md; heat of the motors as cost_of_standing",
    better="less",
    base="floating",
)
def standing_power(design: Design) -> Value:
    """Electrical power while the robot stands in the crouch [W].

    It is that of computers, sensors and idle drives (`draft.design.electronics`), and the heat of
    the motors, an upper bound for motors with a current limit.
    """
    return electronics(design).power + cost_of_standing(design) * design.mass


def _endurance_limits(design: Design) -> Iterator[Limit]:
    """Time for which the battery would supply each consumer alone."""
    energy = battery(design).energy
    if loads(design):
        idle = divide(energy, electronics(design).power)
        yield Limit(scalar(idle), "power of the electronics")
    alike: dict[tuple[str, str], list[LegLoad]] = {}
    for x in loads(design):
        alike.setdefault((x.actuator.name, shared_end(x.joint.names)), []).append(x)
    for (actuator, _), own in alike.items():
        hours = scalar(divide(energy, g.total(map(heat, own))))
        joints = tuple(name for x in own for name in x.joint.names)
        yield Limit(hours, "heat of the motors", joints, actuator)


@metric(
    unit="h",
    formula="energy of the battery / standing_power",
    source="energy of surveyed batteries, docs/limits.md; power as standing_power",
    better="more",
    limits=_endurance_limits,
    base="floating",
)
def endurance_standing(design: Design) -> Value:
    """Time that the battery lasts while the robot stands in the crouch [h].

    Energy: 90 % of surveyed robots have within `draft.design.battery.Battery.band` of the usual
    one, and draw within `draft.design.electronics.Electronics.band`.
    """
    return divide(battery(design).energy, standing_power(design))


class Travel(NamedTuple):
    """Energy of a robot in motion.

    Attributes:
        cost_of_transport: electrical energy per weight and distance, P / (M g v) [1].
        endurance: time that the battery lasts [h].
        range: distance that it lasts [m].
    """

    cost_of_transport: Value
    endurance: Value
    range: Value


def travel(design: Design, power: Value, speed: Value) -> Travel:
    """Cost of transport, endurance and range from a measured electrical power.

        >>> design = draft.load("quadruped").resolve("cheetah")
        >>> round(draft.metrics.travel(design, power=300, speed=1.5).cost_of_transport, 2)
        0.61

    Args:
        design: one design, or N.
        power: mean electrical power of the motors [W]: mechanical power and heat, as `draft
            evaluate` measures them; that of the electronics is added.
        speed: mean speed [m/s].

    Raises:
        DraftError: power or speed is not above zero.
    """
    for name, value, unit in (("power", power, "W"), ("speed", speed, "m/s")):
        if not np.all((np.asarray(value) > 0) & (np.asarray(value) < math.inf)):
            cause = f"a {name} of {value} {unit}"
            raise DraftError(cause, "give numbers above zero")
    whole = power + electronics(design).power
    return travel_of(battery(design).energy, design.mass, whole, speed)


def travel_of(energy: Value, mass: Value, power: Value, speed: Value) -> Travel:
    """Cost of transport, endurance and range.

    Args:
        energy: energy of the battery [Wh].
        mass: mass that is moved [kg].
        power: mean electrical power [W], above zero.
        speed: mean speed [m/s], above zero.
    """
    hours = energy / power
    cost = power / (mass * GRAVITY * speed)
    return Travel(cost, hours, hours * JOULES_PER_WATT_HOUR * speed)
