"""A metric."""

from __future__ import annotations

import numpy as np

from draft.extend import Design, Value, metric

GRAVITY = 9.81  # [m/s2]


@metric(unit="s", formula="T = sqrt(L / g)", source="linear inverted pendulum", better="more")
def fall_time(design: Design) -> Value:
    """Time constant of falling over, as an inverted pendulum of the leg length [s]."""
    # For one design the leg length is a float; for N designs it is an array of shape (N,).
    leg = design.leg_length
    return float("nan") if leg is None else np.sqrt(leg / GRAVITY)
