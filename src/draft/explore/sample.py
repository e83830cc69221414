"""Which designs are drawn: any block of rows alone is what it is among all.

Row i is the same whoever draws it and whatever was drawn before, so a run may stop, go on, and be
shared out over processes and machines.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from draft.errors import DraftError, Problem
from draft.explore.vary import Axis
from draft.extras import need
from draft.values import Array

Kind = Literal["sobol", "grid", "random"]
_SOBOL_BITS = 30  # of scipy's default; more only where more rows are drawn


def draw(
    axes: Sequence[Axis], kind: Kind, n: int, seed: int, start: int, count: int
) -> dict[str, Array]:
    """Rows [start, start + count) of n: an array of shape (count,) for each axis, by name.

    Args:
        axes: what is varied.
        kind: "sobol" (scrambled, from scipy), "grid" or "random".
        n: rows in all; of a grid what `rounded` gives.
        seed: of "sobol" and "random".
        start: first row.
        count: how many.

    Raises:
        DraftError: scipy is not installed.
    """
    if kind == "grid":
        return _grid(axes, n, start, count)
    shares = (_sobol if kind == "sobol" else _random)(len(axes), n, seed, start, count)
    return {axis.name: axis.at(shares[:, i]) for i, axis in enumerate(axes)}


def rounded(axes: Sequence[Axis], kind: Kind, n: int) -> int:
    """Rows that a sampler draws where n are asked for: a grid has as many along every axis."""
    return math.prod(_shape(axes, n)) if kind == "grid" else n


def _shape(axes: Sequence[Axis], n: int) -> tuple[int, ...]:
    """Points along each axis: listed values as they are, ranges at least their two ends."""
    ranges = sum(not axis.values for axis in axes)
    listed = math.prod(len(axis.values) for axis in axes if axis.values)
    each = 2
    if ranges:
        each = max(2, int((n / listed) ** (1 / ranges) + 1e-9))
    return tuple(len(axis.values) or each for axis in axes)


def _grid(axes: Sequence[Axis], n: int, start: int, count: int) -> dict[str, Array]:
    # The shape of n rows is that of the n that was asked for: its root is whole.
    shape = _shape(axes, n)
    rows = np.arange(start, start + count)
    found: dict[str, Array] = {}
    # The last axis is the fastest.
    for axis, points in reversed(list(zip(axes, shape, strict=True))):
        rows, place = np.divmod(rows, points)
        if axis.values:
            found[axis.name] = np.asarray(axis.values)[place]
        else:
            found[axis.name] = axis.at(place / (points - 1))
    return {axis.name: found[axis.name] for axis in axes}


def _random(axes: int, n: int, seed: int, start: int, count: int) -> Array:
    """Uniform shares, shape (count, axes): the generator jumps to its row without drawing."""
    bits = np.random.PCG64(np.random.SeedSequence(seed))
    bits.advance(start * axes)  # one step of the generator for each number
    return np.random.Generator(bits).random((count, axes))


def _sobol(axes: int, n: int, seed: int, start: int, count: int) -> Array:
    """Scrambled Sobol shares, shape (count, axes)."""
    qmc = need("scipy.stats.qmc")
    bits = _SOBOL_BITS if n <= 1 << _SOBOL_BITS else 52
    options: dict[str, Any] = {"d": axes, "scramble": True, "bits": bits}
    if axes > qmc.Sobol.MAXDIM:
        cause = f"{axes} axes are more than Sobol's sequence has ({qmc.Sobol.MAXDIM})"
        raise DraftError(Problem(cause, None, "use --sampler random"))
    with warnings.catch_warnings():
        # A block of it is rarely a power of two; the whole is what counts.
        warnings.simplefilter("ignore", UserWarning)
        try:
            sampler = qmc.Sobol(**options, rng=seed)
        except TypeError:  # before scipy 1.15
            sampler = qmc.Sobol(**options, seed=seed)
        if start:
            sampler.fast_forward(start)
        return sampler.random(count)
