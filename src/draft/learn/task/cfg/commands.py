"""Velocity commands of a stage."""

from __future__ import annotations

from draft.learn.task.cfg.task import Task
from draft.learn.task.constants import Scaled, scaled
from draft.learn.task.groups import Ramp
from draft.learn.task.mdp import commands


def command_cfg(task: Task) -> commands.VelocityCommandCfg:
    """Configuration of the velocity commands of a stage."""
    config = task.config
    c, steps = config.commands, config.learning.steps
    forward, sideways, turn = (scaled(c, name) for name in ("forward", "sideways", "turn"))
    limit: float | None = c.limit
    ramp: Ramp = ((0, 1.0),)
    grow: commands.Growth | None = None
    away: commands.Away | None = None
    p = config.push
    slow = tuple(Scaled(value) for value in (p.forward, p.sideways, p.turn))
    pushed: commands.Pushed | None = None
    if task.stage == "velocity":
        v = config.velocity
        growth, start = scaled(v, "growth"), forward
        forward, sideways, turn = Scaled(v.forward), Scaled(v.sideways), Scaled(v.turn)
        limit, ramp = None, v.ramp
        if v.growth:
            ramp = ((0, 1.0),)
            grow = commands.Growth(start, growth, v.tracked, v.missed)
        if v.pushed:
            pushed = commands.Pushed(v.pushed, *slow)
    elif task.stage == "push":
        forward, sideways, turn = slow
        limit = None
    elif task.stage == "terrain":
        limit = config.terrain.limit
        if config.terrain.forward[1]:
            low, high = config.terrain.forward
            away = commands.Away(Scaled(low, 0.5), Scaled(high, 0.5), config.terrain.away)
    scale = task.members[0].scale
    ends = [number.at(scale) for number in (forward, sideways, turn)]
    return commands.VelocityCommandCfg(
        entity_name="robot",
        resampling_time_range=c.interval,
        rel_standing_envs=c.standing,
        rel_heading_envs=c.heading,
        rel_forward_envs=c.forward_only,
        heading_command=True,
        heading_control_stiffness=c.heading_stiffness,
        debug_vis=True,
        ranges=commands.VelocityCommandCfg.Ranges(
            lin_vel_x=(-ends[0], ends[0]),
            lin_vel_y=(-ends[1], ends[1]),
            ang_vel_z=(-ends[2], ends[2]),
            heading=(-3.14159, 3.14159),
        ),
        forward=forward,
        sideways=sideways,
        turn=turn,
        forward_least=c.forward_least,
        limit=limit,
        limit_sideways=c.limit_sideways,
        ramp=ramp,
        growth=grow,
        away=away,
        pushed=pushed,
        steps=steps,
    )
