"""Measures of every world during a roll-out, kept on the device.

Falls and velocities are sampled once per action, torques and joint speeds at every physics step:
legs move much within an action, and samples at one phase of it would be biased.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch
from mjlab.managers.manager_base import ManagerTermBase
from mjlab.managers.metrics_manager import MetricsTermCfg

from draft.learn.measuring.utilisation import BINS, CELL, CELLS, QUANTITIES, WIDTH

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.task.world.robot import Robot


def powers(
    torque: torch.Tensor, speed: torch.Tensor, line: torch.Tensor, loss: torch.Tensor
) -> tuple[torch.Tensor, ...]:
    """Mechanical power, heat by the line, heat and driving power of the joints [W].

    Args:
        torque: torques of the actuators [N m], shape (worlds, joints).
        speed: joint speeds [rad/s], same shape.
        line: no-load speed per stall torque [rad/s / N m], same shape.
        loss: heat per torque squared [W/(N m)^2], same shape; see `draft.laws.limits.copper_loss`.

    Returns:
        sum |tau qdot|, sum tau^2 w_NL / tau_stall, sum tau^2 loss and sum max(tau qdot, 0), shape
        (worlds,).
    """
    power, square = torque * speed, torque.square()
    heats = ((square * line).sum(1), (square * loss).sum(1))
    return power.abs().sum(1), *heats, power.clamp(min=0).sum(1)


def bin_indices(shares: torch.Tensor, width: float, count: int) -> torch.Tensor:
    """Return the bins of shares of a limit; bins include their upper edge, the last all above.

    A joint at its limit is counted as at it, not above it.
    """
    return (torch.ceil(shares / width - 1e-4).long() - 1).clamp(0, count - 1)


class Counts:
    """Histograms of samples for each world and joint class."""

    def __init__(self, kind: torch.Tensor, worlds: int, size: int) -> None:
        """Start with empty bins.

        Args:
            kind: joint class of each joint, shape (joints,).
            worlds: number of worlds.
            size: number of bins.
        """
        classes = int(kind.max()) + 1
        row = torch.arange(worlds, device=kind.device)[:, None] * classes + kind
        self._first, self._shape = row * size, (worlds, classes, size)
        counts = worlds * classes * size
        self._counts = torch.zeros(counts, dtype=torch.int32, device=kind.device)

    def add(self, samples: torch.Tensor) -> None:
        """Count a sample of each joint, or several.

        Args:
            samples: bins, shape (worlds, joints) or (worlds, joints, samples).
        """
        at = self._first.view(*self._first.shape, *(1,) * (samples.dim() - 2)) + samples
        one = torch.ones((), dtype=torch.int32, device=at.device)
        self._counts.scatter_add_(0, at.flatten(), one.expand(at.numel()))

    def pooled(self, worlds: torch.Tensor, each: int, members: int) -> np.ndarray:
        """Sum over the replicas of each level and member.

        Args:
            worlds: mask of the worlds to include, shape (worlds,).
            each: replicas of each member at a level.
            members: number of members; worlds are ordered by level, replica and member.

        Returns:
            Shape (levels x members, classes, size).
        """
        counts = self._counts.view(self._shape) * worlds[:, None, None]
        grouped = counts.view(-1, each, members, *self._shape[1:]).sum(1)
        return grouped.flatten(0, 1).cpu().numpy()


class EachStep(ManagerTermBase):
    """Term of mjlab's metrics that calls a function after every physics step.

    Attributes:
        call: the function.
    """

    def __init__(self, cfg: MetricsTermCfg, env: ManagerBasedRlEnv) -> None:
        super().__init__(env)
        self.call: Callable[[], None] = lambda: None
        self._nothing = torch.zeros(env.num_envs, device=env.device)

    def __call__(self, env: ManagerBasedRlEnv) -> torch.Tensor:
        """Call the function; the metric is zero."""
        self.call()
        return self._nothing


EACH_STEP = {"each_step": MetricsTermCfg(func=EachStep, per_substep=True)}


def each_step(env: ManagerBasedRlEnv) -> EachStep:
    """Return the term of `EACH_STEP` of an environment."""
    terms = env.metrics_manager.cfg or {}  # None if an environment has no metrics.
    return terms["each_step"].func


class Measures:
    """Sums over the time after settling, for worlds that do not fall.

    Attributes:
        fell: worlds that fell, shape (worlds,).
    """

    def __init__(self, robot: Robot, joint_classes: Sequence[int], settle: int) -> None:
        """Start from the present state.

        Args:
            robot: the robot.
            joint_classes: index of the class of each joint.
            settle: number of actions that are not measured.
        """
        self._robot, self._settle, self._step = robot, settle, 0
        worlds = len(robot.peak_torque)
        device = robot.peak_torque.device
        self.fell = torch.zeros(worlds, dtype=torch.bool, device=device)
        self._line = robot.no_load_speed / robot.stall_torque
        self._way = torch.zeros(worlds, dtype=torch.float64, device=device)
        self._power = torch.zeros(worlds, 4, dtype=torch.float64, device=device)
        self._samples, self._speed = 0, robot.data.joint_vel.clone()
        self._start = robot.data.root_link_pos_w[:, 2].clone()
        kind = torch.tensor(joint_classes, device=device)
        self._marginal = Counts(kind, worlds, len(QUANTITIES) * BINS)
        self._plane = Counts(kind, worlds, CELLS * CELLS)
        self._quantity = torch.arange(len(QUANTITIES), device=device) * BINS

    def sample(self) -> None:
        """Sample torques and joint speeds after a physics step."""
        # The torque acted at the state before the step; the data has the speed after it.
        speed, self._speed = self._speed, self._robot.data.joint_vel.clone()
        if self._step < self._settle:
            return
        self._samples += 1
        torque = self._robot.data.qfrc_actuator
        self._power += torch.stack(
            powers(torque, speed, self._line, self._robot.copper_loss), dim=1
        )
        self._count(torque.abs(), speed.abs() / self._robot.no_load_speed)

    def add(self, fallen: torch.Tensor) -> None:
        """Add the state after an action.

        Args:
            fallen: worlds that fell during it, shape (worlds,); they are excluded from then on.
        """
        self._step += 1
        self.fell |= fallen
        data = self._robot.data
        if self._step == self._settle:
            self._start = data.root_link_pos_w[:, 2].clone()
        if self._step > self._settle:
            self._way += data.root_link_lin_vel_b[:, 0]

    def fetch(self) -> dict[str, np.ndarray]:
        """Return the measured columns of `scalars.Worlds`: from `fell` to `rise`.

        For a world that fell only `fell` has a meaning.
        """
        rise = self._robot.data.root_link_pos_w[:, 2] - self._start
        power = (self._power / max(self._samples, 1)).cpu().numpy()
        return {
            "fell": self.fell.cpu().numpy(),
            "speed": (self._way / max(self._step - self._settle, 1)).cpu().numpy(),
            "mechanical": power[:, 0],
            "heat": power[:, 1],
            "copper": power[:, 2],
            "driving": power[:, 3],
            "rise": rise.cpu().numpy().astype(np.float64),
        }

    def samples(self, each: int, members: int) -> tuple[np.ndarray, np.ndarray]:
        """Return histograms of the worlds that did not fall, by level and member.

        Args:
            each: replicas of each member at a level.
            members: number of members; worlds are ordered by level, replica and member.

        Returns:
            `counts` and `plane` of `utilisation.Histograms`.
        """
        counts = self._marginal.pooled(~self.fell, each, members)
        plane = self._plane.pooled(~self.fell, each, members)
        shape = *counts.shape[:2], len(QUANTITIES), BINS
        return counts.reshape(shape), plane.reshape(*plane.shape[:2], CELLS, CELLS)

    def _count(self, torque: torch.Tensor, speed: torch.Tensor) -> None:
        """Count torques [N m] and shares of the no-load speed, shape (worlds, joints)."""
        line = torque / self._robot.stall_torque + speed
        torque = torque / self._robot.peak_torque
        shares = torch.stack((torque, speed, line), dim=-1)
        self._marginal.add(bin_indices(shares, WIDTH, BINS) + self._quantity)
        row, column = (bin_indices(share, CELL, CELLS) for share in (torque, speed))
        self._plane.add(row * CELLS + column)
