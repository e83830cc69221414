"""Typed access to what terms read of an environment: robot, ground and command."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mjlab.managers.scene_entity_config import SceneEntityCfg

if TYPE_CHECKING:
    import torch
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.bodies.legged import LeggedRobot
    from draft.learn.task.world.ground import HeightMap
    from draft.learn.task.world.robot import Robot

# Names of the command, the height map and the contact sensors.
COMMAND, GROUND, FEET, THIGHS = "twist", "ground", "feet_contact", "upper_leg_contact"


def robot_of(env: ManagerBasedRlEnv) -> Robot:
    """Return the robot."""
    return env.scene["robot"]


def ground_of(env: ManagerBasedRlEnv) -> HeightMap:
    """Return the height map of the ground."""
    return env.scene[GROUND]


def command_of(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Return the commanded vx, vy [m/s] and wz [rad/s] in the trunk's frame, shape (worlds, 3)."""
    value = env.command_manager.get_command(COMMAND)
    if value is None:
        raise KeyError(COMMAND)
    return value


def of_angles(first: LeggedRobot) -> dict[str, SceneEntityCfg]:
    """Parameters of a term of mjlab's that reads angles of joints: all but those of wheels.

    Args:
        first: a robot of the topology.
    """
    if not first.rolls:
        return {}
    names = tuple(first.joints[joint] for joint in first.turned)
    return {"asset_cfg": SceneEntityCfg("robot", joint_names=names)}


def iteration(env: ManagerBasedRlEnv, steps: int) -> int:
    """Return the number of iterations done.

    Args:
        env: the environment.
        steps: its steps per iteration.
    """
    return env.common_step_counter // steps
