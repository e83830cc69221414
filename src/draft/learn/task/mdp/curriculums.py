"""Curricula: functions of the number of steps, so that they are unchanged in a resumed run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch

from draft.learn.task.constants import ramp_at
from draft.learn.task.groups import Ramp
from draft.learn.task.mdp.commands import command_term
from draft.learn.task.world.access import command_of, iteration, robot_of

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv


def logged(env: ManagerBasedRlEnv, env_ids: torch.Tensor, ramp: Ramp, steps: int) -> float:
    """Present value of a ramp, for the log."""
    return ramp_at(ramp, iteration(env, steps))


def fastest(env: ManagerBasedRlEnv, env_ids: torch.Tensor) -> torch.Tensor:
    """Largest |vx| that is commanded, mean over the worlds [m/s], for the log.

    Robots that learn to survive pushes do not count.
    """
    term = command_term(env)
    largest = term.range_now()[:, 0]
    if term.pushed is None:
        return largest.mean()
    return (largest * ~term.pushed).sum() / (~term.pushed).sum()


def rows(
    env: ManagerBasedRlEnv,
    env_ids: torch.Tensor,
    promotion: float,
    demotion: float,
    by_way: bool = False,
) -> torch.Tensor:
    """Move robots to harder or easier patches when they restart.

    A robot moves up a row after `promotion` metres from the patch's origin, down a row after less
    than `demotion` of the distance that its last command covers in an episode, and from the last
    row to any. With `by_way` robots that fell stay or move down, and others move up after 0.8 of
    the commanded distance, if that is shorter than `promotion`.

    Returns:
        Mean row of all robots; mjlab waits for every number that is logged here.
    """
    terrain = env.scene.terrain
    robot = robot_of(env)
    if terrain is None:
        return torch.zeros(())
    position = robot.data.root_link_pos_w[env_ids, :2] - env.scene.env_origins[env_ids, :2]
    distance = position.norm(dim=1)
    speed = command_of(env)[env_ids, :2].norm(dim=1)
    length = env.termination_manager.get_term_cfg("time_out").params["length"]
    commanded = speed * robot.scaled(length)[env_ids]
    up = distance > promotion
    if by_way:
        fell = env.termination_manager.terminated[env_ids]
        walks = commanded > 0.5 * promotion  # A command to stand or to creep shows nothing.
        up = ~fell & walks & (distance > (0.8 * commanded).clamp(max=promotion))
        down = (~up & walks) & (distance < demotion * commanded.clamp(max=promotion))
    else:
        down = ~up & (distance < demotion * commanded)
    # At the first reset no robot has walked yet.
    started = env.common_step_counter > 0
    terrain.update_env_origins(env_ids, up & started, down & started)
    return terrain.terrain_levels.float().mean()
