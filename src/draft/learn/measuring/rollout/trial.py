"""Settings of an evaluation in mjlab, and the assignment of its worlds.

Each world belongs to one skill test, level, replica and member. Members alternate from world to
world, as in training.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from mjlab.managers.event_manager import EventTermCfg

from draft.learn.bodies.payload import with_payload
from draft.learn.measuring.conditions import with_conditions
from draft.learn.measuring.levels import FORWARD_LEAST, SPEED, STANDING, SkillTest
from draft.learn.measuring.summary import Request
from draft.learn.task.mdp.events import inertia_errors
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.worlds import task_of
from draft.learn.training.run import Run


@dataclass(frozen=True)
class Trial:
    """Settings of an evaluation.

    Attributes:
        task: robots and numbers; the skill tests determine the ground.
        tests: skill tests with their levels.
        replicas: roll-outs of each level, divided equally among the members and rounded up.
        seconds: duration of a roll-out [s].
        settle: time at its start that is not measured [s].
        published: whether some robots stand and some are commanded at least 0.3 m/s, as in the
            released code of the paper.
        seed: seed of everything random.
        common: whether all designs and levels have the same random numbers, by replica, and
            histograms are those of single roll-outs, in the order of the worlds.
        paces: factors on the commanded speeds of the skill test `speed`, one for each member; ()
            for the same commands.
        extra: events at the start, in addition to those of training, and before them.
    """

    task: Task
    tests: tuple[SkillTest, ...]
    replicas: int
    seconds: float
    settle: float
    published: bool = False
    seed: int = 0
    common: bool = False
    paces: tuple[float, ...] = ()
    extra: Mapping[str, EventTermCfg] = field(default_factory=dict)

    @property
    def each(self) -> int:
        """Replicas of each member."""
        return -(-self.replicas // len(self.task.members))


@dataclass(frozen=True)
class Layout:
    """Assignment of the worlds, one row per world.

    Attributes:
        test, level, member, replica, kept: see `draft.learn.measuring.scalars.Worlds`.
        command: commanded forward speed [m/s].
        kick: largest kick along x and y [m/s].
        ground: see `SkillTest.ground`.
    """

    test: np.ndarray
    level: np.ndarray
    member: np.ndarray
    replica: np.ndarray
    kept: np.ndarray
    command: np.ndarray
    kick: np.ndarray
    ground: np.ndarray


def layout(trial: Trial, tests: Sequence[SkillTest]) -> Layout:
    """Assign the worlds of a simulation, ordered by test, level, replica and member."""
    names = [member.name for member in trial.task.members]
    size = trial.each * len(names)
    levels = [(test, level) for test in tests for level in test.levels]

    def of_levels(values: Sequence[str | float]) -> np.ndarray:
        return np.repeat(np.array(values), size)

    paces = np.tile(np.array(trial.paces or [1.0] * len(names)), len(levels) * trial.each)
    paces = np.where(of_levels([test.name == SPEED for test, _ in levels]), paces, 1.0)
    command = of_levels([test.command(level) for test, level in levels]) * paces
    kept = np.ones(len(command), dtype=bool)
    if trial.published:
        drawn = np.random.default_rng(trial.seed).random((2, len(command)))
        kept = drawn[0] >= STANDING
        ahead = drawn[1] < trial.task.config.commands.forward_only
        command = np.where(ahead, np.maximum(command, FORWARD_LEAST), command) * kept
    return Layout(
        test=of_levels([test.name for test, _ in levels]),
        level=of_levels([level for _, level in levels]) * paces,
        member=np.tile(np.array(names), len(levels) * trial.each),
        replica=np.tile(np.repeat(np.arange(trial.each), len(names)), len(levels)),
        kept=kept,
        command=command,
        kick=of_levels([test.kick(level) for test, level in levels]),
        ground=of_levels([test.ground for test, _ in levels]),
    )


def trial(run: Run, tests: Sequence[SkillTest], request: Request) -> Trial:
    """Return the settings of an evaluation of a run's policy.

    Args:
        run: the run.
        tests: skill tests with their levels.
        request: everything that determines the result.

    Raises:
        DraftError: inertia errors are requested, and cannot be drawn for its designs; or the
            physics that is asked for is impossible, see `with_conditions`.
    """
    extra: Mapping[str, EventTermCfg] = {}
    if request.errors is not None:
        extra = inertia_errors(run.plan.members, request.errors)
    return Trial(
        task=replace(
            task_of(run.plan),
            members=with_payload(run.plan.members, request.payload),
            config=with_conditions(run.plan.config, request),
        ),
        tests=tuple(tests),
        replicas=request.replicas,
        seconds=request.seconds,
        settle=request.settle,
        published=request.protocol == "published",
        seed=request.evaluation_seed,
        extra=extra,
    )
