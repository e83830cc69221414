"""Observations of actor and critic, and terms that mjlab lacks."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import torch
from mjlab.envs import mdp as envs_mdp
from mjlab.managers.observation_manager import ObservationGroupCfg, ObservationTermCfg
from mjlab.tasks.velocity import mdp as velocity_mdp
from mjlab.utils.noise import UniformNoiseCfg

from draft.learn.task.world.access import COMMAND, FEET, ground_of, of_angles, robot_of
from draft.learn.task.world.task import Task

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

# Terms of the actor that may have a history: what an inertial sensor and encoders give.
_MEASURED = ("base_ang_vel", "projected_gravity", "joint_pos", "joint_vel", "actions")


def joint_velocity(env: ManagerBasedRlEnv, noise: float = 0.0) -> torch.Tensor:
    """Joint velocities [rad/s], shape (worlds, joints).

    Args:
        env: the environment.
        noise: half width of the uniform noise, per no-load speed of each joint.
    """
    robot = robot_of(env)
    velocity = robot.data.joint_vel
    if not noise:
        return velocity
    return velocity + (2 * torch.rand_like(velocity) - 1) * noise * robot.no_load_speed


def height_scan(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Height of the trunk above the points of the scan [m], shape (worlds, points)."""
    return ground_of(env).scan()


def foot_height(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Height of the feet's centres above the ground [m], shape (worlds, feet)."""
    return ground_of(env).feet()


def design(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Features of each world's design, shape (worlds, features); see `features`."""
    return robot_of(env).design


def observation_cfgs(task: Task, play: bool) -> dict[str, ObservationGroupCfg]:
    """Configurations of the observations, for "actor" and "critic".

    Args:
        task: the task.
        play: whether the environment is for watching: no noise.
    """
    numbers = task.config.observations
    sensor = envs_mdp.builtin_sensor
    velocity = {"noise": 0.0 if play else numbers.joint_velocity_noise}
    scale = 1.0 / numbers.scan_range
    actor = {
        "base_lin_vel": ObservationTermCfg(
            func=sensor,
            params={"sensor_name": "robot/imu_lin_vel"},
            noise=_noise(numbers.linear_velocity_noise),
        ),
        "base_ang_vel": ObservationTermCfg(
            func=sensor,
            params={"sensor_name": "robot/imu_ang_vel"},
            noise=_noise(numbers.angular_velocity_noise),
        ),
        "projected_gravity": ObservationTermCfg(
            func=envs_mdp.projected_gravity, noise=_noise(numbers.gravity_noise)
        ),
        "joint_pos": ObservationTermCfg(
            # In the paper a biased encoder moves the target of the PD law only.
            func=envs_mdp.joint_pos_rel,
            params={"biased": numbers.biased_encoders, **of_angles(task.members[0])},
            noise=_noise(numbers.joint_position_noise),
        ),
        "joint_vel": ObservationTermCfg(func=joint_velocity, params=velocity),
        "actions": ObservationTermCfg(func=envs_mdp.last_action),
        "command": ObservationTermCfg(
            func=envs_mdp.generated_commands, params={"command_name": COMMAND}
        ),
    }
    if task.see_ground:
        actor["height_scan"] = ObservationTermCfg(
            func=height_scan, noise=_noise(numbers.scan_noise), scale=scale
        )
    if task.see_design:
        actor["design"] = ObservationTermCfg(func=design)
    contact = {"sensor_name": FEET}
    critic = {
        **{name: replace(term, noise=None) for name, term in actor.items()},
        "joint_pos": replace(actor["joint_pos"], params=of_angles(task.members[0]), noise=None),
        "joint_vel": ObservationTermCfg(func=joint_velocity),
        "foot_height": ObservationTermCfg(func=foot_height),
        "foot_air_time": ObservationTermCfg(func=velocity_mdp.foot_air_time, params=contact),
        "foot_contact": ObservationTermCfg(func=velocity_mdp.foot_contact, params=contact),
        "foot_contact_forces": ObservationTermCfg(
            func=velocity_mdp.foot_contact_forces, params=contact
        ),
    }
    if not numbers.linear_velocity:
        del actor["base_lin_vel"]
    for name in _MEASURED if numbers.history > 1 else ():
        actor[name] = replace(actor[name], history_length=numbers.history)
    return {
        "actor": ObservationGroupCfg(terms=actor, enable_corruption=not play),
        "critic": ObservationGroupCfg(terms=critic, enable_corruption=False),
    }


def _noise(half: float) -> UniformNoiseCfg | None:
    return UniformNoiseCfg(n_min=-half, n_max=half) if half > 0 else None
