"""Reward terms of arXiv 2609.38405 that mjlab does not have as they are; shapes are (worlds,).

Each number that grows with the leg is a `Scaled`, taken at the scale of every world's design.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from mjlab.envs import mdp as stock
from mjlab.utils.lab_api.math import quat_apply_inverse

from draft.learn.constants import Scaled
from draft.learn.lab.ground import HeightMap
from draft.learn.lab.mdp import curriculums
from draft.learn.lab.robot import Robot

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv
    from mjlab.sensor import ContactSensor

COMMAND, GROUND, FEET, THIGHS = "twist", "ground", "feet_contact", "upper_leg_contact"
ENOUGH = 0.8  # Share of the command at which progress is whole.


def _robot(env: ManagerBasedRlEnv) -> Robot:
    return env.scene["robot"]


def _ground(env: ManagerBasedRlEnv) -> HeightMap:
    return env.scene[GROUND]


def command(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Commanded vx, vy [m/s] and wz [rad/s] in the trunk's frame, shape (worlds, 3)."""
    found = env.command_manager.get_command(COMMAND)
    if found is None:
        raise KeyError(COMMAND)
    return found


def _asked(env: ManagerBasedRlEnv) -> torch.Tensor:
    """How much motion is asked for: |v_xy| + |wz|."""
    asked = command(env)
    return asked[:, :2].norm(dim=1) + asked[:, 2].abs()


def track_linear(env: ManagerBasedRlEnv, sigma: Scaled) -> torch.Tensor:
    """exp(-((vx - vx*)^2 + (vy - vy*)^2 + vz^2) / sigma^2), in the trunk's frame."""
    return _tracked(env, tracking_width(env, sigma))


def tracking_width(env: ManagerBasedRlEnv, sigma: Scaled) -> torch.Tensor:
    """Width of the tracking [m/s], narrower where commands are held below the top speed."""
    held = env.command_manager.get_term(COMMAND).held_share  # type: ignore[attr-defined]
    return _robot(env).scaled(sigma) * held


def track_angular(env: ManagerBasedRlEnv, sigma: Scaled) -> torch.Tensor:
    """exp(-((wz - wz*)^2 + wx^2 + wy^2) / sigma^2), in the trunk's frame."""
    robot = _robot(env)
    w = robot.data.root_link_ang_vel_b
    error = (command(env)[:, 2] - w[:, 2]).square() + w[:, :2].square().sum(1)
    return torch.exp(-error / robot.scaled(sigma).square())


def upright(env: ManagerBasedRlEnv, sigma: Scaled) -> torch.Tensor:
    """exp(-(nx^2 + ny^2) / sigma^2), n the normal of the ground in the trunk's frame."""
    robot = _robot(env)
    n = quat_apply_inverse(robot.data.root_link_quat_w, _ground(env).normal())
    return torch.exp(-n[:, :2].square().sum(1) / robot.scaled(sigma).square())


def air_time(env: ManagerBasedRlEnv, most: Scaled, gate: Scaled) -> torch.Tensor:
    """Number of feet in the air for less than `most`; zero unless the command asks for motion."""
    robot = _robot(env)
    sensor: ContactSensor = env.scene[FEET]
    time = sensor.data.current_air_time
    if time is None:
        raise KeyError(FEET)
    counts = ((time > 0) & (time < robot.scaled(most)[:, None])).float().sum(1)
    return counts * (_asked(env) > robot.scaled(gate))


def height(env: ManagerBasedRlEnv, target: Scaled, sigma: Scaled) -> torch.Tensor:
    """exp(-((h - h*) / sigma)^2), h the trunk's height above the ground below it."""
    robot = _robot(env)
    error = (_ground(env).height() - robot.scaled(target)) / robot.scaled(sigma)
    return torch.exp(-error.square())


