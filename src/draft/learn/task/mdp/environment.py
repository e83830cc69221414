"""Environments of the stages, for one quadruped or for several of one topology.

Robots walk on gently uneven ground at a commanded velocity, with pushes; `stages` has what each
stage changes. Numbers and their sources are in `draft.learn.task.config`.
"""

from __future__ import annotations

from typing import Any

from mjlab.envs import ManagerBasedRlEnvCfg
from mjlab.envs.mdp.actions import JointPositionActionCfg
from mjlab.managers.event_manager import EventTermCfg
from mjlab.managers.reward_manager import RewardTermCfg
from mjlab.managers.termination_manager import TerminationTermCfg
from mjlab.scene import SceneCfg
from mjlab.sensor import ContactMatch, ContactSensorCfg, SensorCfg
from mjlab.sim import MujocoCfg, SimulationCfg
from mjlab.tasks.velocity import mdp as velocity_mdp
from mjlab.terrains import TerrainEntityCfg
from mjlab.viewer import ViewerConfig

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.task.config import Config
from draft.learn.task.constants import scaled
from draft.learn.task.mdp import terminations
from draft.learn.task.mdp.actions import DelayedTargetsCfg, TargetsCfg
from draft.learn.task.mdp.commands import command_cfg
from draft.learn.task.mdp.events import event_cfgs
from draft.learn.task.mdp.observations import observation_cfgs
from draft.learn.task.mdp.rewards import OF_STEPS, reward_cfgs
from draft.learn.task.stages import STAGES
from draft.learn.task.terms import TERMS, arguments, guarded
from draft.learn.task.world.access import COMMAND, FEET, GROUND, THIGHS
from draft.learn.task.world.ground import HeightMapCfg, uneven
from draft.learn.task.world.robot import robot
from draft.learn.task.world.task import Task

FALLS = ("tilted", "low")  # Terminations of a robot that fell.
# Events that remain when a policy is watched: no errors of the robots, no pushes.
WATCHED = ("designs", "reset_base", "reset_joints")


def environment(
    task: Task, environments: int, play: bool = False, before: int = 0
) -> ManagerBasedRlEnvCfg:
    """Configuration of mjlab's environment.

    Args:
        task: the task.
        environments: number of worlds.
        play: whether it is for watching: no noise, no pushes, no curriculum, no time limit.
        before: number of worlds in the processes before this one: world i of all has design i
            modulo their number.

    Raises:
        ValueError: there is no such stage.
    """
    if task.stage not in STAGES:
        raise ValueError(f"no stage '{task.stage}'; stages: {', '.join(STAGES)}")
    config, first = task.config, task.members[0]
    physics = config.physics
    terrain = _terrain(task)
    cfg = ManagerBasedRlEnvCfg(
        decimation=physics.decimation,
        seed=task.seed,
        scene=SceneCfg(
            num_envs=environments,
            terrain=terrain,
            entities={"robot": robot(task.members, config, before, task.by_slots)},
            sensors=_sensors(task, terrain),
            extent=2.0,
        ),
        observations=observation_cfgs(task, play),
        actions={"joint_pos": _targets(config, first)},
        commands={COMMAND: command_cfg(task)},
        events=event_cfgs(task),
        rewards=reward_cfgs(task),
        terminations=_terminations(task),
        curriculum={},
        viewer=ViewerConfig(
            origin_type=ViewerConfig.OriginType.ASSET_BODY,
            entity_name="robot",
            body_name=first.trunk,
            distance=5.0 * first.leg_length,
            elevation=-12.0,
            azimuth=120.0,
        ),
        sim=SimulationCfg(
            njmax=physics.constraints,
            mujoco=MujocoCfg(
                timestep=physics.timestep,
                iterations=physics.solver_iterations,
                ls_iterations=physics.line_search_iterations,
                # MuJoCo Warp has at most one contact between a thigh and the ground either way.
                disableflags=("multiccd",),
            ),
        ),
    )
    _add_terms(cfg, config)
    STAGES[task.stage].apply(cfg, task)
    if first.rolls:
        cfg.rewards = {name: term for name, term in cfg.rewards.items() if name not in OF_STEPS}
    length = cfg.terminations["time_out"].params["length"]
    cfg.episode_length_s = max(length.at(m.scale) for m in task.members)
    if play:
        cfg.episode_length_s, cfg.curriculum = 1e9, {}
        cfg.events = {name: term for name, term in cfg.events.items() if name in WATCHED}
        cfg.terminations = {name: cfg.terminations[name] for name in FALLS}
    return cfg


