"""Reward terms of arXiv 2609.38405 that mjlab lacks; each returns values of shape (worlds,).

`@reward` makes a function a term of all stages, with its numbers in `config.Rewards`;
`draft.learn.task.stages` has what a stage changes. A number that scales with the leg is a `Scaled`,
evaluated at the scale of each world's design.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, TypeVar

import torch
from mjlab.envs import mdp as envs_mdp
from mjlab.managers.reward_manager import RewardTermCfg
from mjlab.utils.lab_api.math import quat_apply_inverse

from draft.learn.task.constants import Scaled, scaled
from draft.learn.task.groups import Rewards
from draft.learn.task.mdp.commands import command_term
from draft.learn.task.world.access import (
    FEET,
    THIGHS,
    command_of,
    ground_of,
    iteration,
    of_angles,
    robot_of,
)
from draft.learn.task.world.task import Task

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv
    from mjlab.sensor import ContactSensor

# Terms of feet that are lifted and set down, which a robot on driven wheels does without.
OF_STEPS = ("air_time", "clearance")
ENOUGH = 0.8  # Share of the command at which the reward of progress is largest.
F = TypeVar("F", bound=Callable[..., torch.Tensor])


@dataclass(frozen=True)
class Term:
    """A reward term of all stages.

    Attributes:
        func: function of the environment and of `params`.
        weight: name of its weight in `draft.learn.task.config.Rewards`.
        params: names of its other numbers there, by parameter of the function.
    """

    func: Callable[..., torch.Tensor]
    weight: str
    params: Mapping[str, str]

    def cfg(self, numbers: Rewards) -> RewardTermCfg:
        """Return mjlab's configuration of the term."""
        params = {name: scaled(numbers, field) for name, field in self.params.items()}
        return RewardTermCfg(func=self.func, weight=getattr(numbers, self.weight), params=params)


REWARDS: dict[str, Term] = {}


def reward(name: str = "", *, weight: str = "", **params: str) -> Callable[[F], F]:
    """Register a function as a reward term of all stages; the function itself is unchanged.

    Args:
        name: name of the term, also in progress.csv; that of the function if omitted.
        weight: field of `draft.learn.task.config.Rewards` with the weight; NAME_weight if omitted.
        params: field with the number of each parameter, which the function gets as a `Scaled`.

    Raises:
        ValueError: there is a term of this name, or no such number.
    """

    def register(function: F) -> F:
        term_name = name or function.__name__
        term = Term(function, weight or f"{term_name}_weight", params)
        if term_name in REWARDS:
            raise ValueError(f"there is a reward '{term_name}' already: rename one")
        known = {field.name for field in fields(Rewards)}
        missing = [field for field in (term.weight, *params.values()) if field not in known]
        if missing:
            cause = f"reward '{term_name}': config.Rewards has no number '{missing[0]}'"
            raise ValueError(f"{cause}: add its line there")
        REWARDS[term_name] = term
        return function

    return register