def clearance(env: ManagerBasedRlEnv, target: Scaled, factor: Scaled, gate: Scaled) -> torch.Tensor:
    """Sum over feet of |height - target| x horizontal speed; zero unless motion is asked for."""
    robot = _robot(env)
    sensor = _ground(env)
    speed = robot.data.site_lin_vel_w[:, robot.foot_sites, :2].norm(dim=-1)
    miss = (sensor.feet() - robot.scaled(target)[:, None]).abs()
    cost = (miss * speed).sum(1) * robot.scaled(factor)
    return cost * (_asked(env) > robot.scaled(gate))


def vertical(env: ManagerBasedRlEnv, factor: Scaled) -> torch.Tensor:
    """vz^2 in the trunk's frame."""
    robot = _robot(env)
    return robot.data.root_link_lin_vel_b[:, 2].square() * robot.scaled(factor)


def upper_legs(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Number of legs whose thigh touches the ground."""
    sensor: ContactSensor = env.scene[THIGHS]
    found = sensor.data.found
    if found is None:
        raise KeyError(THIGHS)
    touching = (found > 0).reshape(found.shape[0], 4, -1).any(-1)
    return touching.float().sum(1)


def action_rate(env: ManagerBasedRlEnv, ramp: int, steps: int) -> torch.Tensor:
    """Squared change of the action, times a factor that grows from 0 to 1 at the beginning.

    A robot that may not move its legs quickly before it can walk learns to stand still.

    Args:
        env: the environment.
        ramp: iterations until the factor is 1.
        steps: steps per iteration.
    """
    factor = min(1.0, curriculums.iteration(env, steps) / ramp) if ramp else 1.0
    return stock.action_rate_l2(env) * factor


def speed(env: ManagerBasedRlEnv, headroom: float, gate: float) -> torch.Tensor:
    """clip(vx sign(vx*), 0, v_cap) / v_cap if |vx*| > gate v_cap; v_cap = headroom x top speed."""
    robot = _robot(env)
    asked = command(env)[:, 0]
    cap = headroom * robot.top_speed
    along = robot.data.root_link_lin_vel_b[:, 0] * asked.sign()
    return along.clamp(min=0.0).minimum(cap) / cap * (asked.abs() > gate * cap)


def progress(env: ManagerBasedRlEnv, gate: Scaled) -> torch.Tensor:
    """Velocity along the commanded one per its size, from -1 to 1; zero where none is asked for.

    Before an obstacle, standing keeps the rewards of posture and loses only tracking, whose slope
    is small far from the command: this one is linear. It ends at `ENOUGH` of the command. Speed
    swings within a stride, and if it ended at the whole, a robot that walks too fast would gain
    what the slow half of its stride loses.
    """
    asked = command(env)[:, :2]
    size = asked.norm(dim=1)
    along = (_robot(env).data.root_link_lin_vel_b[:, :2] * asked).sum(1)
    share = (along / (ENOUGH * size.square()).clamp(min=1e-6)).clamp(-1.0, 1.0)
    return share * (size > _robot(env).scaled(gate))


def track_relative(env: ManagerBasedRlEnv, sigma: Scaled, share: float) -> torch.Tensor:
    """Tracking of vx and vy with the width sqrt(sigma^2 + (share |v*|)^2)."""
    asked = command(env)[:, :2].norm(dim=1)
    return _tracked(env, torch.hypot(_robot(env).scaled(sigma), share * asked))


def track_capped(env: ManagerBasedRlEnv, headroom: float, share: float) -> torch.Tensor:
    """Tracking of vx and vy with the width share x v_cap, v_cap = headroom x top speed."""
    return _tracked(env, share * headroom * _robot(env).top_speed)


def _tracked(env: ManagerBasedRlEnv, width: torch.Tensor) -> torch.Tensor:
    v = _robot(env).data.root_link_lin_vel_b
    error = (command(env)[:, :2] - v[:, :2]).square().sum(1) + v[:, 2].square()
    return torch.exp(-error / width.square())
