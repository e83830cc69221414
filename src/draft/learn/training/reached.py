"""Difficulty that a training had reached, as far as it is recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from draft.learn.policy.reduced import open_for
from draft.learn.task.stages import is_like
from draft.learn.training.progress import PROGRESS, fastest

if TYPE_CHECKING:
    from draft.learn.training.run import Run


@dataclass(frozen=True)
class Reached:
    """Difficulty that a training had reached by a checkpoint, as far as it is recorded.

    Attributes:
        row: hardest row of stairs that a robot was on; None if it is not recorded.
        fastest: largest |vx| that was commanded [m/s]; None if it follows a ramp.
    """

    row: float | None = None
    fastest: float | None = None


UNRECORDED = Reached()


def commanded(run: Run, iteration: float = math.inf) -> float | None:
    """Largest |vx| that the policy of a run of stage `velocity` was commanded [m/s].

    Speeds that an exported policy of that stage, from which the run started, was commanded count
    too, at the size of the run's robot: the run begins with slow ones again. None if none is
    recorded.
    """
    origin, found = run.plan.origin, [fastest(run.folder / PROGRESS, iteration) or 0.0]
    file = origin.policy_file if origin is not None else None
    if file is not None and file.is_file():
        policy, own = open_for(file, run.plan.members), run.plan.members
        length = sum(member.leg_length for member in own) / len(own)
        size = math.sqrt(length / policy.leg_length)  # Commands grow so with the leg length.
        found.append(policy.forward * size if is_like(policy.stage, run.plan.stage) else 0.0)
    return max(found) or None
