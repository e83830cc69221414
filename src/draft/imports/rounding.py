"""Roundings of a reduced robot's geometry, finer where they would add up along its chains."""

from __future__ import annotations

import math

import numpy as np

from draft.imports.reduce import Body, Reduced
from draft.values import Array

# Decimals of lengths [m] in the spec of an ordinary robot, and of one with long chains.
COARSE, FINE = 5, 8
# Longest chain that is written coarsely [hinges], and what the roundings of the axes along a chain
# may turn its end by there [rad]: two thirds of what the check of the geometry allows.
LONG_CHAIN, ROUNDED_TURN = 20, 1.2e-4


def tidy(reduced: Reduced) -> None:
    """Round anchors and axes, so that differences of them are exact.

    Anchors are rounded to 10 um and axes to 1e-6, or to an axis of the trunk. Where that adds up
    along a chain, both are written finer: see `Reduced.digits`.
    """
    turns: dict[Body, tuple[int, float]] = {}
    for body in reduced.root.all():
        count, turn = turns.get(body.parent, (0, 0.0)) if body.parent else (0, 0.0)
        gap = float(np.linalg.norm(_rounded(body.axis, COARSE) - body.axis))
        turns[body] = count + 1, turn + turned(body, gap)
    most, turn = (max(values) for values in zip(*turns.values(), strict=True))
    if most > LONG_CHAIN or turn > ROUNDED_TURN:
        reduced.digits = FINE
    for body in reduced.root.all():
        body.anchor = np.round(body.anchor, reduced.digits) + 0.0
        body.axis = _rounded(body.axis, reduced.digits)


def turned(body: Body, gap: float) -> float:
    """Most that what hangs on a hinge is turned by if its axis is off by a small angle [rad]."""
    furthest = min(max(map(abs, body.limits)), math.pi)
    return 0.0 if body.slides else 2 * math.sin(furthest / 2) * gap


def _rounded(axis: Array, digits: int) -> Array:
    """Axis with one decimal more than lengths have, or the axis of the trunk that it is."""
    if not axis.any():
        return axis
    near = np.round(axis)
    snapped = np.abs(axis - near).max() < 10.0**-digits
    return (near if snapped else np.round(axis, digits + 1)) + 0.0
