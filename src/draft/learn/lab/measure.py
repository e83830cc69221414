"""What is measured of every world while a policy walks, kept on the device."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from draft.learn.quadruped import CLASSES
from draft.learn.utilisation import BINS, QUANTITIES, WIDTH


def powers(
    torque: torch.Tensor, speed: torch.Tensor, loss: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Mechanical power and heat of the joints [W].

    Args:
        torque: applied by the actuators [N m], shape (worlds, joints).
        speed: of the joints [rad/s], same shape.
        loss: no-load speed per peak torque [rad/s / N m], same shape.

    Returns:
        sum |tau qdot| and sum tau^2 w_NL / tau_peak, shape (worlds,).
    """
    return (torque * speed).abs().sum(1), (torque.square() * loss).sum(1)


class Measures:
    """Sums over the steps after settling, of the worlds that have not fallen.

    Attributes:
        fell: worlds that fell, shape (worlds,).
    """

    def __init__(self, robot: Any, leg_joints: Sequence[tuple[int, int, int]], settle: int) -> None:
        """Start at rest.

        Args:
            robot: a `draft.learn.lab.robot.Robot`.
            leg_joints: indices of hip roll, hip pitch and knee of each leg.
            settle: steps that do not count.
        """
        self._robot, self._settle, self._step = robot, settle, 0
        worlds, joints = robot.peak_torque.shape
        device = robot.peak_torque.device
        self.fell = torch.zeros(worlds, dtype=torch.bool, device=device)
        self._loss = robot.no_load_speed / robot.peak_torque
        self._sums = torch.zeros(worlds, 3, dtype=torch.float64, device=device)
        self._start = robot.data.root_link_pos_w[:, 2].clone()
        kind = torch.zeros(joints, dtype=torch.long, device=device)
        for leg in leg_joints:
            for i, joint in enumerate(leg):
                kind[joint] = i
        row = torch.arange(worlds, device=device)[:, None] * len(CLASSES) + kind
        quantity = torch.arange(len(QUANTITIES), device=device)
        self._places = (row[..., None] * len(QUANTITIES) + quantity) * BINS
        size = worlds * len(CLASSES) * len(QUANTITIES) * BINS
        self._counts = torch.zeros(size, dtype=torch.int32, device=device)

    def add(self, fallen: torch.Tensor) -> None:
        """Take in the state after a step.

        Args:
            fallen: worlds that fell in it, shape (worlds,); they do not count from then on.
        """
        self._step += 1
        self.fell |= fallen
        data = self._robot.data
        if self._step == self._settle:
            self._start = data.root_link_pos_w[:, 2].clone()
        if self._step <= self._settle:
            return
        torque, speed = data.qfrc_actuator, data.joint_vel
        forward = data.root_link_lin_vel_b[:, 0]
        now = torch.stack((forward, *powers(torque, speed, self._loss)), dim=1)
        self._sums += torch.where(self.fell[:, None], 0.0, now)
        shares = torque.abs() / self._robot.peak_torque, speed.abs() / self._robot.no_load_speed
        self._count(torch.stack((*shares, shares[0] + shares[1]), dim=-1))

    def fetch(self) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Bring the results from the device.

        Returns:
            Columns `fell`, `speed`, `mechanical`, `heat` and `rise` of `scalars.Worlds`, and the
            counts, shape (worlds, classes, quantities, bins).
        """
        rise = self._robot.data.root_link_pos_w[:, 2] - self._start
        means = (self._sums / max(self._step - self._settle, 1)).cpu().numpy()
        columns = {
            "fell": self.fell.cpu().numpy(),
            "speed": means[:, 0],
            "mechanical": means[:, 1],
            "heat": means[:, 2],
            "rise": rise.cpu().numpy().astype(np.float64),
        }
        counts = self._counts.cpu().numpy()
        return columns, counts.reshape(len(rise), len(CLASSES), len(QUANTITIES), BINS)

    def _count(self, shares: torch.Tensor) -> None:
        """Count shares of the limits, shape (worlds, joints, quantities)."""
        # Bins hold their upper edge: a saturated joint is at its limit, not above it.
        bins = (torch.ceil(shares / WIDTH - 1e-4).long() - 1).clamp(0, BINS - 1)
        ones = (~self.fell).to(torch.int32)[:, None, None].expand_as(bins)
        self._counts.scatter_add_(0, (self._places + bins).flatten(), ones.flatten())
