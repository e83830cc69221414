"""Order of the designs by a skill, with its probability by a bootstrap over seeds."""

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


@dataclass(frozen=True)
class Pair:
    """Two designs that follow each other in an order.

    Attributes:
        better: name of the first.
        worse: name of the second.
        probability: share of the draws in which `better` is ahead, ties counted half.
        apart: whether every seed of `better` is above every seed of `worse`.
        chance: probability of such separation if the designs did not differ.
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
        pairs: neighbours in the order.
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
    """Return the medians of seeds drawn with replacement, shape (draws,)."""
    return _median(np.sort(values[rng.integers(len(values), size=(draws, len(values)))]))


def _median(ordered: Array) -> Array:
    """Return the medians of sorted rows."""
    low, high = (ordered[:, i] for i in ((ordered.shape[1] - 1) // 2, ordered.shape[1] // 2))
    return (low + high) / 2


def _pair(better: str, worse: str, known: Mapping[str, Array], drawn: Mapping[str, Array]) -> Pair:
    a, b = drawn[better], drawn[worse]
    share = float(np.mean(a > b) + np.mean(a == b) / 2)
    apart = bool(known[better][0] > known[worse][-1])
    return Pair(better, worse, share, apart, by_chance(len(known[better]), len(known[worse])))


def by_chance(first: int, second: int) -> float:
    """Return the probability that all of one sample exceed all of another of the same source.

    Args:
        first: size of the one sample.
        second: size of the other.
    """
    return 1 / math.comb(first + second, first)


def of_study(study: Study, arm: str, scalar: str) -> Ordering | None:
    """Return the order of the designs by a scalar; None if fewer than two designs have it."""
    return order({design: _of_seeds(study, design, arm, scalar) for design in study.members})


def _of_seeds(study: Study, design: str, arm: str, scalar: str) -> list[float]:
    """Return a scalar of every seed; a seed that passes no level is below all others.

    An unknown efficiency is not small, and is omitted.
    """
    values = by_seed(study, design, arm, scalar)
    failed = 0 if scalar == "eta" else len(values.reasons)
    return [*values.known.values(), *[-math.inf] * failed]
