"""Estimate of the speed that legs and motors allow."""

from __future__ import annotations

import math

from draft.design import Design
from draft.design.legs import GRAVITY, legs
from draft.metrics.registry import metric
from draft.values import Value, minimum, sqrt

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
    gaits of three quadrupeds.
    """
    found = legs(design)
    if not found or any(leg.knee.actuator is None for leg in found):
        return math.nan
    return minimum(
        *(
            minimum(SWING * knee.no_load_speed * leg.shank, FROUDE * sqrt(GRAVITY * leg.length))
            for leg in found
            if (knee := leg.knee.actuator) is not None
        )
    )
