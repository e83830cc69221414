"""Metrics of bodies by the same random numbers, with roll-outs drawn anew to judge differences.

All bodies have the noise, starts, errors and kicks of each replica in common, so that most of what
chance does cancels between them. What it leaves is estimated by a bootstrap: replicas are drawn
with replacement, the same for all bodies.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.measuring.evaluation import setting
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.learned_metrics import of_body, roll_outs, walkers
from draft.learn.measuring.levels import PUSH, SPEED
from draft.learn.measuring.policies import Source
from draft.metrics.learned import PREFIX
from draft.values import Array

RESAMPLES = 64
_INSIDE = "inside"


@dataclass(frozen=True)
class Paired:
    """Metrics of N designs.

    Attributes:
        values: each metric by name, shape (N,); NaN for a design that has none.
        resampled: the same for replicas drawn with replacement, shape (RESAMPLES, N).
        members: robots that were rolled out, by row.
        reasons: reasons why accepted designs cannot walk, by row.
        rollouts: roll-outs in all.
    """

    values: dict[str, Array]
    resampled: dict[str, Array]
    members: dict[int, LeggedRobot]
    reasons: dict[int, str]
    rollouts: int


def paired(
    source: Source,
    design: Design,
    names: Sequence[str],
    rollouts: BodyRollOuts,
    report: Callable[[int, int], object] = lambda done, of: None,
    rows: NDArray[np.intp] | None = None,
) -> Paired:
    """Measure N designs by the same random numbers, outside the policy's region too.

    Args:
        source: the policy.
        design: N designs.
        names: metrics in `LEARNED`.
        rollouts: numbers of the roll-outs.
        report: called with the designs done and their number.
        rows: designs to measure, increasing; None for those that the filter accepts.

    Raises:
        DraftError: the policy does not drive the robot, or mjlab is missing.
    """
    count, short = design.count or 1, [name.removeprefix(PREFIX) for name in names]
    members, reasons = walkers(source, design, rows)
    values = {name: np.full(count, np.nan) for name in names}
    resampled = {name: np.full((RESAMPLES, count), np.nan) for name in names}
    done = 0
    if members and {*short} - {_INSIDE}:
        report(0, len(members))  # The libraries of the simulation take seconds to load.
        tests = [SPEED] * bool({*short} - {"kick", _INSIDE}) + [PUSH] * ("kick" in short)
        drawn = np.random.default_rng(rollouts.seed).integers(
            rollouts.replicas, size=(RESAMPLES, rollouts.replicas)
        )
        rolled = roll_outs(
            source,
            tuple(members.values()),
            *setting("auto", "auto"),
            rollouts,
            report,
            tests=tests,
            common=True,
        )
        for row, (member, worlds, histograms) in zip(members, rolled, strict=True):
            own = np.flatnonzero(worlds.member == member.name)
            done += len(own)
            of_replica = own.reshape(-1, rollouts.replicas).T
            trained = source.forward_for(member)
            for k, chosen in enumerate((np.arange(rollouts.replicas), *drawn)):
                at = of_replica[chosen].ravel()
                found = of_body(member, worlds.of(at), histograms.of(at), trained).numbers
                for name, one in zip(names, short, strict=True):
                    target = resampled[name][k - 1 : k] if k else values[name][None]
                    target[:, row] = found.get(one, np.nan)
    if _INSIDE in short:
        inside = np.zeros(count)
        known = source.drive.features([*members.values()]) if members else ()
        for (row, member), own in zip(members.items(), known, strict=True):
            inside[row] = source.drive.includes(member, own)
        values[PREFIX + _INSIDE] = inside
        resampled[PREFIX + _INSIDE] = np.tile(inside, (RESAMPLES, 1))
    return Paired(values, resampled, members, reasons, done)
