"""Power-law fits find the law behind the data, and held-out scores hold out what they say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.fitting.least_squares import fit, leave_group_out, predict
from draft.fitting.scores import fold_error, r_squared
from draft.values import Array

seeds = st.integers(0, 2**32 - 1)


def _inputs(seed: int, n: int, k: int) -> Array:
    return np.exp(np.random.default_rng(seed).uniform(-2, 2, size=(n, k)))


@given(
    seeds,
    st.floats(1e-3, 1e3),
    st.lists(st.floats(-3, 3), min_size=1, max_size=3),
)
def test_a_known_power_law_is_recovered(seed: int, factor: float, exponents: list[float]) -> None:
    inputs = _inputs(seed, 20, len(exponents))
    output = factor * np.prod(inputs**exponents, axis=1)
    coefficients = fit(inputs, output)
    assert np.exp(coefficients[0]) == pytest.approx(factor, rel=1e-9)
    assert coefficients[1:] == pytest.approx(exponents, abs=1e-9)
    predicted = predict(coefficients, inputs)
    assert predicted == pytest.approx(output, rel=1e-9)
    assert fold_error(np.log(predicted / output)) == pytest.approx(1.0, abs=1e-9)


@given(seeds, st.integers(1, 2))
def test_leave_one_out_equals_refitting_without_each_row_by_hand(seed: int, k: int) -> None:
    inputs = _inputs(seed, 12, k)
    output = _inputs(seed + 1, 12, 1)[:, 0]
    by_hand = []
    for i in range(12):
        rows = [j for j in range(12) if j != i]
        design = np.array([[1.0, *np.log(inputs[j])] for j in rows])
        normal = np.linalg.solve(design.T @ design, design.T @ np.log(output[rows]))
        by_hand.append(np.exp(normal @ [1.0, *np.log(inputs[i])]))
    assert leave_group_out(inputs, output, range(12)) == pytest.approx(np.array(by_hand), rel=1e-8)


@given(seeds)
def test_a_held_out_group_never_sees_its_own_rows(seed: int) -> None:
    inputs, output = _inputs(seed, 12, 1), _inputs(seed + 1, 12, 1)[:, 0]
    groups = ["a"] * 4 + ["b"] * 3 + ["c"] * 5
    before = leave_group_out(inputs, output, groups)
    output[:4] *= np.exp(np.linspace(-1, 2, 4))
    after = leave_group_out(inputs, output, groups)
    assert after[:4] == pytest.approx(before[:4], rel=1e-12)
    assert not np.allclose(after[4:], before[4:])


@given(seeds, st.floats(1.01, 10))
def test_a_fold_error_does_not_ask_which_side_is_too_large(seed: int, fold: float) -> None:
    published = _inputs(seed, 8, 1)[:, 0]
    assert fold_error(np.log(published * fold) - np.log(published)) == pytest.approx(fold)
    assert fold_error(np.log(published / fold) - np.log(published)) == pytest.approx(fold)


def test_a_fold_error_skips_rows_without_a_number() -> None:
    assert fold_error(np.log([2.0, np.nan, 8.0])) == pytest.approx(4.0)


def test_a_group_with_no_other_group_has_no_prediction() -> None:
    inputs, output = _inputs(0, 4, 1), _inputs(1, 4, 1)[:, 0]
    assert np.isnan(leave_group_out(inputs, output, ["a"] * 4)).all()


def test_r_squared_is_one_for_the_data_and_zero_for_their_geometric_mean() -> None:
    published = np.array([1.0, 2.0, 4.0, 16.0])
    logs = np.log(published)
    assert r_squared(np.zeros(4), logs) == 1.0
    assert r_squared(logs - logs.mean(), logs) == pytest.approx(0.0, abs=1e-15)
