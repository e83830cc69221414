"""Estimate of the speed that legs and motors allow."""

from __future__ import annotations

import math

from draft.design import Design
from draft.design.legs import GRAVITY, legs
from draft.design.loads import loads
from draft.metrics.registry import metric
from draft.metrics.walking import joint_rate, stance_torque
from draft.values import Value, divide, minimum, some, sqrt, where

SWING, FROUDE = 0.74, 1.13


@metric(
    unit="m/s",
    formula="min(0.74 w_no_load L_shank, 1.13 sqrt(g L))",
    source="arXiv 2609.38405, released code",
    better="more",
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
            minimum(SWING * knee.no_load_speed * leg.shank, FROUDE * sqrt(GRAVITY * leg.length))
            for leg in found
            if (knee := leg.knee.actuator) is not None
        )
    )
    loaded = design.payload_mass > 0
    if not some(loaded):
        return speed
    return where(loaded, minimum(speed, _speed_of_torque(design)), speed)


def _speed_of_torque(design: Design) -> Value:
    """Speed at which the first joint of a leg in stance has no torque left [m/s]."""
    found = loads(design)
    return minimum(
        *(
            divide(x.actuator.fastest(abs(stance_torque(x, 0.0))), abs(joint_rate(x, found)))
            for x in found
        )
    )
