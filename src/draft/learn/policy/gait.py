"""Recorded gaits: poses of all bodies of a robot that walks on the spot of a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.learn.bodies.legged import legged_robot
from draft.learn.policy.reduced import AnyPolicy
from draft.learn.policy.validity import Fit, fit, train_command
from draft.learn.policy.walk import Walk
from draft.model import Model

Array = NDArray[np.float64]
SECONDS = 8.0  # Longest recording [s].
_SHORTEST = 3.0  # Shortest loop [s].
_SETTLING = 1.5  # Time after the start from rest that is not recorded [s].
_SMOOTH = 0.5  # Half the time over which the path is averaged [s].


@dataclass(frozen=True, eq=False)
class Gait:
    """A recorded gait that can be repeated, or the reason why there is none.

    The horizontal motion and the turning of the robot's path are taken out of the poses: the robot
    faces +x, and its path passes under the origin.

    Attributes:
        positions: positions of the bodies but the world [m], shape (frames, bodies, 3).
        quaternions: their orientations (w, x, y, z), shape (frames, bodies, 4).
        travel: distance walked since the first frame [m], shape (frames,).
        stride: distance walked from the first frame of one round to that of the next [m].
        period: time between two frames [s].
        command: commanded forward speed [m/s].
        speed: mean speed along the path [m/s].
        note: what lies outside the policy's region of validity; "" for nothing.
        reason: why the robot stands; "" where it walks.
        remedy: command that trains a policy for it; "" where none can be.
    """

    positions: Array
    quaternions: Array
    travel: Array
    stride: float
    period: float
    command: float
    speed: float
    note: str
    reason: str
    remedy: str

    @property
    def walks(self) -> bool:
        """Whether there is a gait."""
        return not self.reason


def record(model: Model, seconds: float = SECONDS, policies: Sequence[AnyPolicy] = ()) -> Gait:
    """Record the gait of a robot with the policy that fits it best.

    It walks straight ahead at half the largest speed of the policy's training.

    Args:
        model: the robot; the filter may have refused it.
        seconds: longest duration of one round [s].
        policies: policies of one's own, see `draft.learn.policy.validity.fit`.

    Returns:
        The gait; one without frames where no policy drives the robot, or where it falls.
    """
    remedy = train_command(model.design)
    try:
        found = fit(model, policies=policies)
        walk = Walk(model, found, (0.5 * found.policy.forward, 0.0, 0.0))
    except DraftError as error:
        return _standing(error.problems[0].cause, "", remedy if _has_legs(model) else "")
    poses, quaternions, headings = _roll(walk, seconds)
    if walk.first_fall is not None:
        reason = f"it falls after {walk.first_fall:.1f} s"
        if found.inside:
            reason += f" with the policy of {found.name}"
        return _standing(reason, found.warning, remedy)
    return _looped(found, poses, quaternions, headings, remedy)


def _has_legs(model: Model) -> bool:
    """Whether a policy can be trained for a robot."""
    try:
        legged_robot(model.design, model)
    except DraftError:
        return False
    return True


def _standing(reason: str, note: str, remedy: str) -> Gait:
    empty = np.zeros((0, 0, 3)), np.zeros((0, 0, 4)), np.zeros(0)
    return Gait(*empty, 0.0, 0.0, 0.0, 0.0, note, reason, remedy)


def _roll(walk: Walk, seconds: float) -> tuple[Array, Array, Array]:
    """Positions, orientations and headings [rad] of the frames, with margins to average over.

    It ends at the first fall.
    """
    period = walk.fit.policy.control_period
    walk.advance(_SETTLING)
    positions, quaternions, headings = [], [], []
    for _ in range(round((seconds + 2 * _SMOOTH) / period) + 1):
        if walk.falls:
            break
        mujoco.mj_kinematics(walk.model, walk.data)
        positions.append(walk.data.xpos[1:].copy())
        quaternions.append(walk.data.xquat[1:].copy())
        x, y = walk.heading
        headings.append(np.arctan2(y, x))
        walk.advance(period)
    return np.array(positions), np.array(quaternions), np.unwrap(headings)


def _looped(found: Fit, positions: Array, quaternions: Array, headings: Array, remedy: str) -> Gait:
    """Take the path out of a recording, and cut it where its end resembles its start."""
    period = found.policy.control_period
    half = round(_SMOOTH / period)
    path = _averaged(positions[:, 0, :2], half)
    turned = _averaged(headings[:, None], half)[:, 0]
    inner = slice(half, len(positions) - half)
    cosine, sine = np.cos(turned)[:, None], np.sin(turned)[:, None]
    away = positions[inner].copy()
    away[..., :2] -= path[:, None]
    x, y = away[..., 0].copy(), away[..., 1].copy()
    away[..., 0], away[..., 1] = cosine * x + sine * y, cosine * y - sine * x
    back = np.stack((np.cos(-turned / 2), np.sin(-turned / 2)), axis=1)[:, None]
    # Product of the rotation about z by -turned and each orientation.
    w, i, j, k = np.moveaxis(quaternions[inner], -1, 0)
    c, s = back[..., 0], back[..., 1]
    facing = np.stack((c * w - s * k, c * i - s * j, c * j + s * i, c * k + s * w), axis=-1)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    travel = np.concatenate(([0.0], np.cumsum(steps)))
    end = _round_end(away, round(_SHORTEST / period))
    return Gait(
        away[:end],
        facing[:end],
        travel[:end],
        float(travel[end]),
        period,
        0.5 * found.policy.forward,
        float(travel[end] / (end * period)),
        found.warning,
        "",
        remedy,
    )


def _round_end(positions: Array, shortest: int) -> int:
    """Frame after which the first one follows with the least jump of position and velocity."""
    velocity = np.diff(positions, axis=0)
    jump = ((positions[1:-1] - positions[0]) ** 2).sum(axis=(1, 2))
    # A frame lasts much less than a stride: weigh its motion over four of them.
    jump += 16 * ((velocity[1:] - velocity[0]) ** 2).sum(axis=(1, 2))
    least = min(shortest, len(jump) - 1)
    return least + int(jump[least:].argmin()) + 1


def _averaged(values: Array, half: int) -> Array:
    """Moving average over 2 `half` + 1 rows, where all of them exist."""
    sums = np.cumsum(np.concatenate((np.zeros((1, values.shape[1])), values)), axis=0)
    return (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
