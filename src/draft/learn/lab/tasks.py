"""Environments of the four stages, for one quadruped or for several of one topology.

`base` walks on gently uneven ground at a commanded velocity, pushed now and then. The second
stages start from its policy and each ramps one thing: the commanded speed, the height of the
ground, or the size of the pushes. Numbers and their sources are in `draft.learn.config`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from mjlab.envs import ManagerBasedRlEnvCfg
from mjlab.envs import mdp as stock
from mjlab.envs.mdp.actions import JointPositionActionCfg
from mjlab.managers.curriculum_manager import CurriculumTermCfg
from mjlab.managers.event_manager import EventTermCfg
from mjlab.managers.observation_manager import ObservationGroupCfg
from mjlab.managers.observation_manager import ObservationTermCfg as Seen
from mjlab.managers.reward_manager import RewardTermCfg as Reward
from mjlab.managers.scene_entity_config import SceneEntityCfg
from mjlab.managers.termination_manager import TerminationTermCfg as Ending
from mjlab.scene import SceneCfg
from mjlab.sensor import ContactMatch, ContactSensorCfg
from mjlab.sim import MujocoCfg, SimulationCfg
from mjlab.tasks.velocity import mdp as walking
from mjlab.terrains import TerrainEntityCfg
from mjlab.utils.noise import UniformNoiseCfg
from mjlab.viewer import ViewerConfig

from draft.learn.config import STAGES, Config
from draft.learn.lab.family import assume_designs
from draft.learn.lab.ground import HeightMapCfg, uneven
from draft.learn.lab.robot import robot
from draft.learn.lab.terms import commands, endings, events, observations, ramps, rewards
from draft.learn.numbers import Scaled, scaled
from draft.learn.quadruped import Quadruped

GroundKind = Literal["uneven", "flat"]


@dataclass(frozen=True)
class Task:
    """What an environment is about.

    Attributes:
        members: one quadruped, or several of one topology.
        stage: of STAGES.
        config: the numbers.
        ground: "flat" for a plane, on which heights need no map.
        see_design: the policy sees what tells designs apart.
        seed: of everything random.
    """

    members: tuple[Quadruped, ...]
    stage: str = "base"
    config: Config = Config()
    ground: GroundKind = "uneven"
    see_design: bool = False
    seed: int = 0


def environment(task: Task, environments: int, play: bool = False) -> ManagerBasedRlEnvCfg:
    """Configuration of mjlab's environment.

    Args:
        task: what it is about.
        environments: number of worlds.
        play: for watching: no noise, no pushes, no curriculum, no end of an episode by time.

    Raises:
        ValueError: there is no such stage.
    """
    if task.stage not in STAGES:
        raise ValueError(f"no stage '{task.stage}'; stages: {', '.join(STAGES)}")
    config, first = task.config, task.members[0]
    physics = config.physics
    longest = max(scaled(config.episodes, "length").at(m.scale) for m in task.members)
    terrain = _terrain(task)
    return ManagerBasedRlEnvCfg(
        decimation=physics.decimation,
        episode_length_s=1e9 if play else longest,
        seed=task.seed,
        scene=SceneCfg(
            num_envs=environments,
            terrain=terrain,
            entities={"robot": robot(task.members, config)},
            sensors=_sensors(task, terrain),
            extent=2.0,
        ),
        observations=_observations(task, play),
        actions={
            "joint_pos": JointPositionActionCfg(
                entity_name="robot",
                actuator_names=(".*",),
                scale=config.actuation.action_scale,
                use_default_offset=True,
            )
        },
        commands={rewards.COMMAND: _command(task)},
        events=_events(task, play),
        rewards=_rewards(task),
        terminations=_endings(task, play),
        curriculum={} if play else _curriculum(task),
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
                # MuJoCo Warp has one contact at most between a thigh and the ground either way.
                disableflags=("multiccd",),
            ),
        ),
    )


def _terrain(task: Task) -> TerrainEntityCfg:
    if task.ground == "flat":
        return TerrainEntityCfg(terrain_type="plane")
    radius = max(member.foot_radius for member in task.members)
    return uneven(task.config, task.stage, radius, task.seed)


def _sensors(task: Task, terrain: TerrainEntityCfg) -> tuple[Any, ...]:
    seen, first = task.config.observations, task.members[0]
    extent, generator = None, terrain.terrain_generator
    if generator is not None:
        side, columns = task.config.ground.patch, len(generator.sub_terrains)
        extent = (side * task.config.ground.rows, side * columns)
    touching: dict[str, Any] = {
        "secondary": ContactMatch(mode="body", pattern="terrain"),
        "reduce": "netforce",
        "num_slots": 1,
    }
    thighs = tuple(geom for leg in first.upper_legs for geom in leg)
    return (
        HeightMapCfg(
            name=rewards.GROUND,
            extent=extent,
            pitch=seen.map_pitch,
            entity="robot",
            trunk=first.trunk,
            feet=first.feet,
            size=seen.scan_size,
            grid=seen.scan_pitch,
            reach=seen.scan_range,
            ring=seen.foot_ring,
            foot_reach=seen.foot_range,
        ),
        ContactSensorCfg(
            name=rewards.FEET,
            primary=ContactMatch(mode="geom", pattern=first.foot_geoms, entity="robot"),
            fields=("found", "force"),
            track_air_time=True,
            **touching,
        ),
        ContactSensorCfg(
            name=rewards.THIGHS,
            primary=ContactMatch(mode="geom", pattern=thighs, entity="robot"),
            fields=("found",),
            **touching,
        ),
    )


def _observations(task: Task, play: bool) -> dict[str, ObservationGroupCfg]:
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
        "joint_vel": Seen(func=observations.joint_velocity, params=velocity),
        "actions": Seen(func=stock.last_action),
        "command": Seen(func=stock.generated_commands, params={"command_name": rewards.COMMAND}),
        "height_scan": Seen(
            func=observations.height_scan, noise=_noise(numbers.scan_noise), scale=scale
        ),
    }
    if task.see_design:
        actor["design"] = Seen(func=observations.design)
    contact = {"sensor_name": rewards.FEET}
    critic = {
        **{name: replace(term, noise=None) for name, term in actor.items()},
        "joint_vel": Seen(func=observations.joint_velocity),
        "foot_height": Seen(func=observations.foot_height),
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


def _command(task: Task) -> commands.VelocityCommandCfg:
    config = task.config
    c, steps = config.commands, config.learning.steps
    forward, sideways, turn = (scaled(c, name) for name in ("forward", "sideways", "turn"))
    limit: float | None = c.limit
    ramp: ramps.Ramp = ((0, 1.0),)
    if task.stage == "velocity":
        v = config.velocity
        forward, sideways, turn = Scaled(v.forward), Scaled(v.sideways), Scaled(v.turn)
        limit, ramp = None, v.ramp
    elif task.stage == "push":
        p = config.push
        forward, sideways, turn = Scaled(p.forward), Scaled(p.sideways), Scaled(p.turn)
        limit = None
    elif task.stage == "terrain":
        limit = config.terrain.limit
    scale = task.members[0].scale
    sliders = [number.at(scale) for number in (forward, sideways, turn)]
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
            lin_vel_x=(-sliders[0], sliders[0]),
            lin_vel_y=(-sliders[1], sliders[1]),
            ang_vel_z=(-sliders[2], sliders[2]),
            heading=(-3.14159, 3.14159),
        ),
        forward=forward,
        sideways=sideways,
        turn=turn,
        forward_least=c.forward_least,
        limit=limit,
        limit_sideways=c.limit_sideways,
        ramp=ramp,
        steps=steps,
    )


def _events(task: Task, play: bool) -> dict[str, EventTermCfg]:
    e, first = task.config.episodes, task.members[0]
    found = {}
    if len(task.members) > 1:
        found["designs"] = EventTermCfg(
            func=assume_designs, mode="startup", params={"config": task.config}
        )
    found |= {
        "reset_base": EventTermCfg(
            func=stock.reset_root_state_uniform,
            mode="reset",
            params={
                "pose_range": {
                    "x": (-e.spawn, e.spawn),
                    "y": (-e.spawn, e.spawn),
                    "z": e.drop,
                    "yaw": (-e.yaw, e.yaw),
                },
                "velocity_range": {},
            },
        ),
        "reset_joints": EventTermCfg(
            func=stock.reset_joints_by_offset,
            mode="reset",
            params={"position_range": (0.0, 0.0), "velocity_range": (0.0, 0.0)},
        ),
    }
    if play:
        return found
    return found | {
        "foot_friction": EventTermCfg(
            func=stock.dr.geom_friction,
            mode="startup",
            params={
                "asset_cfg": SceneEntityCfg("robot", geom_names=first.foot_geoms),
                "operation": "abs",
                "ranges": e.friction,
                "shared_random": True,
            },
        ),
        "encoder_bias": EventTermCfg(
            func=stock.dr.encoder_bias,
            mode="startup",
            params={
                "asset_cfg": SceneEntityCfg("robot"),
                "bias_range": (-e.encoder, e.encoder),
            },
        ),
        "shift_centre": EventTermCfg(
            func=events.shift_centre, mode="startup", params={"reach": scaled(e, "centre")}
        ),
        "push": EventTermCfg(func=events.Pushes, mode="step", params=_pushes(task)),
    }


def _pushes(task: Task) -> dict[str, Any]:
    """Numbers of the pushes of a stage."""
    e, p = task.config.episodes, task.config.push
    late = task.stage == "push"
    linear = tuple(Scaled(v) for v in p.linear) if late else _each(e, "push_linear")
    angular = tuple(Scaled(v) for v in p.angular) if late else _each(e, "push_angular")
    return {
        "linear": linear,
        "angular": angular,
        "interval": _each(p, "interval") if late else _each(e, "push_interval"),
        "ramp": p.ramp if late else ((0, 1.0),),
        "steps": task.config.learning.steps,
    }


def _each(group: Any, name: str) -> tuple[Scaled, ...]:
    """A tuple of numbers, each with their power of s."""
    values, power = scaled(group, name)
    return tuple(Scaled(value, power) for value in values)  # type: ignore[attr-defined]


def _rewards(task: Task) -> dict[str, Reward]:
    r = task.config.rewards
    found = {
        "linear_velocity": Reward(
            func=rewards.track_linear,
            weight=r.linear_weight,
            params={"sigma": scaled(r, "linear_sigma")},
        ),
        "angular_velocity": Reward(
            func=rewards.track_angular,
            weight=r.angular_weight,
            params={"sigma": scaled(r, "angular_sigma")},
        ),
        "upright": Reward(
            func=rewards.upright,
            weight=r.upright_weight,
            params={"sigma": scaled(r, "upright_sigma")},
        ),
        "air_time": Reward(
            func=rewards.air_time,
            weight=r.air_time_weight,
            params={"most": scaled(r, "air_time_most"), "gate": scaled(r, "air_time_gate")},
        ),
        "height": Reward(
            func=rewards.height,
            weight=r.height_weight,
            params={"target": scaled(r, "height"), "sigma": scaled(r, "height_sigma")},
        ),
        "clearance": Reward(
            func=rewards.clearance,
            weight=r.clearance_weight,
            params={
                "target": scaled(r, "clearance"),
                "factor": scaled(r, "clearance_scale"),
                "gate": scaled(r, "clearance_gate"),
            },
        ),
        "vertical_velocity": Reward(
            func=rewards.vertical,
            weight=r.vertical_weight,
            params={"factor": scaled(r, "vertical_scale")},
        ),
        "joint_limits": Reward(func=stock.joint_pos_limits, weight=r.limits_weight),
        "upper_legs": Reward(func=rewards.upper_legs, weight=r.upper_leg_weight),
        "action_rate": Reward(func=stock.action_rate_l2, weight=r.action_rate_weight),
    }
    if task.stage == "push":
        found["linear_velocity"].params = {"sigma": Scaled(task.config.push.sigma)}
    elif task.stage == "velocity":
        _reward_speed(task.config, found)
    return found


def _reward_speed(config: Config, found: dict[str, Reward]) -> None:
    """What stage `velocity` rewards otherwise."""
    v, gate = config.velocity, found["air_time"].params["gate"]
    found["linear_velocity"] = Reward(
        func=rewards.track_capped,
        weight=config.rewards.linear_weight,
        params={"headroom": v.headroom, "share": v.sigma},
    )
    found["air_time"] = Reward(
        func=rewards.air_time,
        weight=v.air_time_weight,
        params={"most": Scaled(v.air_time_most), "gate": gate},
    )
    found["action_rate"] = Reward(func=stock.action_rate_l2, weight=v.action_rate_weight)
    found["speed"] = Reward(
        func=rewards.speed,
        weight=v.speed_weight,
        params={"headroom": v.headroom, "gate": v.speed_gate},
    )


def _endings(task: Task, play: bool) -> dict[str, Ending]:
    e = task.config.episodes
    found = {
        "tilted": Ending(func=endings.tilted, params={"limit": e.tilt}),
        "low": Ending(func=endings.low, params={"share": e.low}),
    }
    if play:
        return found
    found["time_out"] = Ending(
        func=endings.time_out, time_out=True, params={"length": scaled(e, "length")}
    )
    if task.ground == "uneven":
        # Who runs away from hard ground has not mastered it.
        found["left_ground"] = Ending(
            func=walking.out_of_terrain_bounds,
            time_out=task.stage != "terrain",
            params={"margin": e.margin},
        )
    return found


def _curriculum(task: Task) -> dict[str, CurriculumTermCfg]:
    config, steps = task.config, task.config.learning.steps
    if task.stage == "velocity":
        params = {"ramp": config.velocity.ramp, "steps": steps}
        return {"speed_share": CurriculumTermCfg(func=ramps.logged, params=params)}
    if task.stage == "push":
        params = {"ramp": config.push.ramp, "steps": steps}
        return {"push_factor": CurriculumTermCfg(func=ramps.logged, params=params)}
    if task.stage == "terrain" and task.ground == "uneven":
        t = config.terrain
        params = {"promotion": t.promotion, "demotion": t.demotion}
        return {"row": CurriculumTermCfg(func=ramps.rows, params=params)}
    return {}
