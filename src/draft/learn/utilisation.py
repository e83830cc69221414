"""How near joints come to their limits: shares of torque, of speed, and of their sum.

Samples are counted in bins of 0.005 of the limit, so that a million of them take no more room
than one. Bin i holds shares above 0.005 i and up to 0.005 (i + 1); the last one all above 1.6.
Torque and speed are also counted together, in cells of 0.04 of both limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from draft.learn.battery import ASCENT, DESCENT, PUSH, SPEED, WALK

QUANTITIES = ("torque", "speed", "sum")
WIDTH = 0.005
BINS = 321
CELL = 0.04
CELLS = 41
NEAR = 0.9  # Of the peak torque.
PERCENTILE = 0.95


@dataclass(frozen=True)
class Histograms:
    """Counted samples of roll-outs that did not fall.

    Attributes:
        battery, level, member: of each group.
        counts: shape (groups, joint classes, quantities, bins).
        plane: by torque and speed at once, shape (groups, joint classes, cells, cells).
        classes: names of the joint classes.
    """

    battery: np.ndarray
    level: np.ndarray
    member: np.ndarray
    counts: np.ndarray
    plane: np.ndarray
    classes: tuple[str, ...]

    def pooled(self, battery: str, level: float, member: str | None = None) -> np.ndarray:
        """Counts at a level, shape (classes, quantities, bins).

        Args:
            battery: its name.
            level: of the battery.
            member: of one design; of all where None.
        """
        rows = (self.battery == battery) & np.isclose(self.level, level, rtol=0.0, atol=1e-9)
        if member is not None:
            rows &= self.member == member
        return self.counts[rows].sum(0)


def percentile(counts: np.ndarray, share: float = PERCENTILE) -> float | None:
    """Value that a share of the samples does not exceed, linear within a bin; None of none.

    Args:
        counts: of samples by bin, shape (bins,).
        share: of the samples.

    Returns:
        Of the limit; where it falls into the last bin, where that begins.
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


def above(counts: np.ndarray, limit: float = NEAR) -> float | None:
    """Share of the samples above a bin's edge; None of no samples."""
    total = counts.sum()
    return float(counts[round(limit / WIDTH) :].sum() / total) if total else None


def utilisation(
    found: Histograms,
    curves: Mapping[str, Mapping[str, Any]],
    values: Mapping[str, float | None],
    member: str | None = None,
) -> dict[str, Any]:
    """Utilisation and limiting joint of each battery, as plain data.

    Speed is taken at the peak command, stairs at the tallest step traversed, push at the last
    level that half or more recover from, walk at its only level.

    Args:
        found: counted samples.
        curves: of `scalars.curves`.
        values: the scalars.
        member: of one design; of all where None.

    Returns:
        `utilisation`, `utilisation_level` and `limiting`, each by battery; a battery without such
        a level, or without samples at it, is left out.
    """
    made: dict[str, Any] = {"utilisation": {}, "utilisation_level": {}, "limiting": {}}
    for battery, curve in curves.items():
        level = _level(battery, curve, values)
        if level is None:
            continue
        counts = found.pooled(battery, level, member)
        if not counts.any():
            continue
        shares = {name: _shares(counts[i]) for i, name in enumerate(found.classes)}
        made["utilisation"][battery] = shares
        made["utilisation_level"][battery] = level
        made["limiting"][battery] = limiting(shares)
    return made


def limiting(shares: Mapping[str, Mapping[str, float | None]]) -> dict[str, Any]:
    """The joint class nearest its limit, and what limits it.

    The class is that with the largest 95th percentile of the sum, which is 1 on the torque-speed
    line. It is limited by torque or by speed where that alone comes within a tenth of its limit,
    by their sum otherwise.

    Args:
        shares: by class, then by quantity.
    """
    joint = max(shares, key=lambda name: shares[name]["sum"] or 0.0)
    of = shares[joint]
    alone = max(("torque", "speed"), key=lambda name: of[name] or 0.0)
    by = alone if (of[alone] or 0.0) >= NEAR else "sum"
    return {"joint": joint, "by": by, "value": of[by]}


def _level(
    battery: str, curve: Mapping[str, Any], values: Mapping[str, float | None]
) -> float | None:
    """Level at which a battery's utilisation is taken; None where its scalar has no value."""
    if battery == WALK:
        return curve["levels"][0]
    names = {SPEED: "peak_command", ASCENT: "step_ascent", DESCENT: "step_descent", PUSH: "kick"}
    value = values.get(names[battery])
    if value is None or battery != PUSH:
        return value
    return max(level for level in curve["levels"] if level <= value + 1e-9)


def _shares(counts: np.ndarray) -> dict[str, float | None]:
    """Percentiles of a class, counts of shape (quantities, bins)."""
    shares = {name: percentile(counts[i]) for i, name in enumerate(QUANTITIES)}
    return shares | {"near_peak": above(counts[0])}
