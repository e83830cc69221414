"""A robot in MuJoCo as a deployed controller meets it: by the names of its joints."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)

from __future__ import annotations

import mujoco
import numpy as np

from draft.learn.policy.validity import Fit
from draft.learn.policy.walk import Walk
from draft.model import Model
from tests.deployment.controllers import Seen


class Machine:
    """A robot in MuJoCo, whose sensors are read by the names of its joints alone."""

    def __init__(self, model: Model, found: Fit, names: list[str]) -> None:
        self.walk = Walk(model, found)
        self.model, self.data = self.walk.model, self.walk.data
        self.trunk = self.model.body(model.design.bodies[0].name).id
        self.joints = [self.model.joint(name) for name in names]

    def seen(self, now: float, command: tuple[float, float, float]) -> Seen:
        """What its sensors measure now."""
        mujoco.mj_forward(self.model, self.data)
        down = self.data.xmat[self.trunk].reshape(3, 3).T @ (0, 0, -1)
        linear = self.data.sensor("imu_lin_vel").data.copy()
        turning = self.data.sensor("imu_ang_vel").data.copy()
        return Seen(now, now, now, command, linear, turning, down, *self.state())

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Angles and speeds of its joints."""
        angle = [self.data.qpos[joint.qposadr[0]] for joint in self.joints]
        return np.array(angle), np.array([self.data.qvel[joint.dofadr[0]] for joint in self.joints])

    def drive(self, torque: np.ndarray) -> None:
        """Apply torques for one physics step."""
        for joint, one in zip(self.joints, torque, strict=True):
            self.data.qfrc_applied[joint.dofadr[0]] = one
        mujoco.mj_step(self.model, self.data)
