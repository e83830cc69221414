"""Curricula: functions of the number of steps, so that a resumed run stands where it stood."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import torch

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

Ramp = tuple[tuple[int, float], ...]


def at(ramp: Ramp, iteration: int) -> float:
    """Value of a ramp: that of the last step at or before an iteration.

    Args:
        ramp: (iteration, value), iterations rising from 0.
        iteration: the iteration.
    """
    return [value for start, value in ramp if start <= iteration][-1]


def iteration(env: ManagerBasedRlEnv, steps: int) -> int:
    """Iterations done so far.

    Args:
        env: the environment.
        steps: its steps per iteration.
    """
    return env.common_step_counter // steps


def logged(env: ManagerBasedRlEnv, env_ids: Any, ramp: Ramp, steps: int) -> float:
    """Where a ramp stands, for the log."""
    return at(ramp, iteration(env, steps))


def fastest(env: ManagerBasedRlEnv, env_ids: Any) -> torch.Tensor:
    """Largest |vx| that is asked for, mean over the designs [m/s], for the log."""
    return env.command_manager.get_term("twist").range_now()[:, 0].mean()  # type: ignore[attr-defined]


def rows(
    env: ManagerBasedRlEnv, env_ids: Any, promotion: float, demotion: float, by_way: bool = False
) -> torch.Tensor:
    """Move robots to harder or easier patches when they start anew.

    Up a row after `promotion` metres from the patch's origin, down a row after less than
    `demotion` of the way that the last command asks for in an episode; past the last row to any.
    With `by_way` those who fell stay or go down, and others go up after 0.8 of the way that was
    asked for, if that is shorter than `promotion`.

    Returns:
        Mean row of all robots; mjlab waits for every number that is logged here.
    """
    terrain = env.scene.terrain
    robot = env.scene["robot"]
    if terrain is None:
        return torch.zeros(())
    place = robot.data.root_link_pos_w[env_ids, :2] - env.scene.env_origins[env_ids, :2]
    way = place.norm(dim=1)
    asked = env.command_manager.get_command("twist")[env_ids, :2].norm(dim=1)  # type: ignore[index]
    length = env.termination_manager.get_term_cfg("time_out").params["length"]
    asked = asked * robot.scaled(length)[env_ids]
    up = way > promotion
    if by_way:
        fell = env.termination_manager.terminated[env_ids]
        walks = asked > 0.5 * promotion  # Who is asked to stand or to creep shows nothing.
        up = ~fell & walks & (way > (0.8 * asked).clamp(max=promotion))
        down = (~up & walks) & (way < demotion * asked.clamp(max=promotion))
    else:
        down = ~up & (way < demotion * asked)
    # At the first reset nobody has walked yet.
    begun = env.common_step_counter > 0
    terrain.update_env_origins(env_ids, up & begun, down & begun)
    return terrain.terrain_levels.float().mean()
