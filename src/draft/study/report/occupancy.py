"""Utilisation of the actuators' torque and speed, as counts over seeds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from draft.learn.bodies.legged import CLASSES
from draft.learn.measuring.summary import Measured
from draft.learn.measuring.utilisation import BINS, NEAR, QUANTITIES, percentile
from draft.study.report.records import Evaluation, Samples, Study, levels_of

TESTS = ("speed", "ascent", "descent", "push", "walk")


class Limit(NamedTuple):
    """Limit of most seeds.

    Attributes:
        joint: joint class.
        by: "torque", "speed" or "sum".
        seeds: number of seeds with this limit.
        of: number of all seeds.
        value: largest share of the limit over these seeds.
    """

    joint: str
    by: str
    seeds: int
    of: int
    value: float

    @property
    def near(self) -> bool:
        """Whether it is near its limit; below that, no actuator limits the design."""
        return self.value >= NEAR


@dataclass(frozen=True)
class Use:
    """Utilisation of a design in one skill test.

    Attributes:
        samples: counted samples of all seeds.
        shares: 95th percentiles by joint class and quantity.
        levels: level of each seed.
        limiting: limit of most seeds; None if unknown.
    """

    samples: Samples
    shares: dict[tuple[str, str], float]
    levels: list[float]
    limiting: Limit | None


class Utilisation:
    """Utilisation of the designs of a study, nominal arm."""

    def __init__(self, study: Study) -> None:
        self._found: dict[tuple[str, str], Use] = {}
        for design in study.members:
            evaluations = [one for one in study.of(design, "nominal") if one.summary.utilisation]
            for test in TESTS:
                of = [one for one in evaluations if test in one.summary.utilisation]
                if of:
                    self._found[design, test] = _use(test, of)

    def of(self, design: str, test: str) -> Use | None:
        """Return the utilisation of a design in a test; None if it was not measured."""
        return self._found.get((design, test))


def _use(test: str, evaluations: Sequence[Evaluation]) -> Use:
    pooled, levels = Samples(), []
    for one in evaluations:
        level = levels_of(one.summary).get(test)
        if level is not None:
            levels.append(level)
            pooled.add(one.samples.get(test, Samples()))
    shares = {}
    for joint in CLASSES:
        for quantity in QUANTITIES:
            counted = percentile(pooled.bins.get(joint, {}).get(quantity, np.zeros(BINS)))
            if counted is not None:
                shares[joint, quantity] = counted
                continue
            values = [
                float(value)
                for one in evaluations
                if (value := one.summary.utilisation[test].get(joint, {}).get(quantity)) is not None
            ]
            if values:
                shares[joint, quantity] = float(np.median(values))
    return Use(pooled, shares, levels, limiting(test, (one.summary for one in evaluations)))


def limiting(test: str, summaries: Iterable[Measured]) -> Limit | None:
    """Return the limit of most seeds; of two, the one with the larger share."""
    found: Counter[tuple[str, str]] = Counter()
    nearest: dict[tuple[str, str], float] = {}
    for summary in summaries:
        limit = summary.limiting.get(test)
        if limit is not None and limit["joint"] in CLASSES:
            key = limit["joint"], limit["by"]
            found[key] += 1
            nearest[key] = max(nearest.get(key, 0.0), limit["value"] or 0.0)
    if not found:
        return None
    best = max(found, key=lambda key: (found[key], nearest[key], key))
    return Limit(*best, found[best], sum(found.values()), nearest[best])
