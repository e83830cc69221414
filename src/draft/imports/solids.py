"""Primitives of a description as triangles, so that they are cut like meshes."""

from __future__ import annotations

import numpy as np

from draft.description.description import Geometry
from draft.values import Array

AROUND = 16
ALONG = 4


def triangles(shape: Geometry) -> Array:
    """Triangles of a box, sphere, cylinder or capsule in its link's frame [m], (n, 3, 3).

    Returns:
        None of them, shape (0, 3, 3), for other shapes.
    """
    rings = _rings(shape)
    if rings is None:
        return np.zeros((0, 3, 3))
    lower, upper = rings[:-1], rings[1:]
    a, b = lower, np.roll(lower, -1, axis=1)
    c, d = upper, np.roll(upper, -1, axis=1)
    sides = np.concatenate([np.stack([a, b, c], axis=2), np.stack([b, d, c], axis=2)], axis=1)
    ends = []
    for ring in (rings[0], rings[-1]):
        middle = np.broadcast_to(ring.mean(axis=0), ring.shape)
        ends.append(np.stack([ring, np.roll(ring, -1, axis=0), middle], axis=1))
    own = np.concatenate([sides.reshape(-1, 3, 3), *ends])
    return own @ np.array(shape.rotation, float).T + np.array(shape.position, float)


def _rings(shape: Geometry) -> Array | None:
    """Rings of points around z from the lowest to the highest [m], shape (rings, points, 3)."""
    if shape.kind == "box" and len(shape.size) == 3:
        x, y, z = np.array(shape.size) / 2
        ring = np.array([[x, y, 0.0], [-x, y, 0.0], [-x, -y, 0.0], [x, -y, 0.0]])
        up = np.array([0.0, 0.0, z])
        return np.stack([ring - up, ring + up])
    if shape.kind == "cylinder" and len(shape.size) == 2:
        radius, length = shape.size
        return _turned([(radius, -length / 2), (radius, length / 2)])
    if shape.kind == "sphere" and shape.size:
        radius, length = shape.size[0], 0.0
    elif shape.kind == "capsule" and len(shape.size) == 2:
        radius, length = shape.size
    else:
        return None
    half = np.linspace(0.0, np.pi / 2, ALONG + 1)
    upper = [
        (radius * float(np.cos(turn)), length / 2 + radius * float(np.sin(turn))) for turn in half
    ]
    outline = [*((r, -z) for r, z in reversed(upper)), *upper]
    return _turned(outline)


def _turned(outline: list[tuple[float, float]]) -> Array:
    """Points of an outline of radius and height, turned around z."""
    angles = np.arange(AROUND) * 2 * np.pi / AROUND
    around = np.stack([np.cos(angles), np.sin(angles), np.zeros(AROUND)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([radius * around + height * up for radius, height in outline])
