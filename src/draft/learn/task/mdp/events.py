"""Events of a stage: designs, resets, errors of the robots, pushes and kicks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

import numpy as np
import torch
from mjlab.envs import mdp as envs_mdp
from mjlab.managers.event_manager import EventTermCfg, RecomputeLevel, requires_model_fields
from mjlab.managers.scene_entity_config import SceneEntityCfg
from mjlab.utils.lab_api.math import quat_apply_inverse

from draft.learn.bodies import inertia
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.task.config import Config
from draft.learn.task.constants import Scaled, ramp_at, scaled
from draft.learn.task.groups import Episodes, Pushing, Ramp
from draft.learn.task.mdp.commands import share_of_worlds
from draft.learn.task.mdp.physics_errors import physics_errors
from draft.learn.task.mdp.world_models import assume_designs
from draft.learn.task.world.access import iteration, robot_of
from draft.learn.task.world.robot import Robot
from draft.learn.task.world.task import Task

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

STREAM = 0x17E7  # Of random numbers: inertia errors change nothing else that a seed draws.


@requires_model_fields("body_ipos", recompute=RecomputeLevel.set_const)
def shift_centre(env: ManagerBasedRlEnv, env_ids: torch.Tensor | None, reach: Scaled) -> None:
    """Shift the trunk's centre of mass by up to `reach` [m] along each axis."""
    robot = robot_of(env)
    trunk = robot.indexing.root_body_id
    drawn = 2 * torch.rand(env.num_envs, 3, device=env.device) - 1
    positions: Any = env.sim.model.body_ipos  # mjlab's bridge of Warp arrays has no types.
    positions[:, trunk] = positions[:, trunk] + drawn * robot.scaled(reach)[:, None]


def inertia_errors(
    members: Sequence[LeggedRobot], source: str = "twins"
) -> dict[str, EventTermCfg]:
    """Configuration of the event that gives every world's robot inertia errors of its own.

    It must follow the event that gives worlds their designs; shifts of the centre of mass may come
    before or after it.

    Args:
        members: the designs, in the order of the worlds.
        source: source of the errors; see `draft.learn.bodies.inertia.extents`.

    Raises:
        DraftError: there is no such source, or a member has other bodies than the first.
    """
    params = {"links": inertia.links(members), "ranges": inertia.extents(source)}
    return {"inertia_errors": EventTermCfg(func=perturb, mode="startup", params=params)}


@requires_model_fields("body_mass", "body_ipos", "body_inertia", recompute=RecomputeLevel.set_const)
def perturb(
    env: ManagerBasedRlEnv,
    env_ids: torch.Tensor | None,
    links: inertia.Links,
    ranges: Mapping[str, inertia.Extent],
) -> None:
    """Change masses, centres of mass and inertias in each world.

    Args:
        env: the environment; its seed determines the population.
        env_ids: ignored: errors are for all worlds, and stay.
        links: links of the designs.
        ranges: ranges of the errors of each group.
    """
    sim, robot = env.sim, robot_of(env)
    seed = env.cfg.seed
    rng = np.random.default_rng(None if seed is None else (STREAM, seed))
    drawn = inertia.draw(ranges, env.num_envs, rng)
    change = inertia.change(links, robot.host_member, drawn)
    prefix = f"{robot.root_body.name.rpartition('/')[0]}/"
    ids = torch.tensor(
        [sim.mj_model.body(prefix + name).id for name in links.names], device=env.device
    )
    mass, moments, shift = (
        torch.as_tensor(values, dtype=torch.float32, device=env.device) for values in change
    )
    model: Any = sim.model  # mjlab's bridge of Warp arrays has no types.
    model.body_mass[:, ids] = model.body_mass[:, ids] * mass
    model.body_inertia[:, ids] = model.body_inertia[:, ids] * moments[..., None]
    model.body_ipos[:, ids] = model.body_ipos[:, ids] + shift
    for name in ("body_mass", "body_inertia", "body_ipos"):
        # mjlab's own randomisation starts from these.
        sim.default_model_fields[name] = getattr(model, name).clone()
        sim.per_world_default_fields.add(name)


class Kind(NamedTuple):
    """Size and frequency of pushes.

    Attributes:
        most: largest push along [m/s], then about [rad/s], the world's x, y and z.
        interval: shortest and longest time between two pushes [s].
        ramp: (iteration, factor of the push).
    """

    most: tuple[Scaled, ...]
    interval: tuple[Scaled, ...]
    ramp: Ramp


