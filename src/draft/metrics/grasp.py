"""Grasps between two tips of a hand, from a grid of poses of each finger.

Two tips hold an object between them where the line that joins them is in the friction cone of both
(Nguyen 1988, IJRR 7(3), theorem for two soft contacts). The normal of a tip is the direction in
which the last joint of its finger moves it. Balls at the tips have their radius; collisions and the
weight of fingers are neglected, and both sides of a finger count as pads.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.cached import once
from draft.design.limbs import limbs
from draft.geometry import Frame, Vector
from draft.metrics.registry import metric
from draft.metrics.stretch import Chain, chain
from draft.metrics.workspace import of_each
from draft.values import Array, Value

POSES = 500  # of each finger, about: a grid over the ranges of its joints, ends included
FRICTION = 0.5  # of a contact, as between plastics
TOUCH = 0.01  # distance at which two tips touch [m]
_NGUYEN = "Nguyen 1988, IJRR 7(3): two soft contacts whose cones contain the line between them"
_CONE = f"between tips whose normals are within atan {FRICTION} of the line"


class Grasp(NamedTuple):
    """Grasps between two tips of a hand.

    Attributes:
        smallest, largest: diameter of objects between opposed tips [m]; 0 without any.
        force: force with which the best two tips press on an object [N], median of their grasps.
        opposed: largest share of the poses of one finger in which the tip of another touches it.
    """

    smallest: Value
    largest: Value
    force: Value
    opposed: Value


class _Finger(NamedTuple):
    """A finger as numbers: its joints, the radius of its tip [m] and peak torques [N m]."""

    chain: Chain
    radius: Value
    torques: tuple[Value, ...]


class _Poses(NamedTuple):
    """Tips, shape (poses, 3), unit normals, and levers of the joints, shape (joints, poses, 3)."""

    tips: Array
    normals: Array
    levers: Array


@once
def grasps(design: Design) -> Grasp:
    """Grasps of a design; zeros without two tips that oppose each other."""
    fingers = []
    for limb in limbs(design).fingers:
        joints = [joint for k in limb.joints if (joint := design.bodies[k].joint) is not None]
        torques = tuple(a.peak_torque for a in map(design.drive, joints) if a is not None)
        fingers.append(_Finger(chain(design, limb), limb.radius, torques))
    found = of_each(design, tuple(fingers), _grasps)
    return Grasp(*(found.T if isinstance(found, np.ndarray) else found))


@metric(
    unit="m",
    formula=f"min of the gap {_CONE}",
    source=_NGUYEN,
    better="less",
    base="hand",
    sampled=True,
)
def grasp_smallest(design: Design) -> Value:
    """Diameter of the smallest object that two opposed fingertips hold between them [m].

    0 if they touch, or if no two tips oppose each other.
    """
    return grasps(design).smallest


@metric(
    unit="m",
    formula=f"max of the gap {_CONE}",
    source=_NGUYEN,
    better="more",
    base="hand",
    sampled=True,
)
def grasp_largest(design: Design) -> Value:
    """Diameter of the largest object that two opposed fingertips hold [m].

    0 if no two tips oppose each other.
    """
    return grasps(design).largest


@metric(
    unit="N",
    formula="median over grasps of min over joints of tau_peak / |u . dx_tip/dq|, of the best two "
    "tips",
    source=f"tau = J' f; {_NGUYEN}",
    better="more",
    base="hand",
    sampled=True,
)
def pinch_force(design: Design) -> Value:
    """Force with which two opposed fingertips press on an object, at peak torque [N].

    The weaker of the two counts. 0 if no two tips oppose each other.
    """
    return grasps(design).force


@metric(
    unit="1",
    formula=f"max over fingers of the share of poses with an opposed tip within {TOUCH} m",
    source="after Kapandji 1986, Ann Chir Main 5(1), over a grid of poses instead of ten places",
    better="more",
    base="hand",
    sampled=True,
)
def opposability(design: Design) -> Value:
    """Largest share of the poses of one finger in which the tip of another can touch it [1]."""
    return grasps(design).opposed


def _grasps(fingers: tuple[_Finger, ...]) -> tuple[float, float, float, float]:
    poses = [_poses(one) for one in fingers]
    smallest, largest, force, share = math.inf, 0.0, 0.0, 0.0
    for a, b in itertools.combinations(range(len(fingers)), 2):
        line = poses[b].tips[None] - poses[a].tips[:, None]
        length = np.sqrt(np.einsum("ijk,ijk->ij", line, line))
        cone = length / math.hypot(1.0, FRICTION)
        aligned = [
            abs(np.einsum(how, line, poses[k].normals)) >= cone
            for how, k in (("ijk,ik->ij", a), ("ijk,jk->ij", b))
        ]
        opposed = aligned[0] & aligned[1] & (length > 0)
        if not opposed.any():
            continue
        i, j = np.nonzero(opposed)
        away = length[i, j]
        gap = np.maximum(away - fingers[a].radius - fingers[b].radius, 0.0)
        smallest, largest = min(smallest, gap.min()), max(largest, gap.max())
        unit = line[i, j] / away[:, None]
        held = np.minimum(
            _force(fingers[a], poses[a].levers[:, i], unit),
            _force(fingers[b], poses[b].levers[:, j], unit),
        )
        force = max(force, float(np.median(held)))
        near = gap <= TOUCH
        for of, rows in ((a, i), (b, j)):
            share = max(share, len(np.unique(rows[near])) / len(poses[of].tips))
    return (0.0 if math.isinf(smallest) else float(smallest)), float(largest), force, share


def _force(finger: _Finger, levers: Array, unit: Array) -> Array:
    """Force of a tip along unit directions at which the first joint is at its peak torque [N]."""
    torques = np.array(finger.torques)[:, None]
    return (torques / abs(np.einsum("ijk,jk->ij", levers, unit))).min(axis=0)


def _poses(finger: _Finger) -> _Poses:
    chain = finger.chain
    free = [chain.segments[j] for j in chain.driven]
    levels = max(2, round(POSES ** (1.0 / len(free))))
    grid = np.meshgrid(*(np.linspace(one.low, one.high, levels) for one in free))
    count = grid[0].size
    frames: list[Frame] = [g.ORIGIN]
    for one, position in zip(
        chain.segments, chain.positions([a.ravel() for a in grid]), strict=True
    ):
        frames.append(one.frame(frames[-1], position))
    tip = g.add(frames[-1][0], g.rotate(frames[-1][1], chain.tip))
    moved: dict[int, Vector] = {}
    for one, (origin, rotation) in zip(chain.segments, frames[1:], strict=True):
        axis = g.rotate(rotation, one.axis)
        own = axis if one.slide else g.cross(axis, g.subtract(tip, origin))
        of, ratio = (
            (one.body, 1.0) if one.follows is None else (one.follows.body, one.follows.ratio)
        )
        moved[of] = g.add(moved.get(of, g.ZERO), g.scale(own, ratio))
    levers = np.stack([_rows(moved[one.body], count) for one in free])
    size = np.linalg.norm(levers[-1], axis=1, keepdims=True)
    return _Poses(_rows(tip, count), levers[-1] / np.maximum(size, 1e-12), levers)


def _rows(vector: Vector, count: int) -> Array:
    return np.stack([np.broadcast_to(x, (count,)) for x in vector], axis=1)
