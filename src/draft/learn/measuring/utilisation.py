"""Utilisation of joints: torque, speed and their sum as shares of their limits.

The sum is that of speed over no-load speed and torque over stall torque, which is 1 on the falling
line of torque over speed.

Samples are counted in bins of 0.005 of the limit. Bin i holds shares above 0.005 i and up to
0.005 (i + 1); the last bin all above 1.6. Torque and speed are also counted jointly, in cells of
0.04 of both limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from typing_extensions import TypedDict  # pydantic cannot read that of typing before 3.12

from draft.learn.measuring.levels import ASCENT, DESCENT, PUSH, SPEED, WALK
from draft.learn.measuring.scalars import Curve

QUANTITIES = ("torque", "speed", "sum")
WIDTH = 0.005
BINS = 321
CELL = 0.04
CELLS = 41
NEAR = 0.9  # Share of a limit from which a joint counts as near it.
PERCENTILE = 0.95


@dataclass(frozen=True)
class Histograms:
    """Histograms of roll-outs that did not fall.

    Attributes:
        test, level, member: labels of each group, shape (groups,).
        counts: samples per bin, shape (groups, joint classes, quantities, bins).
        plane: samples per cell of torque and speed, shape (groups, joint classes, cells, cells).
        classes: names of the joint classes.
    """

    test: np.ndarray
    level: np.ndarray
    member: np.ndarray
    counts: np.ndarray
    plane: np.ndarray
    classes: tuple[str, ...]

    def with_groups(self, *others: Histograms) -> Histograms:
        """Append the groups of others, of the same joint classes."""
        names = ("test", "level", "member", "counts", "plane")
        parts = (self, *others)
        joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        return Histograms(**joined, classes=self.classes)

    def of(self, rows: np.ndarray) -> Histograms:
        """Select groups.

        Args:
            rows: their indices.
        """
        names = ("test", "level", "member", "counts", "plane")
        return Histograms(**{n: getattr(self, n)[rows] for n in names}, classes=self.classes)

    def pooled(self, test: str, level: float, member: str | None = None) -> np.ndarray:
        """Sum the counts at a level, shape (classes, quantities, bins).

        Args:
            test: name of the test.
            level: level of the test.
            member: name of one design; None for all.
        """
        rows = (self.test == test) & np.isclose(self.level, level, rtol=0.0, atol=1e-9)
        if member is not None:
            rows &= self.member == member
        return self.counts[rows].sum(0)


def percentile(counts: np.ndarray, share: float = PERCENTILE) -> float | None:
    """Value that a share of the samples does not exceed, linear within a bin.

    Args:
        counts: samples per bin, shape (bins,).
        share: share of the samples.

    Returns:
        Share of the limit, at most the lower edge of the last bin; None without samples.
    """
    total = counts.sum()
    if not total:
        return None
    wanted = share * total
    summed = np.cumsum(counts)
    i = int(np.searchsorted(summed, wanted))
    if i >= BINS - 1:
        return (BINS - 1) * WIDTH
    before = summed[i] - counts[i]
    return float((i + (wanted - before) / counts[i]) * WIDTH)


def near_peak(counts: np.ndarray) -> float | None:
    """Share of the samples of torque that are near the peak; None without samples."""
    total = counts.sum()
    return float(counts[round(NEAR / WIDTH) :].sum() / total) if total else None


class Limiting(TypedDict):
    """Joint class nearest its limit.

    Attributes:
        joint: name of the class.
        by: limiting quantity, one of QUANTITIES.
        value: 95th percentile of that quantity, as a share of its limit.
    """

    joint: str
    by: str
    value: float | None


class Utilisation(TypedDict):
    """Utilisation by skill test.

    Attributes:
        utilisation: 95th percentiles by test, joint class and quantity, as shares of limits.
        utilisation_level: level at which they are taken, by test.
        limiting: joint class nearest its limit, by test.
    """

    utilisation: dict[str, dict[str, dict[str, float | None]]]
    utilisation_level: dict[str, float]
    limiting: dict[str, Limiting]


def utilisation(
    histograms: Histograms,
    curves: Mapping[str, Curve],
    values: Mapping[str, float | None],
    member: str | None = None,
) -> Utilisation:
    """Compute utilisation and limiting joint class of each skill test.

    The level is the peak command for speed, the tallest step traversed for stairs, the last level
    that half or more recover from for push, and the only level for walk. A test without such a
    level, or without samples at it, is omitted.

    Args:
        histograms: histograms of the samples.
        curves: curves by test from `draft.learn.measuring.scalars.curves`.
        values: the scalars.
        member: name of one design; None for all.
    """
    result: Utilisation = {"utilisation": {}, "utilisation_level": {}, "limiting": {}}
    for test, curve in curves.items():
        level = _level(test, curve, values)
        if level is None:
            continue
        counts = histograms.pooled(test, level, member)
        if not counts.any():
            continue
        shares = {name: _shares(counts[i]) for i, name in enumerate(histograms.classes)}
        result["utilisation"][test] = shares
        result["utilisation_level"][test] = level
        result["limiting"][test] = limiting(shares)
    return result


def limiting(shares: Mapping[str, Mapping[str, float | None]]) -> Limiting:
    """Return the joint class nearest its limit, and the limiting quantity.

    The class is that with the largest 95th percentile of the sum, which is 1 on the torque-speed
    line. It is limited by torque or by speed if that quantity is within a tenth of its limit, and
    by their sum otherwise.

    Args:
        shares: 95th percentiles by class and quantity, as shares of limits.
    """
    joint = max(shares, key=lambda name: shares[name]["sum"] or 0.0)
    of = shares[joint]
    alone = max(("torque", "speed"), key=lambda name: of[name] or 0.0)
    by = alone if (of[alone] or 0.0) >= NEAR else "sum"
    return {"joint": joint, "by": by, "value": of[by]}


def _level(test: str, curve: Curve, values: Mapping[str, float | None]) -> float | None:
    """Level at which a test's utilisation is taken; None if its scalar has no value."""
    if test == WALK:
        return curve["levels"][0]
    names = {SPEED: "peak_command", ASCENT: "step_ascent", DESCENT: "step_descent", PUSH: "kick"}
    value = values.get(names[test])
    if value is None or test != PUSH:
        return value
    return max(level for level in curve["levels"] if level <= value + 1e-9)


def _shares(counts: np.ndarray) -> dict[str, float | None]:
    """Percentiles of a class, counts of shape (quantities, bins)."""
    shares = {name: percentile(counts[i]) for i, name in enumerate(QUANTITIES)}
    return shares | {"near_peak": near_peak(counts[0])}
