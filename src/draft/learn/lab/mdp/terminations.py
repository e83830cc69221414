"""What ends an episode, besides mjlab's own terms; shapes are (worlds,)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import torch

from draft.learn.constants import Scaled

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv


def time_out(env: ManagerBasedRlEnv, length: Scaled) -> torch.Tensor:
    """Tell which worlds have walked for as long as an episode of their design lasts."""
    steps = torch.ceil(env.scene["robot"].scaled(length) / env.step_dt - 1e-6)
    return env.episode_length_buf >= steps


def low(env: ManagerBasedRlEnv, share: float) -> torch.Tensor:
    """Tell which trunks are lower above the mean of their feet than a share of the home height."""
    robot = env.scene["robot"]
    feet = robot.data.site_pos_w[:, robot.foot_sites, 2].mean(1)
    return robot.data.root_link_pos_w[:, 2] - feet < share * robot.height


def tilted(env: ManagerBasedRlEnv, limit: float) -> torch.Tensor:
    """Tell which trunks are tilted by more than a limit [rad]."""
    return env.scene["robot"].data.projected_gravity_b[:, 2] > -math.cos(limit)
