"""Capabilities that bodies have with one trained policy, from roll-outs.

Each body is rolled out at levels of the skill tests `speed` and `push`. The definitions are those
of the evaluation of a run (`scalars`), with fewer and shorter roll-outs, of which only
the last third is measured: fast robots take four seconds to get up to speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError
from draft.learn.bodies.designs import joined
from draft.learn.bodies.legged import LeggedRobot, check_family, legged_robot
from draft.learn.bodies.legged_batch import legged_robots
from draft.learn.measuring.energy import add_energy
from draft.learn.measuring.evaluation import setting
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.heating import add_heat
from draft.learn.measuring.levels import PUSH, SKILL_TESTS, SPEED, SkillTest
from draft.learn.measuring.policies import Source
from draft.learn.measuring.scalars import Worlds, curves, scalars, top_speed
from draft.learn.measuring.utilisation import Histograms, utilisation
from draft.metrics.capabilities import MEASURED
from draft.values import Array

if TYPE_CHECKING:
    from draft.learn.engine.machine import Engine

Report = Callable[[int, int], object]
SPEEDS, KICKS = 6, (2.0, 3.5, 5.0, 6.5, 8.0)  # Number of speeds; kicks [m/s].
LEAD = 1.2  # No robot runs faster than this times its command; 1.1 was measured.
SETTLE = 2 / 3  # Share of a roll-out that is not measured.
MOST_WORLDS = 4096  # Worlds of one simulation, for its memory.
_LIMITS = {"sum": "torque and speed"}
_UPPER = 0.95  # Quantile at the upper end of a 90 % interval.


@dataclass(frozen=True)
class Learned:
    """Capabilities of N bodies; NaN where the roll-outs give none.

    Attributes:
        top_speed: largest median speed at which 80 % stay up [m/s], shape (N,).
        top_speed_error: half of the 90 % interval of the mean speed at that command [m/s], shape
            (N,); NaN for one replica.
        sustained_speed: largest speed that the motors hold for half an hour [m/s], shape (N,).
        kick: kick from which half recover [m/s], shape (N,); the largest level if more do.
        cost_of_transport: electrical power per weight and speed, at top speed, shape (N,); see
            `draft.learn.measuring.energy`.
        limiting: joint class nearest its limit at top speed, and the limit: "knee torque", "knee
            speed", or "knee torque and speed" where neither is near its own limit.
        inside: whether each body is in the policy's region of validity, shape (N,).
    """

    top_speed: Array
    top_speed_error: Array
    sustained_speed: Array
    kick: Array
    cost_of_transport: Array
    limiting: tuple[str, ...]
    inside: NDArray[np.bool_]


NUMBERS = tuple(one.name for one in fields(Learned) if one.name not in ("limiting", "inside"))


def speeds(source: Source) -> tuple[float, ...]:
    """Commanded speeds of a body of the policy's leg length, up to `Source.forward` [m/s]."""
    return tuple(source.forward * (i + 1) / SPEEDS for i in range(SPEEDS))


def measure(
    source: Source,
    members: Sequence[LeggedRobot],
    device: str,
    engine: Engine,
    rollouts: BodyRollOuts,
    report: Report = lambda done, of: None,
) -> Learned:
    """Measure the capabilities of bodies with a policy.

    Args:
        source: the policy.
        members: bodies of one topology.
        device: "cpu" or "cuda:0" and the like.
        engine: physics engine.
        rollouts: numbers of the roll-outs.
        report: called with the bodies done and their number, after every step.

    Raises:
        DraftError: the policy cannot be read or does not drive the bodies, or these have different
            topologies.
    """
    found = [
        of_body(member, worlds, histograms, source.forward_for(member))
        for member, worlds, histograms in roll_outs(
            source, members, device, engine, rollouts, report
        )
    ]
    own = source.drive.features(members)
    return Learned(
        **{name: np.array([one.numbers[name] for one in found]) for name in NUMBERS},
        limiting=tuple(one.limiting for one in found),
        inside=np.array(
            [
                source.drive.includes(member, numbers)
                for member, numbers in zip(members, own, strict=True)
            ]
        ),
    )


