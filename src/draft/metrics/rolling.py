"""Rolling on driven wheels: speed, slopes and power on hard level ground. Closed form.

Rolling takes a force C_r M g that the driven wheels share alike; a wheel of radius r also turns
against the friction and the damping of its own actuator. Source: Gillespie, Fundamentals of Vehicle
Dynamics, SAE 1992, chapter 4.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.actuators import Actuator
from draft.design.electronics import electronics
from draft.design.legs import GRAVITY
from draft.design.loads import loads
from draft.metrics.limiting import Limit
from draft.metrics.registry import metric
from draft.metrics.statics import heat, least
from draft.spec.primitives.wheel import WheelPart
from draft.values import Value, clip, divide, maximum, scalar, where

# Rolling resistance over weight [1]: car tyres on concrete, table 4.1 of the source. Small hard
# wheels on smooth floors are near it, soft tyres and carpets well above.
RESISTANCE = 0.015
_SOURCE = "Gillespie 1992, Fundamentals of Vehicle Dynamics, chapter 4"
SPEED = 1.0  # Speed of the metric of power [m/s].


class Driven(NamedTuple):
    """A driven wheel that the robot stands on: name of its joint, actuator and radius [m]."""

    joint: str
    actuator: Actuator
    radius: Value


def driven_wheels(design: Design) -> list[Driven]:
    """Driven wheels that a robot stands on, in the order of the tree."""
    return [
        Driven(body.prefix + joint.name, actuator, end.radius)
        for body in (design.bodies[i] for i in design.feet)
        if (joint := body.joint) is not None and joint.rolls
        if (actuator := design.drive(joint)) is not None
        if isinstance(end := body.link.end, WheelPart)
    ]


def _torque(design: Design, wheel: Driven, count: int) -> Value:
    """Torque at a wheel that rolling takes, without damping [N m]."""
    force = RESISTANCE * GRAVITY * design.mass / count
    return force * wheel.radius + wheel.actuator.friction_loss


def _fastest(design: Design, wheel: Driven, count: int) -> Value:
    """Speed at which a motor's line meets the torque that rolling takes [m/s]."""
    a, torque = wheel.actuator, _torque(design, wheel, count)
    turning = (a.stall_torque - torque) / (a.stall_torque / a.no_load_speed + a.damping)
    return wheel.radius * where(torque <= a.peak_torque, maximum(turning, 0.0), 0.0)


def _speed_limits(design: Design) -> Iterator[Limit]:
    found = driven_wheels(design)
    alike: dict[tuple[float, str], tuple[str, ...]] = {}
    for wheel in found:
        key = scalar(_fastest(design, wheel, len(found))), wheel.actuator.name
        alike[key] = (*alike.get(key, ()), wheel.joint)
    for (speed, actuator), joints in alike.items():
        yield Limit(speed, "torque-speed line", joints, actuator)


@metric(
    unit="m/s",
    formula="min of r (tau_stall - 0.015 M g r / n - tau_f) / (tau_stall / w_no_load + b)",
    source=_SOURCE,
    better="more",
    limits=_speed_limits,
    base="wheels",
)
def rolling_speed(design: Design) -> Value:
    """Speed of rolling on hard level ground [m/s].

    The slowest wheel counts. The drag of air is neglected: at 5 m/s it is some newtons.
    """
    found = driven_wheels(design)
    return least(_fastest(design, wheel, len(found)) for wheel in found)


@metric(
    unit="rad",
    formula="asin(sum of tau_peak / r / (M g))",
    source=_SOURCE,
    better="more",
    base="wheels",
)
def slope_peak(design: Design) -> Value:
    """Steepest slope that the driven wheels hold at their peak torques [rad].

    Neither friction with the ground nor the robot's balance limits it. A slope of pi/2 means that
    the wheels have more torque than the weight takes.
    """
    return _slope(design, "peak_torque")


@metric(
    unit="rad",
    formula="asin(sum of tau_rated / r / (M g))",
    source=_SOURCE,
    better="more",
    base="wheels",
)
def slope_rated(design: Design) -> Value:
    """Steepest slope that the driven wheels hold at their rated torques [rad].

    They hold it without end; else it is as `slope_peak`.
    """
    return _slope(design, "rated_torque")


def _slope(design: Design, quantity: str) -> Value:
    found = driven_wheels(design)
    if not found:
        return math.nan
    force = g.total(getattr(wheel.actuator, quantity) / wheel.radius for wheel in found)
    return np.arcsin(clip(force / (GRAVITY * design.mass), 0.0, 1.0))


@metric(
    unit="W",
    formula="standing_power + sum of tau w + k tau^2 at w = (1 m/s) / r",
    source=f"{_SOURCE}; heat k tau^2 of a motor, docs/limits.md",
    better="less",
    base="wheels",
)
def rolling_power(design: Design) -> Value:
    """Electrical power at 1 m/s on hard level ground [W].

    It is that of the electronics, of legs that hold the robot in the crouch, and of the wheels. NaN
    for wheels that do not reach that speed.
    """
    return rolling_power_at(design, SPEED)


def rolling_power_at(design: Design, speed: Value) -> Value:
    """Electrical power of rolling on hard level ground [W]; NaN beyond the rolling speed.

    Args:
        design: one design, or N.
        speed: speed [m/s].
    """
    found = driven_wheels(design)
    if not found:
        return math.nan
    held = g.total(map(heat, loads(design))) if loads(design) else 0.0
    power = electronics(design).power + held
    for wheel in found:
        turning = divide(speed, wheel.radius)
        torque = _torque(design, wheel, len(found)) + wheel.actuator.damping * turning
        power = power + torque * turning + wheel.actuator.copper_loss * torque * torque
    return where(speed <= rolling_speed(design), power, math.nan)
