"""Percentiles of counted samples, and which joint is nearest its limit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.learn.measuring.utilisation import (
    BINS,
    CELLS,
    WIDTH,
    Histograms,
    limiting,
    near_peak,
    percentile,
    utilisation,
)

CLASSES = ("hip roll", "hip pitch", "knee")


def counted(shares: Any) -> np.ndarray:
    bins = np.clip(np.ceil(np.asarray(shares) / WIDTH - 1e-4).astype(int) - 1, 0, BINS - 1)
    return np.bincount(bins, minlength=BINS)


@given(st.lists(st.floats(0, 1.59), min_size=1, max_size=200))
def test_a_percentile_is_right_to_a_bin(shares: list[float]) -> None:
    exact = np.sort(shares)[int(np.ceil(0.95 * len(shares))) - 1]
    assert percentile(counted(shares)) == pytest.approx(exact, abs=WIDTH * 1.01)


def test_a_saturated_joint_is_at_its_limit_not_above_it() -> None:
    assert percentile(counted([1.0] * 100)) == pytest.approx(1.0, abs=WIDTH)
    assert percentile(counted([1.0] * 100), 1.0) == pytest.approx(1.0)
    assert percentile(counted([7.0])) == pytest.approx(1.6)
    assert percentile(counted([])) is None


def test_near_the_peak_is_above_nine_tenths() -> None:
    assert near_peak(counted([0.5, 0.9, 0.9001, 1.0])) == 0.5
    assert near_peak(counted([])) is None


def shares(**sums: tuple[float, float, float]) -> dict[str, dict[str, float | None]]:
    return {
        name: dict(zip(("torque", "speed", "sum"), values, strict=True))
        for name, values in sums.items()
    }


def test_the_limiting_joint_has_the_largest_sum() -> None:
    of = shares(roll=(0.3, 0.2, 0.4), knee=(0.6, 0.5, 0.95))
    assert limiting(of) == {"joint": "knee", "by": "sum", "value": 0.95}
    of = shares(roll=(1.0, 0.2, 1.1), knee=(0.6, 0.5, 0.95))
    assert limiting(of) == {"joint": "roll", "by": "torque", "value": 1.0}
    of = shares(roll=(0.1, 0.97, 1.0))
    assert limiting(of) == {"joint": "roll", "by": "speed", "value": 0.97}


def test_utilisation_is_taken_at_the_level_of_the_scalar() -> None:
    levels = [1.0, 2.0, 3.0]
    counts = np.zeros((3, 3, 3, BINS), dtype=np.int64)
    for row, share in enumerate((0.2, 0.4, 0.6)):
        counts[row] = counted([share] * 50)
    plane = np.zeros((3, 3, CELLS, CELLS), dtype=np.int64)
    push, a = np.array(["push"] * 3), np.array(["a"] * 3)
    found = Histograms(push, np.array(levels), a, counts, plane, CLASSES)
    curve: Any = {"levels": levels}  # Nothing else of it matters.
    made = utilisation(found, {"push": curve}, {"kick": 2.7})
    assert made["utilisation_level"] == {"push": 2.0}
    assert made["utilisation"]["push"]["knee"]["torque"] == pytest.approx(0.4, abs=WIDTH)
    nothing = {"utilisation": {}, "utilisation_level": {}, "limiting": {}}
    assert utilisation(found, {"push": curve}, {"kick": None}) == nothing
    assert utilisation(found, {"push": curve}, {"kick": 2.7}, "b") == nothing
