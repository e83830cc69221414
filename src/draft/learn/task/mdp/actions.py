"""Joint targets about the home pose: at once or late, and those of driven wheels: speeds."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.envs.mdp.actions import JointPositionAction, JointPositionActionCfg

from draft.learn.task.world.access import robot_of

_ROUNDED = 1e-9  # A delay of k physics steps is exactly k of them [s].


@dataclass(kw_only=True)
class DelayedTargetsCfg(JointPositionActionCfg):
    """Configuration of joint targets that arrive late.

    Attributes:
        delay: least and greatest delay [s], at most a control period.
        wheel_scale: speed of a driven wheel per unit of action, per no-load speed.
    """

    delay: tuple[float, float]
    wheel_scale: float

    def build(self, env: ManagerBasedRlEnv) -> DelayedTargets:
        """Build the term."""
        return DelayedTargets(self, env)


@dataclass(kw_only=True)
class TargetsCfg(JointPositionActionCfg):
    """Configuration of joint targets about the home pose of each world's design."""

    def build(self, env: ManagerBasedRlEnv) -> Targets:
        """Build the term."""
        return Targets(self, env)


class Targets(JointPositionAction):
    """Joint targets about the home pose of each world's design [rad]."""

    def rescale(self) -> None:
        """Take the numbers of the designs that worlds were given."""
        home = self._entity.data.default_joint_pos[:, self._target_ids]
        torch.as_tensor(self._offset).copy_(home)


# Attributes of terms are part of saved states (see `snapshot`).
class DelayedTargets(Targets):
    """Joint targets that arrive later than they are sent, by a delay of each world.

    A world draws its delay when it is reset, and holds the target before until it has passed. The
    first target after a reset is preceded by the home pose. Targets are angles, and speeds of
    driven wheels [rad/s].
    """

    # mjlab declares the base class of all its configurations.
    cfg: DelayedTargetsCfg  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(self, cfg: DelayedTargetsCfg, env: ManagerBasedRlEnv) -> None:
        super().__init__(cfg, env)
        robot = robot_of(env)
        if len(robot.wheels):
            self._scale = self._scale * torch.ones_like(robot.no_load_speed)
            self.rescale()
        self._delay = self._drawn()
        self._before = self._offset + torch.zeros_like(self._raw_actions)
        self._since = 0.0

    def rescale(self) -> None:
        """Take the numbers of the designs that worlds were given."""
        super().rescale()
        robot = robot_of(self._env)
        if len(robot.wheels):
            speeds = self.cfg.wheel_scale * robot.no_load_speed[:, robot.wheels]
            torch.as_tensor(self._scale)[:, robot.wheels] = speeds

    def process_actions(self, actions: torch.Tensor) -> None:
        """Take new targets; those of the step before hold until the delay has passed."""
        self._before = self._offset + self._scale * self._raw_actions
        self._since = 0.0
        super().process_actions(actions)

    def apply_actions(self) -> None:
        """Set the targets of one physics step."""
        new = self._processed_actions
        late = (self._since < self._delay - _ROUNDED)[:, None]
        self._processed_actions = torch.where(late, self._before, new)
        super().apply_actions()  # Of wheels without effect: they have no stiffness.
        wheels = robot_of(self._env).wheels
        if len(wheels):
            speeds = self._processed_actions[:, wheels]
            self._entity.set_joint_velocity_target(speeds, joint_ids=wheels)
        self._processed_actions = new
        self._since += self._env.physics_dt

    def reset(self, env_ids: torch.Tensor | slice | None = None) -> None:
        """Draw the delays of worlds anew."""
        super().reset(env_ids)
        ids = slice(None) if env_ids is None else env_ids
        self._delay[ids] = self._drawn()[ids]

    def _drawn(self) -> torch.Tensor:
        low, high = self.cfg.delay
        return low + (high - low) * torch.rand(self.num_envs, device=self.device)
