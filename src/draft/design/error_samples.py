"""Samples of the errors of a design's laws.

A sample is a world in which each law errs by a factor of its own, as laws err on held-out machines
(`draft.design.bands`). Laws of one actuator class err together, as over the modules of the
catalogue; classes, and segments of different kinds, err independently. Designs that are resolved
with the same sample differ in their values alone, so that most of the errors cancel in a
difference.
"""

from __future__ import annotations

import math
from functools import lru_cache
from statistics import NormalDist

import numpy as np

from draft.design.bands import sensitivities, small_sigma_of
from draft.design.design import Design
from draft.design.law_errors import LawErrors
from draft.design.structure_law import structure_laws
from draft.laws.law import quantile
from draft.values import Array, Value, scalar

_SHARE = 0.9  # Share of the band whose half-width gives a law's standard deviation.


def sample_errors(design: Design, count: int, seed: int = 0, *others: Design) -> LawErrors:
    """Draw errors of the laws of one design, or of several of one robot.

    Args:
        design: one design; its laws, and whether an actuator is below their data, are taken from
            it.
        count: number of samples N.
        seed: seed of the samples; equal seeds give equal ones.
        others: further designs, which may follow laws that the first does not.
    """
    rng = np.random.default_rng(seed)
    designs = (design, *others)
    population = structure_laws(design)
    actuators: dict[str, dict[str, Value]] = {}
    for name, actuator in design.actuators.items():
        of_all = [one.actuators[name] for one in designs if name in one.actuators]
        laws = list(dict.fromkeys(law for one in of_all for law in sensitivities(one)))
        if not laws:
            continue  # Every number of it is measured.
        width = [math.log(actuator.laws.error(law).band(_SHARE)) for law in laws]
        sigma = np.array(width) / quantile(_SHARE)
        table = actuator.laws.correlation
        alike = [[table.get((a, b), float(a == b)) for b in laws] for a in laws]
        drawn = _normal(rng, count, len(laws)) @ _root(np.array(alike)).T * sigma
        actuators[name] = {
            law: _downwards(drawn[:, k], sigma[k], small_sigma_of(actuator, law))
            for k, law in enumerate(laws)
        }
    trends = (segment.trend for one in designs for segment in one.segments)
    segments = {
        kind: _normal(rng, count)[:, 0] * population.segments[kind].sigma
        for kind in dict.fromkeys(trends)
        if kind is not None
    }
    trunk: Value = 0.0
    if not all(one.lofted is None or one.lofted.density_stated for one in designs):
        trunk = _normal(rng, count)[:, 0] * population.trunk_law.sigma
    return LawErrors(actuators, segments, trunk)


def _normal(rng: np.random.Generator, count: int, sources: int = 1) -> Array:
    """Standard normal samples, shape (count, sources): a Latin hypercube, so that few suffice."""
    even = _even(count)
    return np.stack([even[rng.permutation(count)] for _ in range(sources)], axis=1)


@lru_cache(maxsize=8)
def _even(count: int) -> Array:
    """Middles of equal shares of the normal distribution."""
    normal = NormalDist()
    return np.array([normal.inv_cdf((i + 0.5) / count) for i in range(count)])


def _root(correlation: Array) -> Array:
    """Matrix square root; pairs that few modules have may leave a matrix indefinite."""
    values, vectors = np.linalg.eigh(correlation)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def _downwards(drawn: Array, sigma: float, small: Value | None) -> Array:
    """Errors of a law below the torques of its data: wider, and downwards only."""
    if small is None or not scalar(small) > sigma:
        return drawn
    return np.where(drawn < 0, drawn * (scalar(small) / sigma), drawn)
