"""Runs small enough for a test: few worlds, short iterations, narrow networks."""

from __future__ import annotations

from functools import cache
from typing import Any

from draft.design.references import open_designs
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.task.config import Config
from draft.learn.training.run import Plan

SMALL = {
    "learning.steps": 4,
    "learning.hidden": [16, 16],
    "learning.save_every": 2,
    "observations.map_pitch": 0.1,
    "ground.rows": 4,
    "ground.border": 2.0,
}


@cache
def member(word: str = "cheetah") -> LeggedRobot:
    """Numbers of a shipped design."""
    return legged_robot(open_designs([word])[0])


def plan(*words: str, stage: str = "base", **more: Any) -> Plan:
    """A plan for a few worlds."""
    values = SMALL | more.pop("values", {})
    config = Config().with_values(values)
    members = tuple(member(word) for word in words or ("cheetah",))
    return Plan(members, stage, environments=more.pop("environments", 4), config=config, **more)
