"""Robots side by side at one scale, walking on the spot or in their home poses, as plain data.

`robots.js` draws them. Marks on the floor that pass below a robot show its speed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.drawing import geoms, packed
from draft.model import Model
from draft.model.picture import corners
from draft.model.scene import home
from draft.reporting.subjects import Subject
from draft.values import Array

YAW = 0.75  # of every robot, away from the camera [rad]
MARK = 0.2  # Distance between two marks on the floor [m].
_GAP = 0.12  # Room between two robots, per largest side of the first.
_MARGIN = 0.02  # Room around a gait for the frames between those that are looked at [m].
_EVERY = 3  # Of these frames one is used to find the room that a gait takes.
_LINE = 0.35  # Room for a line of text on the floor before the robots, per height of all.
_STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
_MOST = 32767  # Largest number of 16 bits.


def figure(subjects: Sequence[Subject]) -> dict[str, Any] | None:
    """Robots, the box that holds them, and the squares' width [m]; None if no design has a model.

    Robots are in a row along y, the first at the left of a camera that looks along -x.
    """
    drawn = [(subject, subject.model) for subject in subjects if subject.model is not None]
    if not drawn:
        return None
    robots, ends = [], []
    edge = 0.0
    for subject, model in drawn:
        positions, quaternions = _poses(subject, model)
        low, high = _room(model, positions, quaternions)
        shift = np.array([-(low[0] + high[0]) / 2, edge - low[1], 0.0])
        edge += float(high[1] - low[1]) + _GAP * float(max(high - low))
        robots.append(_robot(subject, model, positions + shift, quaternions))
        robots[-1]["at"] = (shift[:2] + (low + high)[:2] * [0, 0.5]).tolist()
        robots[-1]["half"] = (0.5 * (high - low)[:2]).tolist()
        ends += [low + shift, high + shift]
    box = np.array([np.min(ends, axis=0), np.max(ends, axis=0)])
    box[0, 2] = min(box[0, 2], 0.0)
    front = float(box[1, 0])
    box[1, 0] += _LINE * float(np.ptp(box[:, 2]))
    return {
        "box": box.tolist(),
        "front": (front + float(box[1, 0])) / 2,
        "square": square(float(np.ptp(box[:, 1]))),
        "mark": MARK,
        "robots": robots,
    }


def square(span: float) -> float:
    """Width of the floor's squares [m], the largest of which three fit into a span."""
    return max((step for step in _STEPS if span / step >= 3), default=_STEPS[0])


def walks(subject: Subject) -> bool:
    """Whether a design has a recorded gait."""
    return subject.gait is not None and subject.gait.walks


def _poses(subject: Subject, model: Model) -> tuple[Array, Array]:
    """Positions [m] and orientations of the bodies in all frames, turned by `YAW`."""
    gait = subject.gait
    if gait is not None and gait.walks:
        positions, quaternions = gait.positions, gait.quaternions
    else:
        data = home(model.design, model.mujoco)
        positions, quaternions = data.xpos[None, 1:], data.xquat[None, 1:]
    c, s = math.cos(0.5 * YAW), math.sin(0.5 * YAW)
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    turned = np.stack((c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w), axis=-1)
    c, s = math.cos(YAW), math.sin(YAW)
    return positions @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), turned


def _room(model: Model, positions: Array, quaternions: Array) -> tuple[Array, Array]:
    """Corners of the room that a robot takes in all poses [m], each of shape (3,)."""
    data = home(model.design, model.mujoco)
    bodies = np.repeat(model.mujoco.geom_bodyid, 8)  # A box has 8 corners.
    away = corners(model.mujoco, data) - data.xpos[bodies]
    points = np.einsum("nji,nj->ni", data.xmat[bodies].reshape(-1, 3, 3), away)
    found = np.array(list(_extents(points, bodies - 1, positions, quaternions)))
    margin = _MARGIN if len(positions) > 1 else 0.0
    return found[:, 0].min(axis=0) - margin, found[:, 1].max(axis=0) + margin


def _extents(
    points: Array, bodies: NDArray[np.integer], positions: Array, quaternions: Array
) -> Iterator[tuple[Array, Array]]:
    """Least and largest coordinates of points of the bodies, in some of the frames."""
    turned = np.empty(9)
    for place, turns in zip(positions[::_EVERY], quaternions[::_EVERY], strict=True):
        frames = np.empty((len(turns), 3, 3))
        for body, turn in enumerate(turns):
            mujoco.mju_quat2Mat(turned, turn.copy())
            frames[body] = turned.reshape(3, 3)
        moved = np.einsum("nij,nj->ni", frames[bodies], points) + place[bodies]
        yield moved.min(axis=0), moved.max(axis=0)


def _robot(subject: Subject, model: Model, positions: Array, quaternions: Array) -> dict[str, Any]:
    """What the page draws of one robot."""
    quantum = float(np.abs(positions).max()) / _MOST
    gait = subject.gait
    return {
        "label": f"{subject.title}, {subject.design.mass:.1f} kg",
        "color": subject.color,
        "geoms": geoms(model.mujoco),
        "ahead": [math.cos(YAW), math.sin(YAW)],
        "frames": len(positions),
        "bodies": positions.shape[1],
        "quantum": quantum,
        "positions": packed(np.rint(positions / quantum), "i2"),
        "quaternions": packed(np.rint(quaternions * _MOST), "i2"),
        **(
            {"period": gait.period, "travel": packed(gait.travel, "f4"), "stride": gait.stride}
            if gait is not None and gait.walks
            else {}
        ),
    }
