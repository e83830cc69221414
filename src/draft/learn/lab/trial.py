"""What a policy is put through in an evaluation, and what each world is for.

World w belongs to one battery, level, replica and member. Members alternate from world to world,
as in training.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mjlab.managers.event_manager import EventTermCfg

from draft.learn.battery import FORWARD_LEAST, REPLICAS, SECONDS, SETTLE, STANDING, Battery
from draft.learn.lab.env_cfg import Task
from draft.learn.lab.trainer import task_of
from draft.learn.results import Asked
from draft.learn.run import Run


@dataclass(frozen=True)
class Trial:
    """What a policy is put through.

    Attributes:
        task: the robots and the numbers; the ground is the batteries'.
        batteries: what is asked.
        replicas: roll-outs of each level; they are shared out among the members, each of which
            has as many, so there may be a few more.
        published: as the released code: some stand, some get 0.3 m/s at least.
        seed: of everything random.
        seconds: of a roll-out [s].
        settle: what does not count of it [s].
        extra: events at the start, besides those of training; they come before those.
    """

    task: Task
    batteries: tuple[Battery, ...]
    replicas: int = REPLICAS
    published: bool = False
    seed: int = 0
    seconds: float = SECONDS
    settle: float = SETTLE
    extra: Mapping[str, EventTermCfg] = field(default_factory=dict)

    @property
    def each(self) -> int:
        """Replicas of each member."""
        return -(-self.replicas // len(self.task.members))


@dataclass(frozen=True)
class Layout:
    """What each world is, one row per world.

    Attributes:
        battery, level, member, replica, kept: as of `scalars.Worlds`.
        command: forward [m/s].
        kick: largest along x and y [m/s].
        ground: of `Battery.ground`.
    """

    battery: np.ndarray
    level: np.ndarray
    member: np.ndarray
    replica: np.ndarray
    kept: np.ndarray
    command: np.ndarray
    kick: np.ndarray
    ground: np.ndarray


def layout(trial: Trial, batteries: Sequence[Battery]) -> Layout:
    """What each world of a simulation is: battery, then level, replica and member."""
    names = [member.name for member in trial.task.members]
    size = trial.each * len(names)
    rungs = [(battery, level) for battery in batteries for level in battery.levels]

    def of_rungs(values: list[Any]) -> np.ndarray:
        return np.repeat(np.array(values), size)

    command = of_rungs([battery.command(level) for battery, level in rungs])
    kept = np.ones(len(command), dtype=bool)
    if trial.published:
        drawn = np.random.default_rng(trial.seed).random((2, len(command)))
        kept = drawn[0] >= STANDING
        ahead = drawn[1] < trial.task.config.commands.forward_only
        command = np.where(ahead, np.maximum(command, FORWARD_LEAST), command) * kept
    return Layout(
        battery=of_rungs([battery.name for battery, _ in rungs]),
        level=of_rungs([level for _, level in rungs]),
        member=np.tile(np.array(names), len(rungs) * trial.each),
        replica=np.tile(np.repeat(np.arange(trial.each), len(names)), len(rungs)),
        kept=kept,
        command=command,
        kick=of_rungs([battery.kick(level) for battery, level in rungs]),
        ground=of_rungs([battery.ground for battery, _ in rungs]),
    )


def trial(run: Run, batteries: Sequence[Battery], what: Asked) -> Trial:
    """What a run's policy is put through.

    Args:
        run: the run.
        batteries: with their levels.
        what: is asked.

    Raises:
        DraftError: inertia errors are asked for, and cannot be drawn for its designs.
    """
    extra: Mapping[str, EventTermCfg] = {}
    if what.errors is not None:
        from draft.learn.lab.mdp.events import inertia_errors

        extra = inertia_errors(run.plan.members, what.errors)
    return Trial(
        task=task_of(run.plan),
        batteries=tuple(batteries),
        replicas=what.replicas,
        published=what.protocol == "published",
        seed=what.evaluation_seed,
        seconds=what.seconds,
        settle=what.settle,
        extra=extra,
    )
