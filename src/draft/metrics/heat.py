"""Thermal metrics: time to overheating, payload for a time, payload in motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.design.bands import half_widths
from draft.design.loads import home_loads, loads
from draft.errors import DraftError
from draft.laws import limits
from draft.metrics.registry import metric
from draft.metrics.speed import top_speed
from draft.metrics.statics import (
    carrying,
    least,
    payload_at,
    payload_limits,
    standing_torque_rated,
)
from draft.metrics.walking import DUTY, joint_rate, stance_torque, swing_torque
from draft.values import Mask, Value, divide, exp, maximum, sqrt, where

_STALLED = limits.limits().stalled
_STALL = limits.limits().stall_share.coefficient
_OVERLOAD = "overload times of seven modules at stall, docs/limits.md"
LIMITS = ("rated torque", "peak torque", "top speed")


HOUR = 3600.0


@metric(
    unit="kg",
    formula=f"as payload_rated with {limits.torque_for(HOUR):.3f} tau_rated",
    source=_OVERLOAD,
    better="more",
    limits=payload_limits(limits.torque_for(HOUR)),
    base="floating or arm",
)
def payload_hour(design: Design) -> Value:
    """Mass on the trunk in the crouch, or at the tip of an arm at its reach, held for an hour [kg].

    Beside what it carries already. `payload_for` gives other times, and the 90 % band.
    """
    return payload_at(design, limits.torque_for(HOUR))


@metric(
    unit="s",
    formula=f"{_STALLED.coefficient:.0f} ((tau / {_STALL:.3f} tau_rated)^2 - 1)^"
    f"{_STALLED.exponent:.2f} at the worst joint in the home pose",
    source=_OVERLOAD,
    better="more",
)
def hold_time(design: Design) -> Value:
    """Time that the robot can hold the home pose with what it carries [s].

    inf if every joint can hold its torque without end. Stalled actuators of one vendor: half of the
    modules held out are within a factor of two of the predicted time, 90 % within `hold_time_fold`.
    """
    if not home_loads(design):
        return math.nan
    return limits.hold_time(standing_torque_rated(design))


@metric(
    unit="s",
    formula="as hold_time, with payload_peak at the tip of the arm at its reach",
    source=_OVERLOAD,
    better="more",
    base="arm",
)
def payload_peak_time(design: Design) -> Value:
    """Time that the arm can hold its payload_peak at its reach, until a joint is too hot [s]."""
    mass = payload_at(design, math.inf)
    torques = ((abs(x.torque + mass * x.per_mass), x.actuator) for x in carrying(design))
    return least(limits.hold_time(divide(torque, a.rated_torque)) for torque, a in torques)


def hold_time_fold() -> float:
    """Fold within which 90 % of modules held out are of the predicted time to hold a torque."""
    return _STALLED.band(0.9)


class Payload(NamedTuple):
    """Mass [kg] that can be held for a time, and the ends of its 90 % band."""

    mass: Value
    low: Value
    high: Value


def payload_for(design: Design, seconds: float) -> Payload:
    """Mass that can be held for a time [kg]: on the trunk in the crouch, or by an arm at its reach.

    The band has the error of the time that a stalled module holds a torque, and that of the rated
    torque where it is not the part's own; the peak torque limits both. Its ends are negative where
    the robot alone is too heavy.

        >>> design = draft.load("quadruped").resolve("cheetah")
        >>> found = draft.metrics.payload_for(design, 3600)
        >>> bool(found.low < found.mass < found.high)
        True

    Args:
        design: one design, or N.
        seconds: the time [s].

    Raises:
        DraftError: the time is not a positive number.
    """
    if not 0 < seconds < math.inf:
        raise DraftError(f"a time of {seconds} s", "give a time above zero")
    fold = hold_time_fold()
    share, less, more = (limits.torque_for(seconds, f) for f in (1.0, 1.0 / fold, fold))
    widths = [
        half_widths(a, of=("rated_torque",)).get("rated_torque", 0.0)
        for a in {id(x.actuator): x.actuator for x in carrying(design)}.values()
    ]
    width = maximum(*widths) if widths else 0.0
    down, up = (sqrt(width * width + math.log(end / share) ** 2) for end in (less, more))
    with np.errstate(all="ignore"):
        return Payload(
            payload_at(design, share),
            payload_at(design, share * exp(-1.0 * down)),
            payload_at(design, share * exp(up)),
        )


class Carry(NamedTuple):
    """Whether and how well a robot carries a mass at a speed.

    Attributes:
        accepted: whether every margin is at least 1.
        margin: smallest ratio of what is available to what is needed [1].
        joint: the joint that limits it; for N designs an array of names, shape (N,).
        limit: "rated torque", "peak torque" or "top speed"; for N designs an array, shape (N,).
    """

    accepted: Mask
    margin: Value
    joint: str | NDArray[Any]
    limit: str | NDArray[Any]


class _Margin(NamedTuple):
    margin: Value
    joint: str
    limit: str


def carry(design: Design, mass: Value, speed: Value = 0.0) -> Carry:
    """Whether a robot carries a mass on its trunk, standing or walking at a speed.

    At speed 0 it stands on all legs; in motion it walks as `draft.metrics.walking` says. Every
    joint must have the torque of stance at its speed on its torque-speed line, and the root mean
    square of its torque over a stride must not exceed its rated torque. In swing the leg's own
    weight counts, its acceleration does not. The speed must not exceed `top_speed`.

        >>> design = draft.load("quadruped").resolve("cheetah")
        >>> draft.metrics.carry(design, mass=10, speed=1).joint
        'FL_knee'

    Args:
        design: one design, or N.
        mass: mass on the trunk [kg], a float or shape (N,).
        speed: forward speed [m/s], a float or shape (N,).

    Raises:
        DraftError: mass or speed is negative, or the robot has no legs.
    """
    for name, value in (("mass", mass), ("speed", speed)):
        if not np.all(np.asarray(value) >= 0):
            raise DraftError(f"a {name} of {value}", "give zero or more")
    with np.errstate(all="ignore"):
        found = list(_margins(design, mass, speed))
    if not found:
        cause = f"'{design.name}' has no legs with knees and actuators"
        raise DraftError(cause, "compare robots that stand on legs")
    shape = () if design.count is None else (design.count,)
    columns = np.broadcast_arrays(np.empty(shape), *(one.margin for one in found))[1:]
    table = np.array(columns, dtype=np.float64)
    least = table.min(axis=0)
    # Legs that are copies tie but for rounding: the first of them is named.
    which = np.argmax(table <= least * (1 + 1e-9), axis=0)
    if table.ndim == 1:
        worst = found[int(which)]
        return Carry(bool(least >= 1), float(least), worst.joint, worst.limit)
    names = np.array([one.joint for one in found])[which]
    kinds = np.array([one.limit for one in found])[which]
    return Carry(least >= 1, least, names, kinds)


def _margins(design: Design, mass: Value, speed: Value) -> Iterator[_Margin]:
    """Margins of every joint of the legs, and of the speed."""
    moving = speed > 0
    part = where(moving, DUTY, 1.0)
    for load in loads(design):
        a, name = load.actuator, load.joint.names[0]
        swing, held = swing_torque(load), stance_torque(load, mass, part)
        rms = sqrt(part * held * held + (1.0 - part) * swing * swing)
        yield _Margin(divide(a.rated_torque, rms), name, LIMITS[0])
        turning = abs(joint_rate(load, loads(design))) * speed
        yield _Margin(divide(a.available(turning), abs(held)), name, LIMITS[1])
        if load.joint is load.leg.knee:
            yield _Margin(divide(top_speed(design), speed), name, LIMITS[2])
