"""Termination terms that mjlab lacks; each returns a mask of shape (worlds,)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import torch

from draft.learn.task.constants import Scaled
from draft.learn.task.world.access import robot_of

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv


def time_out(env: ManagerBasedRlEnv, length: Scaled) -> torch.Tensor:
    """Worlds whose episode has reached the length for their design [s]."""
    steps = torch.ceil(robot_of(env).scaled(length) / env.step_dt - 1e-6)
    return env.episode_length_buf >= steps


def low(env: ManagerBasedRlEnv, share: float) -> torch.Tensor:
    """Worlds whose trunk is lower above its feet's mean than a share of the home height."""
    robot = robot_of(env)
    feet = robot.data.site_pos_w[:, robot.foot_sites, 2].mean(1)
    return robot.data.root_link_pos_w[:, 2] - feet < share * robot.height


def tilted(env: ManagerBasedRlEnv, limit: float) -> torch.Tensor:
    """Worlds whose trunk is tilted by more than a limit [rad]."""
    return robot_of(env).data.projected_gravity_b[:, 2] > -math.cos(limit)
