"""Velocity commands with ranges that grow with the design and with the curriculum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import torch
from mjlab.tasks.velocity.mdp import UniformVelocityCommandCfg
from mjlab.tasks.velocity.mdp.velocity_command import UniformVelocityCommand
from mjlab.utils.lab_api.math import wrap_to_pi

from draft.learn.task.constants import Scaled, ramp_at, scaled
from draft.learn.task.groups import Ramp
from draft.learn.task.world.access import COMMAND, iteration, robot_of
from draft.learn.task.world.ground import worlds_on
from draft.learn.task.world.task import Task

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

# Share of the largest |vx| above which a command is fast; time after which speeds are compared
# with it, of a command and of an episode [s]; samples per world after which the largest |vx| may
# grow.
_FAST, _LONG, _STEADY, _ENOUGH = 0.7, 1.5, 4.0, 4


class Growth(NamedTuple):
    """Growth of the largest |vx| each time it is tracked.

    Attributes:
        start: first and least largest |vx| [m/s].
        step: increment [m/s].
        tracked: share of a fast command that counts as tracked.
        missed: share of a fast command below which the increment is taken back; 0 for never.
    """

    start: Scaled
    step: Scaled
    tracked: float
    missed: float


class Pushed(NamedTuple):
    """Commands of the robots that learn to survive pushes while the others learn to run.

    Attributes:
        share: share of the robots.
        forward, sideways, turn: largest |vx|, |vy| [m/s], |wz| [rad/s].
    """

    share: float
    forward: Scaled
    sideways: Scaled
    turn: Scaled


class Away(NamedTuple):
    """Commands straight ahead along a fixed heading.

    Attributes:
        least, most: range of vx [m/s].
        share: share of all commands.
    """

    least: Scaled
    most: Scaled
    share: float


@dataclass(kw_only=True)
class VelocityCommandCfg(UniformVelocityCommandCfg):
    """Velocity commands; mjlab's `ranges` are used for its sliders only.

    Attributes:
        forward, sideways, turn: largest |vx|, |vy| [m/s], |wz| [rad/s].
        forward_least: least vx of commands straight ahead [m/s].
        limit: largest |vx| per estimated top speed; None for no limit.
        limit_sideways: largest |vy| per that limit.
        ramp: (iteration, share of the largest |vx|).
        steps: steps per iteration.
        growth: growth of the largest |vx| by measured tracking; None for the ramp only.
        away: commands along a fixed heading; None for none.
        pushed: commands of the robots with strong pushes; None if all are alike.
        single: share of the drawn commands of which only vx, vy or wz is kept, a third each.
    """

    forward: Scaled = Scaled(1.0)
    sideways: Scaled = Scaled(0.6)
    turn: Scaled = Scaled(0.5)
    forward_least: float = 0.3
    limit: float | None = None
    limit_sideways: float = 1.0
    ramp: Ramp = ((0, 1.0),)
    steps: int = 24
    growth: Growth | None = None
    away: Away | None = None
    pushed: Pushed | None = None
    single: float = 0.0

    def set_largest(self, forward: Scaled, sideways: Scaled, turn: Scaled, task: Task) -> None:
        """Set the largest |vx|, |vy| [m/s] and |wz| [rad/s], also of mjlab's sliders."""
        self.forward, self.sideways, self.turn = forward, sideways, turn
        scale = task.members[0].scale
        x, y, z = (number.at(scale) for number in (forward, sideways, turn))
        ranges = self.ranges
        ranges.lin_vel_x, ranges.lin_vel_y, ranges.ang_vel_z = (-x, x), (-y, y), (-z, z)

    def build(self, env: ManagerBasedRlEnv) -> VelocityCommand:
        """Build the term."""
        return VelocityCommand(self, env)