def _targets(config: Config, first: LeggedRobot) -> JointPositionActionCfg:
    """Configuration of the action: targets of all joints."""
    targets = {
        "entity_name": "robot",
        "actuator_names": (".*",),
        "scale": config.actuation.action_scale,
        "use_default_offset": True,
    }
    delay = config.episodes.delay
    if any(delay) or first.rolls:
        share = config.actuation.wheel_scale
        return DelayedTargetsCfg(**targets, delay=delay, wheel_scale=share)
    return TargetsCfg(**targets)


def _terrain(task: Task) -> TerrainEntityCfg:
    if task.ground == "flat":
        return TerrainEntityCfg(terrain_type="plane")
    radius = max(member.foot_radius for member in task.members)
    return uneven(task.config, STAGES[task.stage].shares, radius, task.seed)


def _sensors(task: Task, terrain: TerrainEntityCfg) -> tuple[SensorCfg, ...]:
    numbers, first = task.config.observations, task.members[0]
    extent, generator = None, terrain.terrain_generator
    if generator is not None:
        side, columns = task.config.ground.patch, len(generator.sub_terrains)
        extent = (side * task.config.ground.rows, side * columns)
    terrain_match = ContactMatch(mode="body", pattern="terrain")
    thighs = tuple(geom for leg in first.upper_legs for geom in leg)
    return (
        HeightMapCfg(
            name=GROUND,
            extent=extent,
            pitch=numbers.map_pitch,
            entity="robot",
            trunk=first.trunk,
            feet=first.feet,
            size=numbers.scan_size,
            grid=numbers.scan_pitch,
            reach=numbers.scan_range,
            ring=numbers.foot_ring,
            foot_reach=numbers.foot_range,
        ),
        ContactSensorCfg(
            name=FEET,
            primary=ContactMatch(mode="geom", pattern=first.foot_geoms, entity="robot"),
            secondary=terrain_match,
            fields=("found", "force"),
            reduce="netforce",
            num_slots=1,
            track_air_time=True,
        ),
        ContactSensorCfg(
            name=THIGHS,
            primary=ContactMatch(mode="geom", pattern=thighs, entity="robot"),
            secondary=terrain_match,
            fields=("found",),
            reduce="netforce",
            num_slots=1,
        ),
    )


def _add_terms(cfg: ManagerBasedRlEnvCfg, config: Config) -> None:
    """Add the terms of extensions."""
    for name, numbers in config.terms:
        term, params = TERMS[name], arguments(numbers)
        if term.kind == "stage":
            continue
        terms: dict[str, Any] = getattr(cfg, f"{term.kind}s")
        options = {**term.options, "func": guarded(name, term.function), "params": params}
        if term.kind == "reward":
            terms[name] = RewardTermCfg(weight=numbers.weight, **options)
        elif term.kind == "termination":
            terms[name] = TerminationTermCfg(**options)
        else:
            interval = getattr(numbers, "interval", None)
            terms[name] = EventTermCfg(interval_range_s=interval, **options)


def _terminations(task: Task) -> dict[str, TerminationTermCfg]:
    e = task.config.episodes
    terms = {
        "tilted": TerminationTermCfg(func=terminations.tilted, params={"limit": e.tilt}),
        "low": TerminationTermCfg(func=terminations.low, params={"share": e.low}),
    }
    terms["time_out"] = TerminationTermCfg(
        func=terminations.time_out, time_out=True, params={"length": scaled(e, "length")}
    )
    if task.ground == "uneven":
        terms["left_ground"] = TerminationTermCfg(
            func=velocity_mdp.out_of_terrain_bounds, time_out=True, params={"margin": e.margin}
        )
    return terms
