"""Triangles of shapes: boxes, cylinders and spheres around the origin, and meshes.

Vertices are duplicated at edges, so that a cylinder is shaded smoothly and its caps are flat.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from draft.model.shapes import Shape
from draft.values import Array

# A multiple of four, so that a round shape has its full width along its axes.
SEGMENTS = 32
_RINGS = 16


class Triangles(NamedTuple):
    """Triangles of a solid.

    Attributes:
        points: vertices [m], shape (points, 3).
        normals: outward unit normals at the vertices, shape (points, 3).
        faces: vertices of each triangle, counter-clockwise from outside, shape (F, 3).
    """

    points: Array
    normals: Array
    faces: NDArray[np.int64]


def triangles(shape: Shape, segments: int = SEGMENTS) -> Triangles:
    """Triangles of a shape in its own frame [m].

    Args:
        shape: the shape.
        segments: vertices around a round shape.
    """
    if shape.mesh is not None:
        return _flat(shape.mesh.vertices[shape.mesh.faces()])
    size = shape.size
    if shape.form == "box":
        return _scaled(_box(), size)
    if shape.form == "sphere":
        return _scaled(_sphere(segments), np.repeat(size[0], 3))
    return _scaled(_cylinder(segments), size[[0, 0, 1]])


def _scaled(unit: Triangles, size: Array) -> Triangles:
    """Scale a unit solid; the normals stay right for boxes, round cylinders and spheres."""
    return Triangles(unit.points * size, unit.normals, unit.faces)


def _flat(corners: Array) -> Triangles:
    """Flat-shaded triangles from their corners, shape (F, 3, 3)."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # A triangle without area has no normal; any is right.
    normals = np.where(length > 0, normals / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return Triangles(corners.reshape(-1, 3), np.repeat(normals, 3, axis=0), faces)


@lru_cache(maxsize=1)
def _box() -> Triangles:
    corners = []
    for axis in range(3):
        u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        for side in (1.0, -1.0):
            middle = side * np.eye(3)[axis]
            a, b, c, d = (middle + x * u + side * y * v for x, y in _SQUARE)
            corners += [(a, b, c), (a, c, d)]
    return _flat(np.array(corners))


_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))


@lru_cache(maxsize=4)
def _cylinder(segments: int) -> Triangles:
    """Cylinder of radius 1 from z = -1 to 1: the side, then both caps as fans."""
    angle = 2 * np.pi * np.arange(segments) / segments
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(segments)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    low, high = circle - up, circle + up
    points = np.vstack([low, high, low, high])
    normals = np.vstack([circle, circle, np.tile(-up, (segments, 1)), np.tile(up, (segments, 1))])
    i = np.arange(segments)
    j = (i + 1) % segments
    side = np.vstack(
        [np.stack([i, j, segments + j], 1), np.stack([i, segments + j, segments + i], 1)]
    )
    k = np.arange(1, segments - 1)
    zero = np.zeros_like(k)
    fan = np.stack([zero, k, k + 1], axis=1)
    caps = np.vstack([fan[:, ::-1] + 2 * segments, fan + 3 * segments])
    return Triangles(points, normals, np.vstack([side, caps]))


@lru_cache(maxsize=4)
def _sphere(segments: int) -> Triangles:
    """Sphere of radius 1, as rings from pole to pole."""
    polar = np.pi * np.arange(_RINGS + 1) / _RINGS
    angle = 2 * np.pi * np.arange(segments) / segments
    rings = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)),
            np.outer(np.sin(polar), np.sin(angle)),
            np.outer(np.cos(polar), np.ones(segments)),
        ],
        axis=2,
    )
    faces = []
    for ring in range(_RINGS):
        for i in range(segments):
            a, b = ring * segments + i, ring * segments + (i + 1) % segments
            c, d = a + segments, b + segments
            faces += [] if ring == 0 else [(a, c, b)]
            faces += [] if ring == _RINGS - 1 else [(b, c, d)]
    points = rings.reshape(-1, 3)
    return Triangles(points, points, np.array(faces, dtype=np.int64))
