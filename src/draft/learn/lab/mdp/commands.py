"""Velocity commands with ranges that grow with the design and with the curriculum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import torch
from mjlab.tasks.velocity.mdp import UniformVelocityCommandCfg
from mjlab.tasks.velocity.mdp.velocity_command import UniformVelocityCommand
from mjlab.utils.lab_api.math import wrap_to_pi

from draft.learn.constants import Scaled
from draft.learn.lab.ground import worlds_on
from draft.learn.lab.mdp import curriculums

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

# A command is fast above this share of the largest, and is compared after so long [s]; the largest
# may grow after so many samples per world.
_FAST, _LONG, _ENOUGH = 0.7, 1.5, 4


class Growth(NamedTuple):
    """A largest |vx| that grows once it is tracked.

    Attributes:
        start: largest |vx| at first [m/s].
        step: what it grows by [m/s].
        tracked: share of a fast command that counts as tracked.
    """

    start: Scaled
    step: Scaled
    tracked: float


class Away(NamedTuple):
    """Commands straight ahead along a heading that is held.

    Attributes:
        least, most: range of vx [m/s].
        share: share of commands that are such.
    """

    least: Scaled
    most: Scaled
    share: float


@dataclass(kw_only=True)
class VelocityCommandCfg(UniformVelocityCommandCfg):
    """Velocity commands; mjlab's `ranges` are only those of its sliders.

    Attributes:
        forward, sideways, turn: largest |vx|, |vy| [m/s], |wz| [rad/s].
        forward_least: least vx of commands straight ahead [m/s].
        limit: |vx| at most this share of the estimated top speed; None for no limit.
        limit_sideways: |vy| at most this share of that limit.
        ramp: (iteration, share of the largest |vx|).
        steps: steps per iteration.
        growth: how the largest |vx| grows by measured tracking; None for the ramp alone.
        away: commands that hold a heading; None for none.
    """

    forward: Scaled = Scaled(1.0)
    sideways: Scaled = Scaled(0.6)
    turn: Scaled = Scaled(0.5)
    forward_least: float = 0.3
    limit: float | None = None
    limit_sideways: float = 1.0
    ramp: curriculums.Ramp = ((0, 1.0),)
    steps: int = 24
    growth: Growth | None = None
    away: Away | None = None

    def build(self, env: ManagerBasedRlEnv) -> VelocityCommand:
        """The term."""
        return VelocityCommand(self, env)


class VelocityCommand(UniformVelocityCommand):
    """Draws commands without a transfer from the device.

    Attributes:
        held_share: largest |vx| per what it was without the limit, shape (worlds,).
        held: commands that stay, shape (worlds, 3); None where they are drawn.
        grown: steps by which the largest |vx| has grown, shape ().
    """

    cfg: VelocityCommandCfg  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(self, cfg: VelocityCommandCfg, env: ManagerBasedRlEnv) -> None:
        super().__init__(cfg, env)
        robot = env.scene[cfg.entity_name]
        forward, sideways = robot.scaled(cfg.forward), robot.scaled(cfg.sideways)
        largest = forward
        if cfg.limit is not None:
            most = cfg.limit * robot.top_speed
            largest = forward.minimum(most)
            sideways = sideways.minimum(cfg.limit_sideways * most)
        self.held_share = largest / forward
        self.largest = torch.stack((largest, sideways, robot.scaled(cfg.turn)), dim=1)
        self.held: torch.Tensor | None = None
        self._scale = robot.leg_scale
        # Time since a command was given [s]; samples of fast ones, what they ask for and what is
        # walked [m/s], summed.
        self._since = torch.zeros(self.num_envs, device=self.device)
        self._reached = torch.zeros(3, device=self.device)
        self.grown = torch.zeros((), device=self.device)
        flat = worlds_on(env, "flat")
        self._rising = torch.ones_like(self._scale, dtype=torch.bool) if flat is None else ~flat
        self._limit = None if cfg.limit is None else cfg.limit * robot.top_speed

    def hold(self, values: torch.Tensor) -> None:
        """Give every world a command that stays from now on, through resets too.

        Args:
            values: vx, vy [m/s] and wz [rad/s] in the trunk's frame, shape (worlds, 3).
        """
        self.held = values.clone()
        self._resample(torch.arange(self.num_envs, device=self.device))

    def range_now(self) -> torch.Tensor:
        """Largest |vx|, |vy|, |wz| of this moment of the curriculum, shape (worlds, 3)."""
        share = curriculums.at(self.cfg.ramp, curriculums.iteration(self._env, self.cfg.steps))
        largest = self.largest.clone()
        largest[:, 0] *= share
        if self.cfg.growth is not None:
            grow = self.cfg.growth
            now = grow.start.at(self._scale) + self.grown * grow.step.at(self._scale)
            largest[:, 0] = largest[:, 0].minimum(now)
        return largest

    def reset(self, env_ids: Any) -> dict[str, Any]:
        """Draw a new command; the metrics stay on the device."""
        extras = {}
        for name, values in self.metrics.items():
            extras[name] = values[env_ids].mean()
            values[env_ids] = 0.0
        self.command_counter[env_ids] = 0
        self._resample(env_ids)
        return extras

    def _resample_command(self, env_ids: torch.Tensor) -> None:
        cfg, n = self.cfg, len(env_ids)
        if self.held is not None:
            self.vel_command_b[env_ids] = self.held[env_ids]
            for who in (self.is_heading_env, self.is_standing_env, self.is_forward_env):
                who[env_ids] = False
            return
        self._since[env_ids] = 0.0
        drawn = 2 * torch.rand(n, 4, device=self.device) - 1
        chance = torch.rand(n, 3, device=self.device)
        value = drawn[:, :3] * self.range_now()[env_ids]
        ahead = chance[:, 2] < cfg.rel_forward_envs
        straight = torch.zeros_like(value)
        straight[:, 0] = value[:, 0].abs().clamp(min=cfg.forward_least)
        self.vel_command_b[env_ids] = torch.where(ahead[:, None], straight, value)
        self.heading_target[env_ids] = torch.pi * drawn[:, 3]
        self.is_heading_env[env_ids] = (chance[:, 0] < cfg.rel_heading_envs) & ~ahead
        self.is_standing_env[env_ids] = chance[:, 1] < cfg.rel_standing_envs
        self.is_forward_env[env_ids] = ahead
        if cfg.away is not None:
            self._lead_away(env_ids, cfg.away)

    def _grow(self, grow: Growth) -> None:
        """Compare fast commands with what is walked, and grow where enough of them is tracked."""
        self._since += self._env.step_dt
        asked, largest = self.vel_command_b[:, 0], self.range_now()[:, 0]
        fast = (asked.abs() > _FAST * largest) & (self._since > _LONG)
        walked = self.robot.data.root_link_lin_vel_b[:, 0] * asked.sign()
        sums = torch.stack((fast.float(), asked.abs() * fast, walked * fast), dim=1).sum(0)
        self._reached += sums
        count, wanted, reached = self._reached.unbind()
        enough = count >= _ENOUGH * self.num_envs
        self.grown += enough & (reached >= grow.tracked * wanted)
        self._reached *= ~enough

    def _lead_away(self, env_ids: torch.Tensor, away: Away) -> None:
        """Give commands straight ahead along the heading that the robot has.

        Robots on flat patches go on being asked for everything, or they would forget how to turn.
        """
        n = len(env_ids)
        scale = self._scale[env_ids]
        least, most = away.least.at(scale), away.most.at(scale)
        speed = least + torch.rand(n, device=self.device) * (most - least)
        if self._limit is not None:
            speed = speed * (self._limit[env_ids] / most).clamp(max=1.0)
        chosen = (torch.rand(n, device=self.device) < away.share) & self._rising[env_ids]
        straight = torch.zeros_like(self.vel_command_b[env_ids])
        straight[:, 0] = speed
        self.vel_command_b[env_ids] = torch.where(
            chosen[:, None], straight, self.vel_command_b[env_ids]
        )
        heading = self._heading()[env_ids]
        self.heading_target[env_ids] = heading.where(chosen, self.heading_target[env_ids])
        self.is_heading_env[env_ids] |= chosen
        self.is_standing_env[env_ids] &= ~chosen
        self.is_forward_env[env_ids] |= chosen

    def _heading(self) -> torch.Tensor:
        """Heading of the trunk as it was written last [rad]; derived fields lag after a reset."""
        data, index = self.robot.data.data, self.robot.indexing
        w, x, y, z = data.qpos[:, index.free_joint_q_adr[3:7]].unbind(1)
        return torch.atan2(2 * (w * z + x * y), 1 - 2 * (y.square() + z.square()))

    def _update_command(self, env_ids: torch.Tensor | None = None) -> None:
        cfg, value = self.cfg, self.vel_command_b
        self.heading_error = wrap_to_pi(self.heading_target - self.robot.data.heading_w)
        most = self.largest[:, 2]
        turn = (cfg.heading_control_stiffness * self.heading_error).clamp(-most, most)
        value[:, 2] = torch.where(self.is_heading_env, turn, value[:, 2])
        value *= ~self.is_standing_env[:, None]
        if cfg.growth is not None:
            self._grow(cfg.growth)
