"""Samplers of designs that draw any block of rows on its own.

Row i depends neither on the process that draws it nor on the rows drawn before, so that a run can
be interrupted, resumed, and distributed over processes and machines.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from draft.errors import DraftError
from draft.extras import need
from draft.values import Array
from draft.variation.axes import Axis

Sampler = Literal["sobol", "grid", "random"]
_SOBOL_BITS = 30  # default of scipy; more are used only for more rows


def draw(
    axes: Sequence[Axis], kind: Sampler, n: int, seed: int, start: int, count: int
) -> dict[str, Array]:
    """Draw rows [start, start + count) of n.

    Args:
        axes: numbers that are varied.
        kind: "sobol" (scrambled, from scipy), "grid" or "random".
        n: rows in all; for a grid, the number from `rounded`.
        seed: seed of "sobol" and "random".
        start: first row.
        count: number of rows.

    Returns:
        Values by name of the axis, shape (count,).

    Raises:
        DraftError: scipy is not installed.
    """
    if kind == "grid":
        return _grid(axes, n, start, count)
    shares = (_sobol if kind == "sobol" else _random)(len(axes), n, seed, start, count)
    return {axis.name: axis.at(shares[:, i]) for i, axis in enumerate(axes)}


def rounded(axes: Sequence[Axis], kind: Sampler, n: int) -> int:
    """Number of rows for a request of n: a grid has the same number of points on every range."""
    return math.prod(_shape(axes, n)) if kind == "grid" else n


def _shape(axes: Sequence[Axis], n: int) -> tuple[int, ...]:
    """Points along each axis: all listed values, and at least the two ends of a range."""
    ranges = sum(not axis.values for axis in axes)
    listed = math.prod(len(axis.values) for axis in axes if axis.values)
    each = 2
    if ranges:
        each = max(2, int((n / listed) ** (1 / ranges) + 1e-9))
    return tuple(len(axis.values) or each for axis in axes)


def _grid(axes: Sequence[Axis], n: int, start: int, count: int) -> dict[str, Array]:
    # A rounded n has the same shape as the requested n.
    shape = _shape(axes, n)
    rows = np.arange(start, start + count)
    found: dict[str, Array] = {}
    # The last axis varies fastest.
    for axis, points in reversed(list(zip(axes, shape, strict=True))):
        rows, index = np.divmod(rows, points)
        if axis.values:
            found[axis.name] = np.asarray(axis.values)[index]
        else:
            found[axis.name] = axis.at(index / (points - 1))
    return {axis.name: found[axis.name] for axis in axes}


def _random(axes: int, n: int, seed: int, start: int, count: int) -> Array:
    """Uniform shares, shape (count, axes); the generator advances to the first row in one step."""
    bits = np.random.PCG64(np.random.SeedSequence(seed))
    bits.advance(start * axes)  # one step per number
    return np.random.Generator(bits).random((count, axes))


def _sobol(axes: int, n: int, seed: int, start: int, count: int) -> Array:
    """Scrambled Sobol shares, shape (count, axes)."""
    qmc = need("scipy.stats.qmc")
    bits = _SOBOL_BITS if n <= 1 << _SOBOL_BITS else 52
    options: dict[str, Any] = {"d": axes, "scramble": True, "bits": bits}
    if axes > qmc.Sobol.MAXDIM:
        cause = (
            f"{axes} varied numbers are too many for a Sobol sequence ({qmc.Sobol.MAXDIM} at most)"
        )
        raise DraftError(cause, 'use `sampler="random"`')
    with warnings.catch_warnings():
        # scipy warns of a block that is not a power of two; only the whole sequence matters.
        warnings.simplefilter("ignore", UserWarning)
        try:
            sampler = qmc.Sobol(**options, rng=seed)
        except TypeError:  # before scipy 1.15
            sampler = qmc.Sobol(**options, seed=seed)
        if start:
            sampler.fast_forward(start)
        return sampler.random(count)
