"""Brackets without mass, drawn from the trunk to a part on it that does not touch it."""

from __future__ import annotations

import numpy as np

from draft import geometry as g
from draft.design.design import Body
from draft.geometry import Vector
from draft.spec.primitives.base import Geom
from draft.spec.primitives.loft import FRAMES, Loft
from draft.values import Value, clip, is_array, maximum, minimum, where

# Radius of a bracket, as a share of the smallest size of the solid that it holds.
_SLENDER = 0.4
# Distance of its root from the ends of the trunk as a share of the length, and the part of the
# sections' half widths in which it begins: half of them lies inside every chamfered rectangle.
_INSET, _WITHIN = 0.02, 0.5


def bracket(loft: Loft, axis: str, body: Body, held: Geom) -> Geom:
    """Return the bracket of a body on the trunk, in the frame of the trunk.

    It begins inside the loft near the solid and ends in the centre of the solid; at a joint with a
    member, it ends in the joint, with all joints at zero.

    Args:
        loft: the trunk.
        axis: direction of the loft.
        body: a body whose parent is the trunk.
        held: the solid of the body to hold.
    """
    at_joint = body.joint is not None and body.link.member is not None
    inner = g.ZERO if at_joint else held.center
    end = g.add(body.position, g.rotate(body.rotation, inner))
    start = _inside(loft, axis, end)
    radius = _SLENDER * minimum(*held.size)
    along = g.subtract(end, start)
    length = g.norm(along)
    # In a design whose solid lies in the trunk, the bracket has no direction of its own.
    short = length < radius
    unit = g.scale(along, 1.0 / maximum(length, radius))
    x, y, z = unit
    direction = (where(short, 0.0, x), where(short, 0.0, y), where(short, 1.0, z))
    center = g.scale(g.add(start, end), 0.5)
    size = (radius, maximum(length, radius))
    return Geom("_bracket", "structure", "cylinder", center, size, None, direction, collides=False)


def _inside(loft: Loft, axis: str, point: Vector) -> Vector:
    """Point inside the trunk near another one [m]."""
    corners = loft.vertices.reshape(loft.sections, loft.corners, *loft.vertices.shape[1:])
    lows, highs = corners.min(axis=1), corners.max(axis=1)
    along, first, second = FRAMES[axis]

    def number(values: np.ndarray, section: int, axis: int) -> Value:
        value = values[section, axis]
        return value if is_array(value) else float(value)

    places = [number(lows, k, along) for k in range(loft.sections)]
    inset = _INSET * (places[-1] - places[0])
    at = clip(point[along], places[0] + inset, places[-1] - inset)
    found: list[Value] = [0.0, 0.0, 0.0]
    found[along] = at
    for across in (first, second):
        low, high = number(lows, 0, across), number(highs, 0, across)
        for k in range(1, loft.sections):
            t = clip((at - places[k - 1]) / (places[k] - places[k - 1]), 0.0, 1.0)
            low = low + t * (number(lows, k, across) - number(lows, k - 1, across))
            high = high + t * (number(highs, k, across) - number(highs, k - 1, across))
        middle, half = (low + high) / 2, _WITHIN * (high - low) / 2
        found[across] = clip(point[across], middle - half, middle + half)
    return (found[0], found[1], found[2])
