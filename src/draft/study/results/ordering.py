"""Order of the designs by a skill, and how sure it is: a bootstrap over seeds."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from draft.study.report.records import Study
from draft.study.report.spread import by_seed
from draft.values import Array

DRAWS = 20_000
# Scalars by which designs are ordered: absolute ones, then those per leg length.
SKILLS = ("top_speed", "step", "kick", "eta")
NORMALISED = ("top_speed_normalised", "step_normalised", "kick_normalised")


@dataclass(frozen=True)
class Pair:
    """Two designs that follow each other in an order.

    Attributes:
        better, worse: their names.
        probability: share of the draws in which `better` is ahead, ties counted half.
        apart: whether every seed of `better` is above every seed of `worse`.
        chance: probability that they would be so far apart if they did not differ.
    """

    better: str
    worse: str
    probability: float
    apart: bool
    chance: float


@dataclass(frozen=True)
class Ordering:
    """Order of the designs by a skill.

    Attributes:
        designs: names, the largest median over seeds first.
        probability: share of the draws with just this order.
        other: the most frequent other order, and its share; None if there is none.
        pairs: of designs that follow each other.
        seeds: number of seeds by design.
    """

    designs: tuple[str, ...]
    probability: float
    other: tuple[tuple[str, ...], float] | None
    pairs: tuple[Pair, ...]
    seeds: Mapping[str, int]


def order(values: Mapping[str, Sequence[float]], draws: int = DRAWS) -> Ordering | None:
    """Order designs by their medians over seeds.

    In each draw every design gets as many of its seeds as it has, with replacement, and the
    designs are ordered by the medians of these; ties are broken at random. Draws are the same in
    every call.

    Args:
        values: a number per seed by design; minus infinity for a seed without the skill.
        draws: number of draws.

    Returns:
        The order; None for fewer than two designs.
    """
    known = {name: np.sort(np.asarray(v, dtype=float)) for name, v in values.items() if len(v)}
    if len(known) < 2:
        return None
    rng = np.random.default_rng(0)
    names = list(known)
    medians = np.array([_medians(known[name], draws, rng) for name in names])
    ranks = np.lexsort((rng.random(medians.shape), -medians), axis=0).T
    found = Counter(tuple(names[i] for i in row) for row in ranks.tolist())
    middle = {name: _median(known[name][None, :])[0] for name in names}
    best = tuple(sorted(names, key=lambda name: (-middle[name], name)))
    others = [(o, count) for o, count in found.most_common() if o != best]
    drawn = dict(zip(names, medians, strict=True))
    return Ordering(
        designs=best,
        probability=found[best] / draws,
        other=(others[0][0], others[0][1] / draws) if others else None,
        pairs=tuple(_pair(a, b, known, drawn) for a, b in pairwise(best)),
        seeds={name: len(known[name]) for name in best},
    )


def _medians(values: Array, draws: int, rng: np.random.Generator) -> Array:
    """Medians of seeds drawn with replacement, shape (draws,)."""
    return _median(np.sort(values[rng.integers(len(values), size=(draws, len(values)))]))


def _median(ordered: Array) -> Array:
    """Medians of rising rows."""
    low, high = (ordered[:, i] for i in ((ordered.shape[1] - 1) // 2, ordered.shape[1] // 2))
    return (low + high) / 2


def _pair(better: str, worse: str, known: Mapping[str, Array], drawn: Mapping[str, Array]) -> Pair:
    a, b = drawn[better], drawn[worse]
    share = float(np.mean(a > b) + np.mean(a == b) / 2)
    apart = bool(known[better][0] > known[worse][-1])
    return Pair(better, worse, share, apart, by_chance(len(known[better]), len(known[worse])))


def by_chance(first: int, second: int) -> float:
    """Probability that all of some numbers exceed all of others that are drawn from the same.

    Args:
        first: how many there are of the one.
        second: how many there are of the others.
    """
    return 1 / math.comb(first + second, first)


def of_study(study: Study, arm: str, scalar: str) -> Ordering | None:
    """Order of a study's designs by a scalar; None for fewer than two designs that have it."""
    return order({design: _of_seeds(study, design, arm, scalar) for design in study.members})


def _of_seeds(study: Study, design: str, arm: str, scalar: str) -> list[float]:
    """A scalar of every seed. A seed that passes no level is below all that pass one.

    An efficiency that is not known is no small one, and is left out.
    """
    values = by_seed(study, design, arm, scalar)
    lacking = 0 if scalar == "eta" else len(values.reasons)
    return [*values.known.values(), *[-math.inf] * lacking]
