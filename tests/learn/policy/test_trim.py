"""A trim removes constant errors of a velocity, slowly and within bounds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.design.references import open_design
from draft.learn.bodies.legged import legged_robot
from draft.learn.policy.onnx_write import of_policy
from draft.learn.policy.policy import open_policy
from draft.learn.policy.trim import NONE, Trim
from draft.learn.policy.validity import fit
from draft.learn.policy.walk import Walk

MOST, ENDS = np.array([0.2, 0.2, 0.15]), np.array([1.0, 0.3, 0.5])
TRIM = Trim(0.1, MOST, ENDS)
three = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3).map(np.array)


@given(three.map(lambda x: x / 11), three.map(lambda x: x / 15))
def test_a_robot_with_a_constant_drift_ends_at_the_command(
    command: np.ndarray, drift: np.ndarray
) -> None:
    # Velocity = command + drift, so the shift nears -drift as exp(-rate t).
    shift, step = np.zeros(3), 0.02
    for _ in range(2000):
        shift = TRIM.next(shift, command, TRIM.shifted(command, shift) + drift, step)
    left = drift * (1 - TRIM.rate * step) ** 2000
    np.testing.assert_allclose(shift, -(drift - left), atol=1e-9)
    np.testing.assert_allclose(TRIM.shifted(command, shift) + drift, command + left, atol=1e-9)


@given(three, three, st.floats(0.0, 100.0))
def test_a_shift_stays_within_its_bounds_and_those_of_the_training(
    command: np.ndarray, velocity: np.ndarray, time: float
) -> None:
    shift = TRIM.next(np.zeros(3), command, velocity, time)
    assert (np.abs(shift) <= MOST).all()
    seen = TRIM.shifted(command, shift)
    assert (np.abs(seen) <= np.maximum(ENDS, np.abs(command))).all()


@given(three, three, three)
def test_without_a_trim_the_policy_sees_what_is_asked(
    shift: np.ndarray, command: np.ndarray, velocity: np.ndarray
) -> None:
    assert (NONE.next(np.zeros(3), command, velocity, 1.0) == 0).all()
    np.testing.assert_array_equal(NONE.shifted(command, np.zeros(3)), command)


def test_a_trim_of_many_robots_is_that_of_each() -> None:
    drawn = np.random.default_rng(0).normal(size=(3, 5, 3))
    times = np.linspace(0.1, 0.5, 5)[:, None]
    whole = TRIM.next(drawn[0], drawn[1], drawn[2], times)
    for i in range(5):
        one = TRIM.next(drawn[0, i], drawn[1, i], drawn[2, i], times[i])
        np.testing.assert_array_equal(whole[i], one)


def test_a_humanoid_walks_nearer_to_the_command_with_the_trim() -> None:
    model = open_design("humanoid").build()
    found = fit(model)
    assert found.policy.trim.rate > 0
    walk = Walk(model, found, (0.3, 0.0, 0.0))
    untrimmed = walk.controller.observe(walk.data, walk.command)
    walk.advance(6.0)
    seen = walk.controller.observe(walk.data, walk.command)
    assert walk.falls == 0
    np.testing.assert_allclose(untrimmed[-3:], walk.command, atol=1e-6)
    assert np.abs(seen[-3:] - walk.command).max() > 0.01  # It has been shifted.
    walk.restart()
    again = walk.controller.observe(walk.data, walk.command)
    np.testing.assert_allclose(again[-3:], walk.command, atol=1e-6)


def test_the_file_of_one_robot_keeps_the_trim(tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    model = open_design("humanoid").build()
    policy = fit(model, "run").policy
    file = tmp_path / "humanoid.onnx"
    file.write_bytes(of_policy(policy, legged_robot(model.design, model), (1.0, 1.0, 1.0)))
    np.testing.assert_allclose(open_policy(file).trim.numbers(), policy.trim.numbers(), rtol=1e-8)


@pytest.mark.parametrize("numbers", [[0.1] * 6, [0.1] * 6 + [-1.0], [float("nan")] * 7])
def test_other_numbers_are_no_trim(numbers: list[float]) -> None:
    with pytest.raises(ValueError, match="trim has"):
        Trim.of(numbers)
