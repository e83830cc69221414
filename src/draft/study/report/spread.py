"""Statistics over seeds: median, band and variation, and the words and decimals to show."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from draft.study.report.records import Study, seeds_in_words

MOST_DECIMALS = 3
ARM_WORDS = {"nominal": "nominal", "perturbed": "perturbed inertia"}
UNKNOWN = "not noted"


@dataclass(frozen=True)
class Spread:
    """Median, least and greatest of several numbers; `best` if no other design has a better one."""

    median: float
    low: float
    high: float
    count: int
    best: bool = False

    @property
    def decimals(self) -> int:
        """Decimals that show a band with one digit, or two if the first is 1 or 2."""
        band = self.high - self.low
        size = band or abs(self.median) / 100
        if size <= 1e-12:
            return 0
        exponent = math.floor(math.log10(size) + 1e-9)
        leading = size / 10**exponent
        return min(max(0, -exponent + (leading < 2.95)), MOST_DECIMALS)


def spread(values: Iterable[float]) -> Spread | None:
    """Return the spread of numbers; None if there are none."""
    found = sorted(values)
    if not found:
        return None
    return Spread(statistics.median(found), found[0], found[-1], len(found))


def variation(values: Sequence[float]) -> float | None:
    """Return sample standard deviation per mean; None for fewer than two, or a mean of zero."""
    mean = statistics.fmean(values) if values else 0.0
    if len(values) < 2 or not mean:
        return None
    return statistics.stdev(values) / abs(mean)


def decimals(spreads: Iterable[Spread | None]) -> int:
    """Return the decimals of a column: as many as most of its bands need."""
    found = sorted(one.decimals for one in spreads if one is not None)
    return found[len(found) // 2] if found else 0


def by_seed(
    study: Study, design: str, arm: str, scalar: str, protocol: str | None = None
) -> Values:
    """Return a scalar of a design by seed, and the reasons where it is unknown."""
    known: dict[int, float] = {}
    reasons: dict[int, str] = {}
    for one in study.of(design, arm, protocol):
        if scalar not in one.summary.scalars:
            continue
        value, seed = one.summary.scalars[scalar], one.run.seed
        if value is not None:
            known[seed] = float(value)
        else:
            reasons[seed] = one.summary.reasons.get(scalar, "no reason is given")
    return Values(known, {seed: why for seed, why in reasons.items() if seed not in known})


@dataclass(frozen=True)
class Values:
    """A scalar by seed, and the reasons where it is unknown."""

    known: Mapping[int, float]
    reasons: Mapping[int, str]

    @property
    def spread(self) -> Spread | None:
        """Spread over the seeds where it is known."""
        return spread(self.known.values())

    @property
    def count(self) -> int:
        """Number of seeds for which it was evaluated."""
        return len(self.known) + len(self.reasons)

    @property
    def measured(self) -> bool:
        """Whether it was evaluated at all."""
        return self.count > 0

    def why(self) -> list[str]:
        """Return the reasons, each with its seeds."""
        texts = dict.fromkeys(self.reasons.values())
        return [
            f"{seeds_in_words([s for s, t in self.reasons.items() if t == text])}: {text}"
            for text in texts
        ]


def few(values: set) -> str:
    """Return one value, or the range of several, as text."""
    known = sorted((v for v in values if v is not None), key=lambda v: (str(type(v)), v))
    if not known:
        return UNKNOWN
    if all(isinstance(v, str) for v in known):
        return ", ".join(known)
    ends = dict.fromkeys((known[0], known[-1]))
    return "–".join(f"{v:g}" for v in ends)
