"""What happens to a robot: its design, its own errors, and pushes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import torch
from mjlab.managers.event_manager import RecomputeLevel, requires_model_fields
from mjlab.utils.lab_api.math import quat_apply_inverse

from draft.learn.constants import Scaled
from draft.learn.lab.mdp import curriculums

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv
    from mjlab.managers.event_manager import EventTermCfg


@requires_model_fields("body_ipos", recompute=RecomputeLevel.set_const)
def shift_centre(env: ManagerBasedRlEnv, env_ids: Any, reach: Scaled) -> None:
    """Shift the trunk's centre of mass by up to `reach` [m] along each axis."""
    robot = env.scene["robot"]
    trunk = robot.indexing.root_body_id
    drawn = 2 * torch.rand(env.num_envs, 3, device=env.device) - 1
    positions: Any = env.sim.model.body_ipos
    positions[:, trunk] = positions[:, trunk] + drawn * robot.scaled(reach)[:, None]


class Pushes:
    """Add a velocity to the trunk now and then, without a transfer from the device.

    Parameters of the term: `linear` and `angular`, largest push along and about the world's x, y
    and z, each a Scaled; `interval`, shortest and longest time between two pushes, Scaled; `ramp`,
    (iteration, factor of the push); `steps` per iteration.
    """

    def __init__(self, cfg: EventTermCfg, env: ManagerBasedRlEnv) -> None:
        robot = env.scene["robot"]
        self._env, self._robot = env, robot
        params = cfg.params
        self._most = torch.stack(
            [robot.scaled(n) for n in (*params["linear"], *params["angular"])], dim=1
        )
        low, high = (robot.scaled(bound) for bound in params["interval"])
        self._low, self._span = low, high - low
        self.time_left = self._draw()

    def __call__(
        self,
        env: ManagerBasedRlEnv,
        env_ids: Any,
        linear: tuple[Scaled, ...],
        angular: tuple[Scaled, ...],
        interval: tuple[Scaled, Scaled],
        ramp: curriculums.Ramp,
        steps: int,
    ) -> None:
        """Count down, and push the worlds whose time has come."""
        self.time_left -= env.step_dt
        due = self.time_left < 1e-6
        self.time_left = torch.where(due, self._draw(), self.time_left)
        factor = curriculums.at(ramp, curriculums.iteration(env, steps))
        drawn = (2 * torch.rand_like(self._most) - 1) * self._most * factor * due[:, None]
        add_velocity(self._robot, drawn)

    def reset(self, env_ids: Any = None) -> None:
        """Start the time to the first push."""
        ids = slice(None) if env_ids is None else env_ids
        self.time_left[ids] = self._draw()[ids]

    def _draw(self) -> torch.Tensor:
        return self._low + self._span * torch.rand_like(self._low)


class Kicks:
    """Kick every world by its own size at given times.

    Parameters of the term: `most`, largest kick along the world's x and y of each world [m/s];
    `steps`, after how many steps of the environment they come.
    """

    def __init__(self, cfg: EventTermCfg, env: ManagerBasedRlEnv) -> None:
        self._robot = env.scene["robot"]
        self._most = torch.zeros(env.num_envs, 6, device=env.device)
        self._most[:, :2] = torch.tensor(cfg.params["most"], device=env.device)[:, None]

    def __call__(
        self, env: ManagerBasedRlEnv, env_ids: Any, most: tuple[float, ...], steps: tuple[int, ...]
    ) -> None:
        """Kick all worlds after the steps that are due."""
        if env.common_step_counter in steps:
            add_velocity(self._robot, (2 * torch.rand_like(self._most) - 1) * self._most)


def add_velocity(robot: Any, velocity: torch.Tensor) -> None:
    """Add to the trunk's velocity.

    Args:
        robot: the robot.
        velocity: linear [m/s] and angular [rad/s], both in the world's axes, shape (worlds, 6).
    """
    state, index = robot.data.data, robot.indexing
    quat = state.qpos[:, index.free_joint_q_adr[3:7]]
    v = index.free_joint_v_adr
    # A free joint's velocity is linear in the world's axes and angular in the body's.
    local = torch.cat((velocity[:, :3], quat_apply_inverse(quat, velocity[:, 3:])), dim=1)
    state.qvel[:, v] = state.qvel[:, v] + local
