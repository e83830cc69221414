"""Events of a stage: designs, resets, errors of the robots, and pushes."""

from __future__ import annotations

from dataclasses import fields
from typing import TypedDict

from mjlab.envs import mdp as envs_mdp
from mjlab.managers.event_manager import EventTermCfg
from mjlab.managers.scene_entity_config import SceneEntityCfg

from draft.learn.engine.worlds.family import assume_designs
from draft.learn.task.cfg.task import Task
from draft.learn.task.constants import Scaled, scaled
from draft.learn.task.groups import Episodes, Pushing
from draft.learn.task.mdp import events


class PushParams(TypedDict):
    """Parameters of `draft.learn.task.mdp.events.Pushes`."""

    kinds: tuple[events.Kind, ...]
    share: float
    steps: int


def event_cfgs(task: Task, play: bool) -> dict[str, EventTermCfg]:
    """Configurations of the events of a stage, by name, in order: designs first.

    Args:
        task: the task.
        play: whether the environment is for watching: no errors of the robots, no pushes.
    """
    e, first = task.config.episodes, task.members[0]
    terms = {}
    if len(task.members) > 1:
        terms["designs"] = EventTermCfg(func=assume_designs, mode="startup")
    terms |= {
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
    }
    if play:
        return terms
    return terms | {
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
            func=events.shift_centre, mode="startup", params={"reach": scaled(e, "centre")}
        ),
        "push": EventTermCfg(func=events.Pushes, mode="step", params={**_pushes(task)}),
    }


def _pushes(task: Task) -> PushParams:
    """Parameters of the pushes of a stage."""
    e, p = task.config.episodes, task.config.push
    most = (*_each(e, "push_linear"), *_each(e, "push_angular"))
    usual = events.Kind(most, _each(e, "push_interval"), ((0, 1.0),))
    most = tuple(map(Scaled, (*p.linear, *p.angular)))
    strong = events.Kind(most, _each(p, "interval"), p.ramp)
    share = task.config.velocity.pushed if task.stage == "velocity" else 0.0
    kinds = (strong,) if task.stage == "push" else (usual, strong) if share else (usual,)
    return {"kinds": kinds, "share": share, "steps": task.config.learning.steps}


def _each(group: Episodes | Pushing, name: str) -> tuple[Scaled, ...]:
    """A tuple of numbers, each with its power of s."""
    power = next(one.metadata["power"] for one in fields(group) if one.name == name)
    return tuple(Scaled(value, power) for value in getattr(group, name))
