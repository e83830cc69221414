"""Drop test: the robot falls in MuJoCo, limp or held by its servos; a fixed base stays."""

from __future__ import annotations

import mujoco
import numpy as np

from draft.model import Model
from draft.model.pose import base_coordinates
from draft.values import Array

HEIGHT = 0.25  # of the feet above the floor at the start [m]
MAX_TIME = 6.0  # simulated [s]
_STILL = 0.02  # largest joint speed of a robot at rest [rad/s]


class Drop:
    """Simulation of a fall.

    Attributes:
        data: MuJoCo's state; bodies are numbered as in the robot alone.
        over: whether the robot lies still, or `MAX_TIME` has passed.
    """

    def __init__(self, model: Model, angles: Array, base: float, held: bool) -> None:
        """Prepare the fall.

        Args:
            model: the robot; the design filter may have refused it.
            angles: joint positions at the start [rad or m], shape (joints,).
            base: height of the trunk's frame with the feet on the floor [m].
            held: whether the servos hold the home pose.

        Raises:
            ModelError: MuJoCo does not accept the scene.
        """
        self._scene = model.scene()
        self.data = mujoco.MjData(self._scene)
        mujoco.mj_resetDataKeyframe(self._scene, self.data, 0)
        first, _ = base_coordinates(self._scene)
        if first:
            self.data.qpos[2] = base + HEIGHT
        self.data.qpos[first:] = angles
        if not held:
            self._scene.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION.value
        self.over = False

    def advance(self, seconds: float) -> None:
        """Simulate for a while."""
        for _ in range(round(seconds / self._scene.opt.timestep)):
            mujoco.mj_step(self._scene, self.data)
        still = np.abs(self.data.qvel).max() < _STILL and self.data.time > 0.5
        self.over = bool(still or self.data.time > MAX_TIME or np.isnan(self.data.qpos).any())
