"""Observation terms that mjlab does not have as they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch

from draft.learn.lab.mdp.rewards import GROUND

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv


def joint_velocity(env: ManagerBasedRlEnv, noise: float = 0.0) -> torch.Tensor:
    """Joint velocities [rad/s], shape (worlds, 12).

    Args:
        env: the environment.
        noise: half width of uniform noise, per no-load speed of each joint.
    """
    robot = env.scene["robot"]
    velocity = robot.data.joint_vel
    if not noise:
        return velocity
    return velocity + (2 * torch.rand_like(velocity) - 1) * noise * robot.no_load_speed


def height_scan(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Height of the trunk above the points of the scan [m], shape (worlds, points)."""
    return env.scene[GROUND].scan()


def foot_height(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Height of the feet's centres above the ground [m], shape (worlds, 4)."""
    return env.scene[GROUND].feet()


def design(env: ManagerBasedRlEnv) -> torch.Tensor:
    """What tells a world's design from others; see `draft.learn.features`."""
    return env.scene["robot"].design
