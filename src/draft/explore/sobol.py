"""Scrambled Sobol points, equal to those of `scipy.stats.qmc.Sobol`.

They are computed here from the direction numbers of Joe and Kuo that SciPy has in a file, as the
import of `scipy.stats` takes longer than a thousand designs in every process of a run. Without that
file SciPy computes them.
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError, Problem
from draft.extras import need
from draft.values import Array

MOST_AXES = 21201  # that Joe and Kuo give numbers for
_FILE = "stats/_sobol_direction_numbers.npz"
_LOW = 10  # bits of an index whose points are kept
Integers = NDArray[np.uint64]


def points(axes: int, bits: int, seed: int, start: int, count: int) -> Array:
    """Points of a scrambled Sobol sequence.

    Args:
        axes: dimensions.
        bits: binary digits of each coordinate, at most 64.
        seed: seed of the scrambling.
        start: first point.
        count: number of points.

    Returns:
        Shares from 0 to 1, shape (count, axes).

    Raises:
        DraftError: there are too many axes, or SciPy is not installed.
    """
    if axes > MOST_AXES:
        cause = f"{axes} varied numbers are too many for a Sobol sequence ({MOST_AXES} at most)"
        raise DraftError(Problem(cause, None, "use --sampler random"))
    need("scipy")
    made = _sequence(axes, bits, seed)
    if made is None:
        return _by_scipy(axes, bits, seed, start, count)
    directions, shift, low = made
    # A point is the shift with the directions of the bits of its index in Gray code; Gray codes of
    # a sum without carry are combined likewise, so the points of the lowest bits are computed once.
    index = np.arange(start, start + count, dtype=np.uint64)
    first = int(start) >> _LOW
    high = np.arange(first, ((start + count - 1) >> _LOW) + 1, dtype=np.uint64) << np.uint64(_LOW)
    above = _combined(directions, high) ^ shift
    place = (index >> np.uint64(_LOW)).astype(np.intp) - first
    return (above[place] ^ low[index & np.uint64((1 << _LOW) - 1)]) * (1.0 / 2**bits)


@lru_cache(maxsize=8)
def _sequence(axes: int, bits: int, seed: int) -> tuple[Integers, Integers, Integers] | None:
    """Scrambled directions, shape (bits, axes), shift, and points of the lowest bits."""
    table = _table(axes)
    if table is None:
        return None
    random = np.random.default_rng(seed).spawn(1)[0]
    kind = np.uint32 if bits <= 32 else np.uint64
    powers = np.uint64(1) << np.arange(bits, dtype=np.uint64)
    digits = random.integers(2, size=(axes, bits), dtype=kind).astype(np.uint64)
    shift = (digits * powers).sum(axis=1, dtype=np.uint64)
    triangles = np.tril(random.integers(2, size=(axes, bits, bits), dtype=kind)).astype(np.uint64)
    triangles[:, np.arange(bits), np.arange(bits)] = 1
    rows = (triangles * powers[::-1]).sum(axis=2, dtype=np.uint64)
    plain = _directions(*table, bits)
    odd = _parity(rows[:, :, None] & plain[:, None, :])
    directions = (odd * powers[::-1, None]).sum(axis=1, dtype=np.uint64).T.copy()
    low = _combined(directions, np.arange(1 << _LOW, dtype=np.uint64))
    return directions, shift, low


def _combined(directions: Integers, index: Integers) -> Integers:
    """Directions of the bits of indices in Gray code, combined, shape (indices, axes)."""
    gray = index ^ (index >> np.uint64(1))
    found = np.zeros((len(index), directions.shape[1]), dtype=np.uint64)
    for k, direction in enumerate(directions):
        chosen = (gray >> np.uint64(k)) & np.uint64(1)
        found ^= chosen[:, None] * direction
    return found


def _directions(poly: Any, first: Any, bits: int) -> Integers:
    """Directions of the plain sequence, shape (axes, bits) (Bratley and Fox, 1988)."""
    found = np.zeros((len(poly), bits), dtype=object)
    found[0] = 1
    for d in range(1, len(poly)):
        p = int(poly[d])
        degree = p.bit_length() - 1
        row = [int(x) for x in first[d][: min(degree, bits)]]
        for j in range(len(row), bits):
            new = row[j - degree]
            for k in range(degree):
                if (p >> (degree - 1 - k)) & 1:
                    new ^= row[j - k - 1] << (k + 1)
            row.append(new)
        found[d] = row
    for k in range(bits):
        found[:, k] *= 1 << (bits - 1 - k)
    return found.astype(np.uint64)


def _parity(values: Integers) -> Integers:
    for half in (32, 16, 8, 4, 2, 1):
        values = values ^ (values >> np.uint64(half))
    return values & np.uint64(1)


def _table(axes: int) -> tuple[Any, Any] | None:
    """Polynomials and first directions of some axes; None if SciPy has no such file."""
    spec = find_spec("scipy")
    if spec is None or spec.origin is None:
        return None
    try:
        with np.load(Path(spec.origin).parent / _FILE, allow_pickle=False) as file:
            poly, first = file["poly"][:axes], file["vinit"][:axes]
    except (OSError, ValueError, KeyError):
        return None
    return (poly, first) if len(poly) == len(first) == axes else None


def _by_scipy(axes: int, bits: int, seed: int, start: int, count: int) -> Array:
    qmc = need("scipy.stats.qmc")
    options: dict[str, Any] = {"d": axes, "scramble": True, "bits": bits}
    with warnings.catch_warnings():
        # SciPy warns of a block that is not a power of two; only the whole sequence matters.
        warnings.simplefilter("ignore", UserWarning)
        try:
            sampler = qmc.Sobol(**options, rng=seed)
        except TypeError:  # before scipy 1.15
            sampler = qmc.Sobol(**options, seed=seed)
        if start:
            sampler.fast_forward(start)
        return sampler.random(count)