def _commanded_motion(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Size of the command, |v_xy| + |wz|."""
    commanded = command_of(env)
    return commanded[:, :2].norm(dim=1) + commanded[:, 2].abs()


@reward("linear_velocity", weight="linear_weight", sigma="linear_sigma")
def track_linear(env: ManagerBasedRlEnv, sigma: Scaled) -> torch.Tensor:
    """exp(-((vx - vx*)^2 + (vy - vy*)^2 + vz^2) / sigma^2), in the trunk's frame."""
    return _tracked(env, tracking_width(env, sigma))


def tracking_width(env: ManagerBasedRlEnv, sigma: Scaled) -> torch.Tensor:
    """Width of the tracking [m/s], narrower if commands are limited by the top speed."""
    return robot_of(env).scaled(sigma) * command_term(env).held_share


@reward("angular_velocity", weight="angular_weight", sigma="angular_sigma")
def track_angular(env: ManagerBasedRlEnv, sigma: Scaled) -> torch.Tensor:
    """exp(-((wz - wz*)^2 + wx^2 + wy^2) / sigma^2), in the trunk's frame."""
    robot = robot_of(env)
    w = robot.data.root_link_ang_vel_b
    error = (command_of(env)[:, 2] - w[:, 2]).square() + w[:, :2].square().sum(1)
    return torch.exp(-error / robot.scaled(sigma).square())


@reward(sigma="upright_sigma")
def upright(env: ManagerBasedRlEnv, sigma: Scaled) -> torch.Tensor:
    """exp(-(nx^2 + ny^2) / sigma^2), n the normal of the ground in the trunk's frame."""
    robot = robot_of(env)
    n = quat_apply_inverse(robot.data.root_link_quat_w, ground_of(env).normal())
    return torch.exp(-n[:, :2].square().sum(1) / robot.scaled(sigma).square())


@reward(most="air_time_most", gate="air_time_gate")
def air_time(env: ManagerBasedRlEnv, most: Scaled, gate: Scaled) -> torch.Tensor:
    """Number of feet in the air for less than `most` [s], per four feet.

    It is zero for commands below `gate`. Robots on driven wheels, which roll, do without it.
    """
    robot = robot_of(env)
    sensor: ContactSensor = env.scene[FEET]
    time = sensor.data.current_air_time
    if time is None:
        raise KeyError(FEET)
    counts = 4 * ((time > 0) & (time < robot.scaled(most)[:, None])).float().mean(1)
    return counts * (_commanded_motion(env) > robot.scaled(gate))


@reward(target="height", sigma="height_sigma")
def height(env: ManagerBasedRlEnv, target: Scaled, sigma: Scaled) -> torch.Tensor:
    """exp(-((h - h*) / sigma)^2), h the trunk's height above the ground below it.

    The target is that of a quadruped; other robots, and all of a training of many kinds of legs,
    keep the height of their home pose.
    """
    robot = robot_of(env)
    own = robot.cfg.by_slots or not robot.cfg.members[0].is_quadruped
    wanted = robot.height if own else robot.scaled(target)
    error = (ground_of(env).height() - wanted) / robot.scaled(sigma)
    return torch.exp(-error.square())


@reward(target="clearance", factor="clearance_scale", gate="clearance_gate")
def clearance(env: ManagerBasedRlEnv, target: Scaled, factor: Scaled, gate: Scaled) -> torch.Tensor:
    """Sum over feet of |height - target| x horizontal speed, per four feet.

    It is zero for commands below `gate`. The speed is that of a foot's centre: of a wheel that
    rolls without slip it is the robot's, though the point that touches the ground is at rest.
    Robots on driven wheels therefore do without it.
    """
    robot = robot_of(env)
    sensor = ground_of(env)
    speed = robot.data.site_lin_vel_w[:, robot.foot_sites, :2].norm(dim=-1)
    miss = (sensor.feet() - robot.scaled(target)[:, None]).abs()
    cost = 4 * (miss * speed).mean(1) * robot.scaled(factor)
    return cost * (_commanded_motion(env) > robot.scaled(gate))


@reward("vertical_velocity", weight="vertical_weight", factor="vertical_scale")
def vertical(env: ManagerBasedRlEnv, factor: Scaled) -> torch.Tensor:
    """vz^2 in the trunk's frame."""
    robot = robot_of(env)
    return robot.data.root_link_lin_vel_b[:, 2].square() * robot.scaled(factor)


reward("joint_limits", weight="limits_weight")(envs_mdp.joint_pos_limits)


@reward(weight="upper_leg_weight")
def upper_legs(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Number of legs whose thigh touches the ground."""
    sensor: ContactSensor = env.scene[THIGHS]
    contacts = sensor.data.found
    if contacts is None:
        raise KeyError(THIGHS)
    parts = [len(geoms) for geoms in robot_of(env).cfg.members[0].upper_legs]
    touching = [leg.any(1) for leg in (contacts > 0).split(parts, dim=1)]
    return torch.stack(touching).float().sum(0)


@reward()
def action_rate(env: ManagerBasedRlEnv, ramp: int, steps: int) -> torch.Tensor:
    """Squared change of the action, times a factor that grows from 0 to 1 at the beginning.

    A robot that must not move its legs quickly before it can walk learns to stand still.

    Args:
        env: the environment.
        ramp: iterations until the factor is 1.
        steps: steps per iteration.
    """
    factor = min(1.0, iteration(env, steps) / ramp) if ramp else 1.0
    return envs_mdp.action_rate_l2(env) * factor


@reward(least="power_least")
def power(env: ManagerBasedRlEnv, least: Scaled) -> torch.Tensor:
    """Electrical power per weight and commanded speed: the cost of transport at the command.

    It is that of `draft.learn.measuring.energy`, without the electronics, at the end of a step. A
    command slower than `least` counts as that.
    """
    robot = robot_of(env)
    torque, moved = robot.data.qfrc_actuator, robot.data.joint_vel
    watts = (torque * moved).clamp(min=0.0) + robot.copper_loss * torque.square()
    size = command_of(env)[:, :2].norm(dim=1).maximum(robot.scaled(least))
    return watts.sum(1) / (robot.weight * size)


def speed(env: ManagerBasedRlEnv, headroom: float, gate: float) -> torch.Tensor:
    """clip(vx sign(vx*), 0, v_cap) / v_cap if |vx*| > gate v_cap; v_cap = headroom x top speed."""
    robot = robot_of(env)
    forward = command_of(env)[:, 0]
    cap = headroom * robot.top_speed
    along = robot.data.root_link_lin_vel_b[:, 0] * forward.sign()
    return along.clamp(min=0.0).minimum(cap) / cap * (forward.abs() > gate * cap)


def progress(env: ManagerBasedRlEnv, gate: Scaled) -> torch.Tensor:
    """Velocity along the command per its size, from -1 to 1; zero for commands below `gate`.

    Before an obstacle, a robot that stands keeps the rewards of posture and loses only tracking,
    whose slope is small far from the command; this term is linear. It saturates at `ENOUGH` of
    the command: speed oscillates within a stride, and with saturation at the full command a robot
    that walks too fast would regain what the slow half of its stride loses.
    """
    commanded = command_of(env)[:, :2]
    size = commanded.norm(dim=1)
    along = (robot_of(env).data.root_link_lin_vel_b[:, :2] * commanded).sum(1)
    share = (along / (ENOUGH * size.square()).clamp(min=1e-6)).clamp(-1.0, 1.0)
    return share * (size > robot_of(env).scaled(gate))


def turning(env: ManagerBasedRlEnv, gate: float) -> torch.Tensor:
    """Rate of turn along its command, per its size, from -1 to 1; zero for slow commands.

    Rates of roll and pitch of a gait hide slow turns from the tracking of all three rates.

    Args:
        env: the environment.
        gate: share of the largest |wz*| up to which commands count as none.
    """
    commanded, most = command_of(env)[:, 2], command_term(env).largest[:, 2]
    along = robot_of(env).data.root_link_ang_vel_b[:, 2] * commanded
    share = (along / (ENOUGH * commanded.square()).clamp(min=1e-6)).clamp(-1.0, 1.0)
    return share * (commanded.abs() > gate * most)


def track_relative(env: ManagerBasedRlEnv, sigma: Scaled, share: float) -> torch.Tensor:
    """Tracking of vx and vy with the width sqrt(sigma^2 + (share |v*|)^2)."""
    size = command_of(env)[:, :2].norm(dim=1)
    return _tracked(env, torch.hypot(robot_of(env).scaled(sigma), share * size))


def track_capped(env: ManagerBasedRlEnv, headroom: float, share: float) -> torch.Tensor:
    """Tracking of vx and vy with the width share x v_cap, v_cap = headroom x top speed."""
    return _tracked(env, share * headroom * robot_of(env).top_speed)


def _tracked(env: ManagerBasedRlEnv, width: torch.Tensor) -> torch.Tensor:
    v = robot_of(env).data.root_link_lin_vel_b
    error = (command_of(env)[:, :2] - v[:, :2]).square().sum(1) + v[:, 2].square()
    return torch.exp(-error / width.square())


def reward_cfgs(task: Task) -> dict[str, RewardTermCfg]:
    """Configurations of the reward terms that all stages share, by name."""
    config = task.config
    terms = {name: term.cfg(config.rewards) for name, term in REWARDS.items()}
    if not config.rewards.power_weight:
        del terms["power"]  # It is no published term.
    terms["joint_limits"].params = {**of_angles(task.members[0])}
    terms["action_rate"].params = {"ramp": 0, "steps": config.learning.steps}
    return terms
