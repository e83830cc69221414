"""Mass properties of rigid bodies: change of frame, sum, and equivalent box."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import cast

import numpy as np

from draft.description.description import Axes, Inertial, Point
from draft.geometry import Matrix, Vector
from draft.values import Array


def rotated(inertia: Axes, rotation: Axes) -> Axes:
    """Inertia in rotated axes, R I R^T."""
    turn = np.array(rotation)
    return _axes(turn @ np.array(inertia) @ turn.T)


def moved(body: Inertial, position: Vector, rotation: Matrix) -> Inertial:
    """Mass properties of a body in a frame in which its own frame has the given pose."""
    turn = np.array(rotation)
    com = turn @ np.array(body.com) + np.array(position)
    return Inertial(body.mass, _point(com), _axes(turn @ np.array(body.inertia) @ turn.T))


def combined(bodies: Iterable[Inertial]) -> Inertial:
    """Mass properties of the union of bodies, all in one frame (parallel-axis theorem)."""
    parts = list(bodies)
    mass = math.fsum(part.mass for part in parts)
    if mass <= 0:
        return Inertial(0.0, (0.0, 0.0, 0.0), _axes(np.zeros((3, 3))))
    com = sum((part.mass * np.array(part.com) for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        arm = np.array(part.com) - com
        shift = part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        inertia += np.array(part.inertia) + shift
    return Inertial(mass, _point(com), _axes(inertia))


def box(body: Inertial) -> Point:
    """Edges of the solid box with the same mass and principal inertias [m], longest first.

    The square of the edge along axis 3 is 6 (I1 + I2 - I3) / m; it is zero if I3 > I1 + I2, which
    no solid has.
    """
    if body.mass <= 0:
        return (0.0, 0.0, 0.0)
    principal = np.linalg.eigvalsh(np.array(body.inertia))
    squares = 6.0 * (principal.sum() - 2.0 * principal) / body.mass
    a, b, c = sorted((math.sqrt(max(float(square), 0.0)) for square in squares), reverse=True)
    return (a, b, c)


def _point(vector: Array) -> Point:
    return cast(Point, tuple(map(float, vector)))


def _axes(matrix: Array) -> Axes:
    return cast(Axes, tuple(tuple(map(float, row)) for row in matrix))
