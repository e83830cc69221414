"""A robot let go above the floor, in MuJoCo, limp or held by its servos."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import mujoco
import numpy as np

from draft.model.mjcf import robot_xml
from draft.model.scene import scene_xml
from draft.studio.session import Drawn

HEIGHT = 0.25  # of the feet above the floor at the start [m]
LONGEST = 6.0  # simulated [s]
_STILL = 0.02  # greatest joint speed of a robot at rest [rad/s]


class Drop:
    """A fall from a small height.

    Attributes:
        data: MuJoCo's state; bodies are numbered as in the robot alone.
        over: whether it lies still, or long enough has been simulated.
    """

    def __init__(self, drawn: Drawn, angles: np.ndarray, base: float, held: bool) -> None:
        """Prepare.

        Args:
            drawn: the robot; the design filter may refuse it.
            angles: joint values at the start [rad or m].
            base: height of the trunk's frame with the feet on the floor [m].
            held: whether the servos hold the home pose.
        """
        assets = {"robot.xml": robot_xml(drawn.design).encode()}
        text = scene_xml(drawn.design, drawn.robot)
        self._model = mujoco.MjModel.from_xml_string(text, assets)
        self.data = mujoco.MjData(self._model)
        mujoco.mj_resetDataKeyframe(self._model, self.data, 0)
        self.data.qpos[2] = base + HEIGHT
        self.data.qpos[7:] = angles
        if not held:
            self._model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION.value
        self.over = False

    def advance(self, seconds: float) -> None:
        """Simulate a stretch of time."""
        for _ in range(round(seconds / self._model.opt.timestep)):
            mujoco.mj_step(self._model, self.data)
        still = np.abs(self.data.qvel).max() < _STILL and self.data.time > 0.5
        self.over = bool(still or self.data.time > LONGEST or np.isnan(self.data.qpos).any())
