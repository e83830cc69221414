"""What an environment is about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from draft.learn.config import Config
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
        see_ground: the policy sees the height scan, wherever it stands.
        seed: of everything random.
    """

    members: tuple[Quadruped, ...]
    stage: str = "base"
    config: Config = Config()
    ground: GroundKind = "uneven"
    see_design: bool = False
    see_ground: bool = True
    seed: int = 0
