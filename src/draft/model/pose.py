"""A robot's model in a pose, and the coordinates of its base."""

from __future__ import annotations

import mujoco
from numpy.typing import ArrayLike

UPRIGHT = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def base_coordinates(model: mujoco.MjModel) -> tuple[int, int]:
    """Numbers of coordinates and of degrees of freedom of the base, which come first.

    Args:
        model: a robot, alone or in its scene.

    Returns:
        (7, 6) for a floating base, (0, 0) for one that is bolted to the world.
    """
    floating = model.njnt > 0 and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    return (7, 6) if floating else (0, 0)


def put(model: mujoco.MjModel, data: mujoco.MjData, angles: ArrayLike) -> None:
    """Put a floating base upright at the origin and the joints at angles; update positions.

    Args:
        model: a robot.
        data: its state.
        angles: joint positions [rad or m], shape (joints,).
    """
    first, _ = base_coordinates(model)
    data.qpos[:first] = UPRIGHT[:first]
    data.qpos[first:] = angles
    mujoco.mj_kinematics(model, data)