# Attributes of terms are part of saved states (see `snapshot`): their names must
# not change while runs that can be resumed exist.
class Pushes:
    """Pushes: a velocity that is added to the trunk, without a transfer from the device.

    Parameters of the term: `kinds` of pushes, one or two; `share` of the worlds that have the
    second one (see `draft.learn.task.mdp.commands.share_of_worlds`); `steps` per iteration.
    """

    def __init__(self, cfg: EventTermCfg, env: ManagerBasedRlEnv) -> None:
        robot = robot_of(env)
        self._env, self._robot = env, robot
        self._params = cfg.params
        two = len(cfg.params["kinds"]) > 1
        self._second = (
            share_of_worlds(cfg.params["share"], env.num_envs, env.device) if two else None
        )
        self.rescale()
        self.time_left = self._draw()

    def rescale(self) -> None:
        """Set sizes and intervals of each world's pushes from the size of its design."""
        robot = self._robot
        most, intervals = [], []
        for kind in self._params["kinds"]:
            most.append(torch.stack([robot.scaled(number) for number in kind.most], dim=1))
            intervals.append(torch.stack([robot.scaled(number) for number in kind.interval], dim=1))
        self._most = self._chosen(most)
        self._low, high = self._chosen(intervals).unbind(1)
        self._span = high - self._low

    def __call__(
        self,
        env: ManagerBasedRlEnv,
        env_ids: torch.Tensor | None,
        kinds: tuple[Kind, ...],
        share: float,
        steps: int,
    ) -> None:
        """Count down, and push the robots whose time has elapsed."""
        self.time_left -= env.step_dt
        due = self.time_left < 1e-6
        self.time_left = torch.where(due, self._draw(), self.time_left)
        now = iteration(env, steps)
        factor: float | torch.Tensor = ramp_at(kinds[0].ramp, now)
        if self._second is not None:
            second = ramp_at(kinds[1].ramp, now)
            factor = torch.where(self._second, second, factor)[:, None]
        drawn = (2 * torch.rand_like(self._most) - 1) * self._most * factor * due[:, None]
        add_velocity(self._robot, drawn)

    def reset(self, env_ids: torch.Tensor | None = None) -> None:
        """Draw the time to the first push."""
        ids = slice(None) if env_ids is None else env_ids
        self.time_left[ids] = self._draw()[ids]

    def _chosen(self, of_kinds: Sequence[torch.Tensor]) -> torch.Tensor:
        """Of values for each kind, those of each world's kind, shape (worlds, ...)."""
        first, *others = of_kinds
        if self._second is None:
            return first
        return others[0].where(self._second[:, None], first)

    def _draw(self) -> torch.Tensor:
        return self._low + self._span * torch.rand_like(self._low)


class Kicks:
    """Kicks of a size for each world, at fixed times.

    Parameters of the term: `most`, largest kick along the world's x and y of each world [m/s];
    `steps`, steps of the environment after which they happen.
    """

    def __init__(self, cfg: EventTermCfg, env: ManagerBasedRlEnv) -> None:
        self._robot = robot_of(env)
        self._most = torch.zeros(env.num_envs, 6, device=env.device)
        self._most[:, :2] = torch.tensor(cfg.params["most"], device=env.device)[:, None]

    def __call__(
        self,
        env: ManagerBasedRlEnv,
        env_ids: torch.Tensor | None,
        most: tuple[float, ...],
        steps: tuple[int, ...],
    ) -> None:
        """Kick all robots after the given steps."""
        if env.common_step_counter in steps:
            add_velocity(self._robot, (2 * torch.rand_like(self._most) - 1) * self._most)


def add_velocity(robot: Robot, velocity: torch.Tensor) -> None:
    """Add to the trunk's velocity.

    Args:
        robot: the robot.
        velocity: linear [m/s] and angular [rad/s], both in the world's axes, shape (worlds, 6).
    """
    state, index = robot.data.data, robot.indexing
    quat = state.qpos[:, index.free_joint_q_adr[3:7]]
    v = index.free_joint_v_adr
    # A free joint's velocity is linear in the world's axes and angular in the body's.
    local = torch.cat((velocity[:, :3], quat_apply_inverse(quat, velocity[:, 3:])), dim=1)
    state.qvel[:, v] = state.qvel[:, v] + local


class PushParams(TypedDict):
    """Parameters of `draft.learn.task.mdp.events.Pushes`."""

    kinds: tuple[Kind, ...]
    share: float
    steps: int


def event_cfgs(task: Task) -> dict[str, EventTermCfg]:
    """Configurations of the events that all stages share, by name, in order: designs first."""
    e, first = task.config.episodes, task.members[0]
    terms = {}
    if len(task.members) > 1:
        terms["designs"] = EventTermCfg(func=assume_designs, mode="startup")
    return terms | {
        "reset_base": EventTermCfg(
            func=envs_mdp.reset_root_state_uniform,
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
            func=envs_mdp.reset_joints_by_offset,
            mode="reset",
            params={"position_range": (-e.joints, e.joints), "velocity_range": (0.0, 0.0)},
        ),
        "foot_friction": EventTermCfg(
            func=envs_mdp.dr.geom_friction,
            mode="startup",
            params={
                "asset_cfg": SceneEntityCfg("robot", geom_names=first.foot_geoms),
                "operation": "abs",
                "ranges": e.friction,
                "shared_random": True,
            },
        ),
        "encoder_bias": EventTermCfg(
            func=envs_mdp.dr.encoder_bias,
            mode="startup",
            params={
                "asset_cfg": SceneEntityCfg("robot"),
                "bias_range": (-e.encoder, e.encoder),
            },
        ),
        "shift_centre": EventTermCfg(
            func=shift_centre, mode="startup", params={"reach": scaled(e, "centre")}
        ),
        **physics_errors(e),
        "push": EventTermCfg(func=Pushes, mode="step", params={**_pushes(task)}),
    }


def _pushes(task: Task) -> PushParams:
    """Parameters of the pushes that all stages share."""
    e = task.config.episodes
    most = (*_each(e, "push_linear"), *_each(e, "push_angular"))
    usual = Kind(most, _each(e, "push_interval"), ((0, 1.0),))
    return {"kinds": (usual,), "share": 0.0, "steps": task.config.learning.steps}


def strong_pushes(config: Config) -> Kind:
    """Pushes of the same size for every design, which grow."""
    p = config.push
    return Kind(tuple(map(Scaled, (*p.linear, *p.angular))), _each(p, "interval"), p.ramp)


def _each(group: Episodes | Pushing, name: str) -> tuple[Scaled, ...]:
    """A tuple of numbers, each with its power of s."""
    power = next(one.metadata["power"] for one in fields(group) if one.name == name)
    return tuple(Scaled(value, power) for value in getattr(group, name))
