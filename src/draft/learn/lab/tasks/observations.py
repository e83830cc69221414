"""What actor and critic see."""

from __future__ import annotations

from dataclasses import replace

from mjlab.envs import mdp as stock
from mjlab.managers.observation_manager import ObservationGroupCfg
from mjlab.managers.observation_manager import ObservationTermCfg as Seen
from mjlab.tasks.velocity import mdp as walking
from mjlab.utils.noise import UniformNoiseCfg

from draft.learn.lab.tasks.task import Task
from draft.learn.lab.terms import observations as terms
from draft.learn.lab.terms.rewards import COMMAND, FEET


def observations(task: Task, play: bool) -> dict[str, ObservationGroupCfg]:
    """What each of both sees.

    Args:
        task: what the environment is about.
        play: for watching: no noise.
    """
    numbers = task.config.observations
    sensor = stock.builtin_sensor
    velocity = {"noise": 0.0 if play else numbers.joint_velocity_noise}
    scale = 1.0 / numbers.scan_range
    actor = {
        "base_lin_vel": Seen(
            func=sensor,
            params={"sensor_name": "robot/imu_lin_vel"},
            noise=_noise(numbers.linear_velocity_noise),
        ),
        "base_ang_vel": Seen(
            func=sensor,
            params={"sensor_name": "robot/imu_ang_vel"},
            noise=_noise(numbers.angular_velocity_noise),
        ),
        "projected_gravity": Seen(
            func=stock.projected_gravity, noise=_noise(numbers.gravity_noise)
        ),
        "joint_pos": Seen(
            # A biased encoder moves the target of the PD law only, as in the study.
            func=stock.joint_pos_rel,
            noise=_noise(numbers.joint_position_noise),
        ),
        "joint_vel": Seen(func=terms.joint_velocity, params=velocity),
        "actions": Seen(func=stock.last_action),
        "command": Seen(func=stock.generated_commands, params={"command_name": COMMAND}),
    }
    if task.see_ground:
        actor["height_scan"] = Seen(
            func=terms.height_scan, noise=_noise(numbers.scan_noise), scale=scale
        )
    if task.see_design:
        actor["design"] = Seen(func=terms.design)
    contact = {"sensor_name": FEET}
    critic = {
        **{name: replace(term, noise=None) for name, term in actor.items()},
        "joint_vel": Seen(func=terms.joint_velocity),
        "foot_height": Seen(func=terms.foot_height),
        "foot_air_time": Seen(func=walking.foot_air_time, params=contact),
        "foot_contact": Seen(func=walking.foot_contact, params=contact),
        "foot_contact_forces": Seen(func=walking.foot_contact_forces, params=contact),
    }
    return {
        "actor": ObservationGroupCfg(terms=actor, enable_corruption=not play),
        "critic": ObservationGroupCfg(terms=critic, enable_corruption=False),
    }


def _noise(half: float) -> UniformNoiseCfg | None:
    return UniformNoiseCfg(n_min=-half, n_max=half) if half > 0 else None
