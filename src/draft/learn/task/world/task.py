"""Robots, stage and numbers that an environment is made for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.task.config import Config

GroundKind = Literal["uneven", "flat"]


@dataclass(frozen=True)
class Task:
    """Robots, stage and numbers that an environment is made for.

    Attributes:
        members: one quadruped, or several of one topology.
        stage: one of `draft.learn.task.stages.STAGES`.
        config: the numbers.
        ground: "uneven", or "flat" for a plane.
        see_design: whether the policy observes the features of its design.
        see_ground: whether the policy observes the height scan.
        seed: seed of everything random.
        by_slots: whether the features of a design are those of the slots of all legs, for a policy
            of several topologies.
    """

    members: tuple[LeggedRobot, ...]
    stage: str = "base"
    config: Config = field(default_factory=Config)
    ground: GroundKind = "uneven"
    see_design: bool = False
    see_ground: bool = True
    seed: int = 0
    by_slots: bool = False
