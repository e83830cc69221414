"""Models of designs compiled one by one, as each would be in a scene of its own."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.task.config import Config
from draft.learn.task.world.robot import robot


def compiled(members: Sequence[LeggedRobot], config: Config) -> list[mujoco.MjModel]:
    """Robots with the actuators and colliding geoms of the scene, without the scene."""
    return [robot((member,), config).build().compile() for member in members]
