"""Energy of a walking robot: electrical power, cost of transport, endurance and range.

The electrical power of a joint is its mechanical power where it drives the joint, plus the heat of
its motor. A joint that brakes returns nothing to the battery unless a share of regeneration is
given. The heat is that of `draft.laws.limits.copper_loss`. Cost of transport, endurance and
range are those of the whole robot: the power of its electronics is added.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from draft.design.bands import Band
from draft.design.battery import Battery, usual
from draft.design.electronics import usual_electronics
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.measuring.scalars import Curve
from draft.metrics.energy import travel_of

NAMES = ("cost_of_transport", "endurance", "range")


def supply(member: LeggedRobot) -> tuple[float, Band, bool]:
    """Energy of a robot's battery [Wh], its 90 % band, and whether the design states a battery."""
    if member.battery:
        energy, low, high = member.battery
        return energy, Band(low, high), True
    found: Battery = usual(member.mass)
    return float(found.energy), found.band, False


def electronics_power(member: LeggedRobot) -> float:
    """Power of a robot's computers, sensors and idle drives [W]: stated, or usual for its mass."""
    if member.electronics:
        return member.electronics[0]
    return float(usual_electronics(member.mass).power)


def supply_record(member: LeggedRobot) -> dict[str, Any]:
    """The battery and the power of the electronics as plain data."""
    energy, band, stated = supply(member)
    return {
        "energy_wh": energy,
        "band_of_energy_wh": [*map(float, band)],
        "origin": _origin(stated),
        "electronics_w": electronics_power(member),
        "electronics_origin": _origin(bool(member.electronics)),
    }


def _origin(stated: bool) -> str:
    return "stated" if stated else "usual for its mass"


def add_energy(by_test: Mapping[str, Curve], member: LeggedRobot, payload: float = 0.0) -> None:
    """Add cost of transport, endurance [h] and range [m] to curves that have power and speed.

    They are those of the median power, with the electronics, and the median speed of a level; None
    where either is missing or not above zero.

    Args:
        by_test: curves of one robot.
        member: the robot.
        payload: mass that it carries [kg], part of the mass that is moved.
    """
    energy, mass = supply(member)[0], member.mass + payload
    idle = electronics_power(member)
    for curve in by_test.values():
        pairs = zip(curve.get("power", []), curve["speed"], strict=True)
        rows = [
            travel_of(energy, mass, idle + power, speed) if power and speed and speed > 0 else None
            for power, speed in pairs
        ]
        for i, name in enumerate(NAMES):
            curve[name] = [None if row is None else float(row[i]) for row in rows]
