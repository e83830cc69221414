"""Estimate of the speed that legs and motors allow."""

from __future__ import annotations

import math
from collections.abc import Iterator

from draft.design import Design
from draft.design.actuators import Actuator
from draft.design.legs import GRAVITY, Leg, legs
from draft.design.loads import LegLoad, loads
from draft.metrics.limiting import Limit, at_joint
from draft.metrics.registry import metric
from draft.metrics.walking import joint_rate, stance_torque
from draft.values import Value, divide, minimum, scalar, some, sqrt, where

SWING, FROUDE = 0.74, 1.13


def _limits(design: Design) -> Iterator[Limit]:
    for leg in legs(design):
        if leg.knee.actuator is None:
            return
        yield at_joint(leg.knee, leg.knee.actuator, "no-load speed", _swing(leg, leg.knee.actuator))
        yield Limit(scalar(_froude(leg)), "leg length")
    if some(design.payload_mass > 0):
        for x in loads(design):
            yield at_joint(x.joint, x.actuator, "torque-speed line", _fastest(x, loads(design)))


@metric(
    unit="m/s",
    formula="min(0.74 w_no_load L_shank, 1.13 sqrt(g L))",
    source="arXiv 2609.38405, released code",
    better="more",
    limits=_limits,
    base="floating",
)
def top_speed(design: Design) -> Value:
    """Estimate of the top speed from the swing of the shank and the Froude number [m/s].

    For walking and trotting; the slowest kind of leg counts. Both constants were fitted to trained
    gaits of three quadrupeds. With a payload also the speed counts at which a joint of a leg in
    stance has no torque left (`draft.metrics.walking`).
    """
    found = legs(design)
    if not found or any(leg.knee.actuator is None for leg in found):
        return math.nan
    speed = minimum(
        *(
            minimum(_swing(leg, knee), _froude(leg))
            for leg in found
            if (knee := leg.knee.actuator) is not None
        )
    )
    loaded = design.payload_mass > 0
    if not some(loaded):
        return speed
    return where(loaded, minimum(speed, _speed_of_torque(design)), speed)


def _swing(leg: Leg, knee: Actuator) -> Value:
    """Speed at which the shank swings with the knee at its no-load speed [m/s]."""
    return SWING * knee.no_load_speed * leg.shank


def _froude(leg: Leg) -> Value:
    """Speed at the largest Froude number of a gait [m/s]."""
    return FROUDE * sqrt(GRAVITY * leg.length)


def _speed_of_torque(design: Design) -> Value:
    """Speed at which the first joint of a leg in stance has no torque left [m/s]."""
    found = loads(design)
    return minimum(*(_fastest(x, found) for x in found))


def _fastest(load: LegLoad, of: tuple[LegLoad, ...]) -> Value:
    """Speed at which a joint of a leg in stance has no torque left [m/s]."""
    turning = load.actuator.fastest(abs(stance_torque(load, 0.0)))
    return divide(turning, abs(joint_rate(load, of)))
