"""A robot's model in a pose, with the trunk at the origin."""

from __future__ import annotations

import mujoco
from numpy.typing import ArrayLike


def put(model: mujoco.MjModel, data: mujoco.MjData, angles: ArrayLike) -> None:
    """Put the trunk upright at the origin and the joints at angles; update positions.

    Args:
        model: a robot with a floating base.
        data: its state.
        angles: joint positions [rad or m], shape (joints,).
    """
    data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
    data.qpos[7:] = angles
    mujoco.mj_kinematics(model, data)
