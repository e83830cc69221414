"""Effects of the numbers of a design on what it does with a policy, from roll-outs.

The design and each step of each number are bodies of one simulation, with the same noise, starts
and kicks. An effect has a 95 % interval, from replicas that are drawn anew for all bodies alike.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError, counted, listed
from draft.explore.settings import EffectSettings
from draft.learn.bodies.legged import legged_robot
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.paired_metrics import Paired, paired
from draft.learn.measuring.policies import Source, source_for
from draft.values import Array, Value

_TWO_SIDED = 0.975


@dataclass(frozen=True)
class LearnedEffects:
    """Effects on M learned metrics of a step more and a step less of P numbers.

    Attributes:
        base: metrics of the design, shape (M,).
        change: change by a step more and less, shape (2, P, M); NaN for a body that is not measured
            or has no value.
        low, high: ends of its 95 % interval, shape (2, P, M).
        notes: what is to be known of them.
    """

    base: Array
    change: Array
    low: Array
    high: Array
    notes: tuple[str, ...]


def learned_effects(
    design: Design,
    numbers: Mapping[str, float],
    steps: Array,
    known: NDArray[np.bool_],
    names: Sequence[str],
    seed: int,
    settings: EffectSettings,
) -> LearnedEffects:
    """Roll out a design and a step more and less of each number.

    Args:
        design: one design.
        numbers: the P numbers, with their values.
        steps: step of each, shape (P,).
        known: whether a step more and less is within the ranges, shape (2, P).
        names: the metrics.
        seed: seed of the roll-outs.
        settings: policy and numbers of the roll-outs.

    Raises:
        DraftError: the filter refuses the design, the policy does not drive it, it has no value of
            a metric, or the extra `learn` is not installed.
    """
    source = open_policy(design, settings)
    values = np.array(list(numbers.values()))
    count = len(values)
    rows = np.tile(values, (1 + 2 * count, 1))
    rows[1 + np.arange(count), np.arange(count)] += steps
    rows[1 + count + np.arange(count), np.arange(count)] -= steps
    rows = np.where(np.concatenate([[True], known.ravel()])[:, None], rows, values)
    arrays: dict[str, Value] = {name: rows[:, i] for i, name in enumerate(numbers)}
    many = design.spec.resolve(design.values, arrays)
    measured = np.flatnonzero(np.concatenate([[True], known.ravel()]))
    rollouts = BodyRollOuts.of({"replicas": settings.replicas, "seed": seed})
    found = paired(source, many, names, rollouts, settings.progress or silent, measured)
    table = np.array([found.values[name] for name in names])  # (M, 1 + 2P)
    resampled = np.array([found.resampled[name] for name in names])
    for name, value in zip(names, table[:, 0], strict=True):
        if np.isnan(value):
            cause = f"{design.reference} has no {name}: it falls, or the roll-outs give none"
            raise DraftError(cause, "omit the metric, or raise `replicas`")
    apart = resampled - resampled[:, :, :1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # Of bodies that are not measured.
        half = quantile(settings.replicas, _TWO_SIDED) * np.nanstd(apart, axis=1)
    change = table - table[:, :1]

    def sides(of: Array) -> Array:
        return of[:, 1:].reshape(len(names), 2, count).transpose(1, 2, 0)

    half = np.where(np.isnan(change), np.nan, half)
    notes = _notes(source, found, [*numbers], settings.replicas)
    return LearnedEffects(
        table[:, 0], sides(change), sides(change - half), sides(change + half), notes
    )


def open_policy(design: Design, settings: EffectSettings) -> Source:
    """Open the policy that drives a design.

    Raises:
        DraftError: the filter refuses the design, or the policy does not drive it.
    """
    if not design.accepted:
        cause = f"{design.reference} is refused, and learned metrics are of accepted designs"
        raise DraftError(cause, "see `draft check`, or omit the learned metrics")
    source = source_for(settings.policy, design)
    source.drive.check(legged_robot(design))
    return source


def quantile(replicas: int, share: float) -> float:
    """Quantile of Student's t for a number of roll-outs."""
    from scipy.stats import t

    return float(t.ppf(share, replicas - 1))


def silent(done: int, of: int) -> None:
    """Report nothing."""


def _notes(source: Source, found: Paired, names: Sequence[str], replicas: int) -> tuple[str, ...]:
    """Sentences on the roll-outs, the region of the policy, its commands, and what has none."""
    labels = [f"{name} {sign}" for sign in ("up", "down") for name in names]
    base, *_ = found.members.values()
    notes = [
        f"learned metrics: {counted(found.rollouts, 'roll-out')} of {len(found.members)} bodies, "
        f"{replicas} at each speed or kick, with the same noise, starts and kicks; 95 % intervals"
    ]
    if text := source.warning(base):
        notes.append(f"the learned metrics are of a design {text}")
    moved = {labels[row - 1]: one for row, one in found.members.items() if row}
    outside = [] if text else [name for name, one in moved.items() if source.warning(one)]
    if outside:
        notes.append(f"outside the region of the policy after a step of: {listed(outside, 6)}")
    notes += [f"{labels[row - 1]}: {reason}" for row, reason in found.reasons.items() if row]
    return tuple(notes)
