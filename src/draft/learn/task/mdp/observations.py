"""Observation terms that mjlab lacks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch

from draft.learn.task.mdp.access import ground_of, robot_of

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv


def joint_velocity(env: ManagerBasedRlEnv, noise: float = 0.0) -> torch.Tensor:
    """Joint velocities [rad/s], shape (worlds, joints).

    Args:
        env: the environment.
        noise: half width of the uniform noise, per no-load speed of each joint.
    """
    robot = robot_of(env)
    velocity = robot.data.joint_vel
    if not noise:
        return velocity
    return velocity + (2 * torch.rand_like(velocity) - 1) * noise * robot.no_load_speed


def height_scan(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Height of the trunk above the points of the scan [m], shape (worlds, points)."""
    return ground_of(env).scan()


def foot_height(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Height of the feet's centres above the ground [m], shape (worlds, feet)."""
    return ground_of(env).feet()


def design(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Features of each world's design, shape (worlds, features); see `features`."""
    return robot_of(env).design
