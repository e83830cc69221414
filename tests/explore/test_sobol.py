"""Sobol points are those of SciPy, bit by bit."""

from __future__ import annotations

from pathlib import Path
from unittest import mock

import numpy as np
import pytest

pytest.importorskip("scipy")

from draft.errors import DraftError
from draft.explore import sobol


@pytest.mark.parametrize(
    ("axes", "bits", "seed", "start", "count"),
    [
        (1, 30, 0, 0, 17),
        (4, 30, 0, 0, 3000),
        (4, 30, 7, 1000, 1024),
        (4, 30, 7, 123_456, 3000),
        (31, 30, 3, 999, 2049),
        (6, 52, 1, 0, 1500),
        (200, 30, 2, 5, 10),
    ],
)
def test_points_are_those_of_scipy(axes: int, bits: int, seed: int, start: int, count: int) -> None:
    expected = sobol._by_scipy(axes, bits, seed, start, count)
    assert np.array_equal(sobol.points(axes, bits, seed, start, count), expected)


def test_any_block_is_part_of_the_sequence_also_far_out() -> None:
    start = (1 << 40) - 700
    whole = sobol.points(3, 52, 5, start, 4000)
    assert np.array_equal(sobol.points(3, 52, 5, start + 1500, 300), whole[1500:1800])
    assert len(np.unique(whole[:, 0])) == 4000
    assert 0 <= whole.min() < whole.max() < 1


def test_without_the_file_of_directions_scipy_draws() -> None:
    expected = sobol.points(3, 30, 1, 0, 64)
    sobol._sequence.cache_clear()
    with mock.patch.object(sobol, "_FILE", str(Path("stats") / "none.npz")):
        assert np.array_equal(sobol.points(3, 30, 1, 0, 64), expected)
    sobol._sequence.cache_clear()


def test_too_many_axes_are_refused() -> None:
    with pytest.raises(DraftError, match="21202 varied numbers are too many"):
        sobol.points(sobol.MOST_AXES + 1, 30, 0, 0, 1)
