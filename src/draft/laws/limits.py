"""Laws of what a machine can sustain: overload times, torque-speed corners, batteries, electronics.

Coefficients, scores and bands come from `draft.fitting.limits`; docs/limits.md tells the data and
their doubts.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from draft.laws.law import Law
from draft.laws.torque_speed import stall_torque
from draft.values import Value, divide, maximum, minimum, power, sqrt, where

# Heat that a housing gives off [W/m2]: free convection and radiation of 12 W/(m2 K) together, as in
# textbooks of heat transfer (Incropera et al., table 1.1 and eq. 1.9), 75 K above its surroundings.
COOLING = 12.0 * 75.0
FILE = Path(__file__).resolve().parent / "data" / "limits.json"


@dataclass(frozen=True, slots=True)
class Limits:
    """Laws of what a machine can sustain.

    Attributes:
        stalled: time that a stalled actuator holds a torque [s], from its excess heat.
        rotating: the same of one that turns.
        stall_share: torque that a stalled actuator holds without end, over its rated torque [1].
        corner: highest speed with full peak torque [rad/s], from the no-load speed [rad/s].
        specific_energy: energy of a battery [Wh], from its mass [kg].
        battery_share: mass of a battery [kg], from the mass of the robot [kg].
        energy_share: energy of a battery [Wh], from the mass of the robot [kg].
        electronics_power: power that a robot draws without moving [W], from its mass [kg].
    """

    stalled: Law
    rotating: Law
    stall_share: Law
    corner: Law
    specific_energy: Law
    battery_share: Law
    energy_share: Law
    electronics_power: Law


@lru_cache(maxsize=1)
def limits() -> Limits:
    """Return the shipped laws."""
    record: Mapping[str, Mapping[str, object]] = json.loads(FILE.read_text(encoding="utf-8"))
    return Limits(**{name: Law.read(name, law) for name, law in record.items()})


def copper_loss(
    peak_torque: Value,
    no_load_speed: Value,
    corner_speed: Value,
    rated_torque: Value | None = None,
    surface: Value | None = None,
) -> Value:
    """Heat of a motor per torque squared [W/(N m)^2], the lesser of two estimates.

    By its line: w_no_load / tau_stall of a linear motor, with the corner of the trend where it has
    none, as every drive limits its current. That is an upper bound, since most of the voltage that
    is lacking at the corner is inductive. By its rating: at its rated torque it gives off what its
    housing can, `COOLING` for each square metre.

    Args:
        peak_torque: [N m].
        no_load_speed: [rad/s].
        corner_speed: highest speed with full peak torque [rad/s]; 0 for a straight line.
        rated_torque: [N m]; None for the line alone.
        surface: of its housing [m2]; None for the line alone.
    """
    corner = where(corner_speed > 0, corner_speed, limits().corner(no_load_speed))
    by_line = no_load_speed / stall_torque(peak_torque, no_load_speed, corner)
    if rated_torque is None or surface is None:
        return by_line
    return minimum(by_line, COOLING * surface / (rated_torque * rated_torque))


def hold_time(share: Value, fold: float = 1.0) -> Value:
    """Time that a stalled actuator holds a torque [s]; inf for one that it holds without end.

    Its excess heat is (torque / continuous torque)^2 - 1, and its continuous torque at stall is a
    share of the rated torque, which holds for a turning actuator.

    Args:
        share: torque over rated torque [1].
        fold: factor on the predicted time, such as an end of the band of the law.
    """
    law, stall = limits().stalled, limits().stall_share.coefficient
    excess = (share / stall) * (share / stall) - 1.0
    time = law.coefficient * power(maximum(excess, 1e-12), law.exponent)
    return fold * where(excess > 0, time, float("inf"))


def torque_for(seconds: float, fold: float = 1.0) -> float:
    """Torque over rated torque that a stalled actuator holds for a time [1].

    Args:
        seconds: the time [s].
        fold: as in `hold_time`, of which this is the inverse.
    """
    law, stall = limits().stalled, limits().stall_share.coefficient
    excess = power(divide(seconds, fold * law.coefficient), 1.0 / law.exponent)
    return float(stall * sqrt(1.0 + excess))


def turning_time(share: float) -> float:
    """Time that a turning actuator holds a torque [s]; inf for one that it holds without end.

    90 % of modules held out are within a factor of `limits().rotating.band(0.9)` of it.

    Args:
        share: root mean square torque over rated torque [1].
    """
    law, excess = limits().rotating, share * share - 1.0
    return law.coefficient * float(power(excess, law.exponent)) if excess > 0 else float("inf")


def turning_torque(seconds: float) -> float:
    """Torque over rated torque that a turning actuator holds for a time [1]."""
    law = limits().rotating
    return float(sqrt(1.0 + power(divide(seconds, law.coefficient), 1.0 / law.exponent)))
