"""Static torques of the joints, and force and speed of a foot, in the crouch.

The robot stands on all its legs. The floor pushes up with the same force on every foot, at the end
of the last link of the leg. The position of the centre of mass between the feet is neglected, and
so are friction forces between the feet. The weight of the links of the legs is included.

The torque of a joint is tau = sum of m g dz/dq over what it moves - F dz_foot/dq, with F = M g / n
(Murray, Li, Sastry: A Mathematical Introduction to Robotic Manipulation, 1994, section 3.4).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.actuators import Actuator
from draft.design.cached import once
from draft.design.legs import GRAVITY, Leg, LegJoint, count, legs
from draft.metrics.registry import metric
from draft.values import Value, divide, minimum, where

_STATICS = "Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, 3.4"
# Share of the peak torque below which a torque is rounding error.
ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Load:
    """Static load of a driven joint in the crouch.

    Attributes:
        leg: the kind of leg that the joint belongs to.
        joint: the joint.
        actuator: its actuator.
        torque: torque that holds the robot [N m].
        per_mass: additional torque per mass added to the trunk [N m/kg].
    """

    leg: Leg
    joint: LegJoint
    actuator: Actuator
    torque: Value
    per_mass: Value


@once
def loads(design: Design) -> tuple[Load, ...]:
    """Static loads of the driven joints of all kinds of leg."""
    return tuple(_loads(design))


def _loads(design: Design) -> Iterator[Load]:
    n = count(design)
    for leg in legs(design):
        for joint in leg.joints:
            if joint.actuator is None:
                continue
            per_mass = joint.lift * (-GRAVITY / n)
            torque = GRAVITY * joint.hang + design.mass * per_mass
            yield Load(leg, joint, joint.actuator, torque, per_mass)


def joint_margins(design: Design) -> dict[str, Value]:
    """Peak torque over the torque that holds the robot in the crouch [1], by joint of the legs.

    inf for a joint without load.
    """
    margins = {}
    for load in loads(design):
        peak, torque = load.actuator.peak_torque, abs(load.torque)
        with np.errstate(divide="ignore"):
            margin = where(torque > ROUNDING * peak, divide(peak, torque), math.inf)
        margins |= dict.fromkeys(load.joint.names, margin)
    return margins


@metric(
    unit="1",
    formula="min of tau_peak / |sum m g dz/dq - (M g / n) dz_foot/dq| in the crouch",
    source=_STATICS,
    better="more",
)
def torque_margin(design: Design) -> Value:
    """Smallest ratio of peak torque to standing torque of the joints of the legs [1]."""
    return _least(divide(x.actuator.peak_torque, abs(x.torque)) for x in loads(design))


@metric(
    unit="kg",
    formula="min of (tau_peak - tau sign) / |(g / n) dz_foot/dq| in the crouch",
    source=_STATICS,
    better="more",
)
def payload(design: Design) -> Value:
    """Mass on the trunk at which the first joint reaches its peak torque [kg].

    Negative if a joint cannot hold the robot alone. Heat is neglected: for longer than a few
    seconds the payload is smaller.
    """
    return _least(
        divide(
            x.actuator.peak_torque - where(x.per_mass < 0, -1.0 * x.torque, x.torque),
            abs(x.per_mass),
        )
        for x in loads(design)
    )


@metric(
    unit="1",
    formula="min of tau_peak / |dz_foot/dq| / (M g) in the crouch",
    source=_STATICS,
    better="more",
)
def foot_force(design: Design) -> Value:
    """Vertical force of one foot at peak torque, per body weight [1].

    It is limited by the first joint that reaches its peak torque. The weight of the leg is
    neglected. The weakest kind of leg counts.
    """
    force = _least(divide(x.actuator.peak_torque, abs(x.joint.lift)) for x in loads(design))
    return force / (GRAVITY * design.mass)


@metric(
    unit="m/s",
    formula="sum of |dx_foot/dq| w_no_load in the crouch",
    source=_STATICS,
    better="more",
)
def foot_speed(design: Design) -> Value:
    """Forward speed of the foot with every joint at its no-load speed [m/s].

    The signs of the joint speeds are such that they add up. The slowest kind of leg counts.
    """
    found = loads(design)
    return _least(
        g.total(abs(x.joint.sweep) * x.actuator.no_load_speed for x in found if x.leg is leg)
        for leg in {id(x.leg): x.leg for x in found}.values()
    )


@metric(
    unit="W/kg",
    formula="sum of tau^2 w_no_load / tau_peak / M",
    source="arXiv 2609.38405, efficiency",
    better="less",
)
def cost_of_standing(design: Design) -> Value:
    """Copper loss of the motors of the legs in the crouch, per mass [W/kg].

    A motor with a straight torque-speed line that stalls at peak torque draws tau_peak w_no_load,
    all of it copper loss, which grows with the square of the torque. Real drives limit the current
    before they stall and lose less; the catalogue does not give the ratio.
    """
    found = loads(design)
    if not found:
        return math.nan
    losses = (
        x.leg.copies * x.torque * x.torque * (x.actuator.no_load_speed / x.actuator.peak_torque)
        for x in found
    )
    return g.total(losses) / design.mass


def _least(values: Iterator[Value]) -> Value:
    found = list(values)
    return minimum(*found) if found else math.nan