# Attributes of terms are part of saved states (see `snapshot`): their names must
# not change while runs that can be resumed exist.
class VelocityCommand(UniformVelocityCommand):
    """Velocity commands, drawn without a transfer from the device.

    Attributes:
        held_share: largest |vx| with the limit per that without, shape (worlds,).
        largest: largest |vx|, |vy|, |wz| at the end of the curriculum, shape (worlds, 3).
        held: fixed commands, shape (worlds, 3); None if commands are drawn.
        group: index of each world's group, shape (worlds,): |vx| grows for each group on its own.
        grown: number of increments by which the largest |vx| of each group has grown, shape
            (groups,).
        pushed: whether each world's robot has the commands of `cfg.pushed`, shape (worlds,); None
            if none has.
    """

    # mjlab declares the base class of all its configurations.
    cfg: VelocityCommandCfg  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(self, cfg: VelocityCommandCfg, env: ManagerBasedRlEnv) -> None:
        super().__init__(cfg, env)
        share = cfg.pushed.share if cfg.pushed is not None else 0.0
        self.pushed = share_of_worlds(share, self.num_envs, self.device) if share else None
        self.rescale()
        self.held: torch.Tensor | None = None
        self._scale = robot_of(env).leg_scale
        self._since = torch.zeros(self.num_envs, device=self.device)  # Age of the command [s].
        self.divide(torch.zeros(self.num_envs, dtype=torch.long, device=self.device), 1)
        flat = worlds_on(env, "flat")
        self._rising = torch.ones_like(self._scale, dtype=torch.bool) if flat is None else ~flat

    def divide(self, group: torch.Tensor, groups: int) -> None:
        """Let the largest |vx| grow for each group of worlds on its own, from its start.

        Args:
            group: index of each world's group, shape (worlds,); may be changed later.
            groups: number of groups.
        """
        self.group = group
        self.grown = torch.zeros(groups, device=self.device)
        # Sums over samples of fast commands: their number, the commanded and the measured speeds
        # [m/s].
        self._reached = torch.zeros(groups, 3, device=self.device)

    def rescale(self) -> None:
        """Set the limits of each world's command from the numbers of its design."""
        cfg, robot = self.cfg, robot_of(self._env)
        forward, sideways = robot.scaled(cfg.forward), robot.scaled(cfg.sideways)
        largest = forward
        if cfg.limit is not None:
            most = cfg.limit * robot.top_speed
            largest = forward.minimum(most)
            sideways = sideways.minimum(cfg.limit_sideways * most)
        self.held_share = largest / forward
        self.largest = torch.stack((largest, sideways, robot.scaled(cfg.turn)), dim=1)
        if cfg.pushed is not None and self.pushed is not None:
            own = torch.stack([robot.scaled(number) for number in cfg.pushed[1:]], dim=1)
            self.largest = own.where(self.pushed[:, None], self.largest)
        self._limit = None if cfg.limit is None else cfg.limit * robot.top_speed

    def hold(self, values: torch.Tensor) -> None:
        """Fix the command of every world from now on, also through resets.

        Args:
            values: vx, vy [m/s] and wz [rad/s] in the trunk's frame, shape (worlds, 3).
        """
        self.held = values.clone()
        self._resample(torch.arange(self.num_envs, device=self.device))

    def range_now(self) -> torch.Tensor:
        """Return the present largest |vx|, |vy|, |wz| of the curriculum, shape (worlds, 3)."""
        share = ramp_at(self.cfg.ramp, iteration(self._env, self.cfg.steps))
        largest = self.largest.clone()
        largest[:, 0] *= share
        if self.cfg.growth is not None:
            growth = self.cfg.growth
            grown = self.grown[self.group]
            now = growth.start.at(self._scale) + grown * growth.step.at(self._scale)
            largest[:, 0] = largest[:, 0].minimum(now)
        return largest

    # mjlab declares values as floats, which would wait for the device.
    def reset(self, env_ids: Any) -> dict[str, Any]:
        """Draw new commands; the metrics stay on the device."""
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
            for mask in (self.is_heading_env, self.is_standing_env, self.is_forward_env):
                mask[env_ids] = False
            return
        self._since[env_ids] = 0.0
        drawn = 2 * torch.rand(n, 4, device=self.device) - 1
        chance = torch.rand(n, 3, device=self.device)
        value = drawn[:, :3] * self.range_now()[env_ids]
        heads = chance[:, 0] < cfg.rel_heading_envs
        if cfg.single:
            lot = torch.rand(n, device=self.device) * 3 / cfg.single  # 3 and above: all are kept.
            axes = torch.arange(3, device=self.device)
            value *= (lot[:, None].floor() == axes) | (lot[:, None] >= 3)
            heads &= lot >= 3
        ahead = chance[:, 2] < cfg.rel_forward_envs
        straight = torch.zeros_like(value)
        straight[:, 0] = value[:, 0].abs().clamp(min=cfg.forward_least)
        self.vel_command_b[env_ids] = torch.where(ahead[:, None], straight, value)
        self.heading_target[env_ids] = torch.pi * drawn[:, 3]
        self.is_heading_env[env_ids] = heads & ~ahead
        self.is_standing_env[env_ids] = chance[:, 1] < cfg.rel_standing_envs
        self.is_forward_env[env_ids] = ahead
        if cfg.away is not None:
            self._lead_away(env_ids, cfg.away)

    def _grow(self, growth: Growth) -> None:
        """Compare measured speeds with fast commands: grow where tracked, shrink where missed."""
        self._since += self._env.step_dt
        forward, largest = self.vel_command_b[:, 0], self.range_now()[:, 0]
        fast = (forward.abs() > _FAST * largest) & (self._since > _LONG)
        # A robot that falls ahead is fast too.
        fast &= self._env.episode_length_buf > _STEADY / self._env.step_dt
        if self.pushed is not None:
            fast &= ~self.pushed
        along = self.robot.data.root_link_lin_vel_b[:, 0] * forward.sign()
        self._reached.index_add_(
            0, self.group, torch.stack((fast.float(), forward.abs() * fast, along * fast), dim=1)
        )
        count, commanded, measured = self._reached.unbind(1)
        enough = count >= _ENOUGH * self.num_envs / len(self.grown)
        missed = measured < growth.missed * commanded
        self.grown += enough & (measured >= growth.tracked * commanded)
        self.grown -= (enough & missed & (self.grown > 0)).float()
        self._reached *= ~enough[:, None]

    def _lead_away(self, env_ids: torch.Tensor, away: Away) -> None:
        """Replace a share of the commands by some straight ahead along the present heading.

        Robots on flat patches keep all kinds of commands, or they would forget how to turn.
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
        """Heading of the trunk from qpos [rad]; derived fields lag after a reset."""
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
        if cfg.growth is not None and env_ids is None:  # A reset of some worlds is no step.
            self._grow(cfg.growth)


def share_of_worlds(share: float, worlds: int, device: str) -> torch.Tensor:
    """A share of the worlds, evenly spread and the first one not among them, shape (worlds,)."""
    order = torch.arange(worlds + 1, device=device, dtype=torch.float64)
    return (order * share + 1e-9).floor().diff() > 0  # 0.29 x 100 is less than 29.


def command_term(env: ManagerBasedRlEnv) -> VelocityCommand:
    """Return the term of the velocity command."""
    # mjlab's manager declares the base class of all terms.
    return env.command_manager.get_term(COMMAND)  # type: ignore[return-value]


def command_cfg(task: Task) -> VelocityCommandCfg:
    """Configuration of the velocity commands that all stages share."""
    c = task.config.commands
    cfg = VelocityCommandCfg(
        entity_name="robot",
        resampling_time_range=c.interval,
        rel_standing_envs=c.standing,
        rel_heading_envs=c.heading,
        rel_forward_envs=c.forward_only,
        heading_command=True,
        heading_control_stiffness=c.heading_stiffness,
        debug_vis=True,
        ranges=VelocityCommandCfg.Ranges((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (-3.14159, 3.14159)),
        forward_least=c.forward_least,
        limit=c.limit,
        limit_sideways=c.limit_sideways,
        steps=task.config.learning.steps,
    )
    cfg.set_largest(scaled(c, "forward"), scaled(c, "sideways"), scaled(c, "turn"), task)
    return cfg