def roll_outs(
    source: Source,
    members: Sequence[LeggedRobot],
    device: str,
    engine: Engine,
    rollouts: BodyRollOuts,
    report: Report = lambda done, of: None,
    *,
    tests: Sequence[str] = (SPEED, PUSH),
    common: bool = False,
) -> Iterator[tuple[LeggedRobot, Worlds, Histograms]]:
    """Roll out bodies with a policy, in blocks.

    Args:
        source: the policy.
        members: bodies of one topology.
        device: "cpu" or "cuda:0" and the like.
        engine: physics engine.
        rollouts: numbers of the roll-outs.
        report: called with the bodies done and their number, after every step.
        tests: names of the skill tests.
        common: see `Trial`.

    Yields:
        Each body with a name of its own, and roll-outs with histograms that hold its own.

    Raises:
        DraftError: see `measure`.
    """
    from draft.learn.engine.machine import NATIVE, cores
    from draft.learn.measuring.rollout.evaluate import evaluate
    from draft.learn.measuring.rollout.trial import Trial
    from draft.learn.training.ppo.worlds import task_of

    check_family(members)
    # Most bodies are fastest at one of the upper commands, and need not show what they do at the
    # lower ones.
    levels, below = speeds(source), SPEEDS // 2
    lower = replace(SKILL_TESTS[SPEED], levels=levels[:below])
    upper = replace(SKILL_TESTS[SPEED], levels=levels[below:])
    first = tuple(
        test for test in (upper, replace(SKILL_TESTS[PUSH], levels=KICKS)) if test.name in tests
    )
    policy = source.drive.actor(device)
    threads = cores() if engine.name == NATIVE else 1

    def rolled_out(
        own: tuple[LeggedRobot, ...], chosen: tuple[SkillTest, ...], done: int
    ) -> tuple[Worlds, Histograms]:
        def advance(_: str, step: int, steps: int) -> None:
            # A body has one roll-out, or two: the first counts as half of its time.
            report(done + len(own) * step // (2 * steps), len(members))

        task, count = replace(task_of(source.plan), members=own), rollouts.replicas * len(own)
        settle = SETTLE * rollouts.seconds
        # Each body is asked for the same shares of the fastest command of its size.
        paces = tuple(source.forward_for(member) / source.forward for member in own)
        random = {"seed": rollouts.seed, "common": common}
        trial = Trial(task, chosen, count, rollouts.seconds, settle, **random, paces=paces)
        return evaluate(trial, policy, device, advance, engine=engine.name, threads=threads)

    block = max(1, MOST_WORLDS // (rollouts.replicas * sum(len(one.levels) for one in first)))
    for start in range(0, len(members), block):
        own = joined(members[start : start + block])
        worlds, histograms = rolled_out(own, first, start)
        slow: tuple[LeggedRobot, ...] = ()
        if upper in first:
            enough = LEAD * below / SPEEDS  # Of the fastest command.
            slow = tuple(
                one
                for one in own
                if not _fastest(source, one, worlds) > enough * source.forward_for(one)
            )
        if slow:
            more, counts = rolled_out(slow, (lower,), start + len(own) - len(slow) + len(slow) // 2)
            worlds, histograms = worlds.with_rows(more), histograms.with_groups(counts)
        for member in own:
            yield member, worlds, histograms
        report(start + len(own), len(members))


def _fastest(source: Source, member: LeggedRobot, worlds: Worlds) -> float:
    """Top speed of a body in roll-outs [m/s]; NaN for none."""
    by_test = curves(worlds.of((worlds.member == member.name) & (worlds.test == SPEED)))
    best = top_speed(by_test[SPEED], source.forward_for(member))
    return math.nan if best is None else best[0]


def of_designs(
    source: Source,
    design: Design,
    rollouts: BodyRollOuts,
    rows: NDArray[np.intp] | None = None,
    *,
    device: str = "auto",
    engine: str = "auto",
    report: Report = lambda done, of: None,
) -> tuple[Learned, dict[int, str]]:
    """Measure the capabilities of one design or of N.

    Args:
        source: the policy.
        design: one design, or N.
        rollouts: numbers of the roll-outs.
        rows: which of N designs, increasing; None for those that the filter accepts.
        device: see `draft.learn.engine.machine.devices`.
        engine: "auto", "native" or "warp".
        report: called with the designs done and their number.

    Returns:
        Capabilities, shape (N,), or (1,) for one design, NaN for designs that are not measured; and
        by row the reasons why accepted ones cannot walk.

    Raises:
        DraftError: the policy cannot be read or does not drive the robot, one design cannot walk,
            or mjlab is missing.
    """
    count = design.count or 1
    members, reasons = walkers(source, design, rows)
    if not members:
        return _spread(None, members, count), reasons
    report(0, len(members))  # The libraries of the simulation take seconds to load.
    chosen, stepper = setting(device, engine)
    found = measure(source, tuple(members.values()), chosen, stepper, rollouts, report)
    return _spread(found, members, count), reasons


def walkers(
    source: Source, design: Design, rows: NDArray[np.intp] | None
) -> tuple[dict[int, LeggedRobot], dict[int, str]]:
    """Accepted robots by row, and the reasons why others cannot walk with a policy.

    Raises:
        DraftError: a single design cannot.
    """
    if design.count is None:
        if not design.accepted:
            return {}, {}
        alone = legged_robot(design)
        source.drive.check(alone)
        return {0: alone}, {}
    accepted = np.flatnonzero(np.broadcast_to(np.asarray(design.accepted), design.count))
    members: dict[int, LeggedRobot] = {}
    reasons: dict[int, str] = {}
    chosen = accepted if rows is None else np.intersect1d(accepted, rows)
    for row, one in legged_robots(design, chosen).items():
        try:
            if isinstance(one, DraftError):
                raise one
            source.drive.check(one)
            members[row] = one
        except DraftError as error:
            reasons[row] = error.problems[0].cause
    return members, reasons


def _spread(found: Learned | None, rows: Iterable[int], count: int) -> Learned:
    """Capabilities of N designs from those of the measured rows; None for none."""
    wide = {name: np.full(count, np.nan) for name in NUMBERS}
    limiting, inside = [""] * count, np.zeros(count, dtype=bool)
    if found is not None:
        at = np.array([*rows], dtype=np.intp)
        for name, values in wide.items():
            values[at] = getattr(found, name)
        for row, text in zip(at.tolist(), found.limiting, strict=True):
            limiting[row] = text
        inside[at] = found.inside
    return Learned(**wide, limiting=tuple(limiting), inside=inside)


@dataclass(frozen=True)
class OfBody:
    """Capabilities of one body.

    Attributes:
        numbers: by name; NaN where the roll-outs give none.
        limiting: see `Learned`.
    """

    numbers: dict[str, float]
    limiting: str


def of_body(member: LeggedRobot, worlds: Worlds, histograms: Histograms, trained: float) -> OfBody:
    """Capabilities of one body.

    Args:
        member: the body.
        worlds: roll-outs of the skill tests `speed` and `push`, or of one of them.
        histograms: those of the same roll-outs.
        trained: fastest command of the training [m/s].
    """
    own = worlds.of(worlds.member == member.name)
    by_test = curves(own)
    add_energy(by_test, member)
    add_heat(by_test, histograms, member)
    values = scalars(by_test, member.leg_length, trained).values
    level, error = values.get("peak_command"), math.nan
    if level is not None:
        error = _error(own.of((own.test == SPEED) & ~own.fell).at(level).speed)
    limit = utilisation(histograms, by_test, values, member.name)["limiting"].get(SPEED)
    return OfBody(
        numbers={name: _number(values.get(name)) for name in MEASURED} | {"top_speed_error": error},
        limiting=f"{limit['joint']} {_LIMITS.get(limit['by'], limit['by'])}" if limit else "",
    )


def _error(values: Array) -> float:
    """Half of the 90 % interval of the mean of n values, by Student's t; NaN for one value."""
    n = len(values)
    if n < 2:
        return math.nan
    from scipy.stats import t

    return float(t.ppf(_UPPER, n - 1) * np.std(values, ddof=1)) / math.sqrt(n)


def _number(value: float | None) -> float:
    return math.nan if value is None else value
