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
from draft.learn.policy.reduced import any_legs
from draft.learn.policy.trim import NONE, START, Trim
from draft.learn.policy.validity import fit
from draft.learn.policy.walk import Walk

RATE, MOST = np.array([0.1, 0.1, 0.1, 0.05, 0.05]), np.array([0.2, 0.2, 0.15, 0.1, 0.1])
ENDS = np.array([1.0, 0.3, 0.5])
TRIM = Trim(RATE, MOST, ENDS)
DOWN = np.array([0.0, 0.0, -1.0])
three = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3).map(np.array)


@given(three.map(lambda x: x / 14), three.map(lambda x: x / 15))
def test_a_robot_with_a_constant_drift_ends_at_the_command(
    command: np.ndarray, drift: np.ndarray
) -> None:
    # Velocity = command + drift, so the shift nears -drift as exp(-rate t).
    assert (np.abs(command - drift) <= ENDS).all()
    trim = Trim(RATE * (1, 1, 1, 0, 0), MOST, ENDS)
    state, step = START, 0.02
    for _ in range(2000):
        state = trim.next(state, command, trim.command(command, state) + drift, step)
    left = drift * (1 - RATE[0] * step) ** 2000
    np.testing.assert_allclose(state[:3], -(drift - left), atol=1e-9)
    np.testing.assert_allclose(trim.command(command, state) + drift, command + left, atol=1e-9)


@given(st.floats(0.0, 0.3), st.floats(0.1, 0.2))
def test_a_drift_that_takes_a_command_past_its_end_leaves_what_is_missing(
    asked: float, drift: float
) -> None:
    trim, command = Trim(RATE * (1, 1, 1, 0, 0), MOST, ENDS), np.array([0.0, asked, 0.0])
    state, seen = START, command
    for _ in range(2000):
        seen = trim.command(command, state)
        state = trim.next(state, command, seen - [0.0, drift, 0.0], 0.1)
    missing = max(asked + drift - ENDS[1], 0.0)
    np.testing.assert_allclose(seen[1] - drift, asked - missing, atol=1e-6)


@given(st.floats(-0.09, 0.09), st.floats(-0.09, 0.09))
def test_a_robot_that_drifts_to_where_it_leans_ends_upright_in_what_it_feels(
    ahead: float, left: float
) -> None:
    # Velocity = what it feels as leaning back, per unit: gravity ahead is answered by slowing down.
    trim = Trim(RATE * (0, 0, 0, 1, 1), MOST, ENDS)
    state, felt = START, np.array([ahead, left])
    for _ in range(20000):
        slower = trim.gravity(DOWN, state)[:2]
        state = trim.next(state, np.zeros(3), [*(felt - slower), 0.0], 0.05)
    np.testing.assert_allclose(state[3:], felt, atol=1e-9)
    assert (state[:3] == 0).all()


@given(three, three, st.floats(0.0, 100.0))
def test_a_state_stays_within_its_bounds_and_the_command_in_those_of_the_training(
    command: np.ndarray, velocity: np.ndarray, time: float
) -> None:
    state = TRIM.next(START, command, velocity, time)
    assert (np.abs(state) <= MOST).all()
    seen = TRIM.command(command, state)
    assert (np.abs(seen) <= np.maximum(ENDS, np.abs(command))).all()


@given(three, three)
def test_without_a_trim_the_policy_sees_what_is_asked(
    command: np.ndarray, velocity: np.ndarray
) -> None:
    state = NONE.next(START, command, velocity, 1.0)
    assert (state == 0).all()
    assert not NONE
    np.testing.assert_array_equal(NONE.command(command, state), command)
    np.testing.assert_array_equal(NONE.gravity(DOWN, state), DOWN)


def test_a_trim_of_many_robots_is_that_of_each() -> None:
    drawn = np.random.default_rng(0).normal(size=(3, 5, 3))
    states = np.random.default_rng(1).normal(size=(5, 5)) / 20
    times = np.linspace(0.1, 0.5, 5)[:, None]
    whole = TRIM.next(states, drawn[1], drawn[2], times)
    gravity = TRIM.gravity(drawn[0], states)
    for i in range(5):
        one = TRIM.next(states[i], drawn[1, i], drawn[2, i], times[i])
        np.testing.assert_array_equal(whole[i], one)
        np.testing.assert_array_equal(gravity[i], TRIM.gravity(drawn[0, i], states[i]))


@pytest.mark.parametrize(("robot", "speed"), [("humanoid", 0.3), ("hexapod", 0.2)])
def test_the_policy_of_all_legs_observes_more_than_it_is_asked(robot: str, speed: float) -> None:
    model = open_design(robot).build()
    found = fit(model)
    walk = Walk(model, found, (speed, 0.0, 0.0))
    command = [-3, -2, -1]

    def trimmed() -> tuple[np.ndarray, np.ndarray]:
        seen = walk.controller.observe(walk.data, walk.command)
        return seen[command] - walk.command, seen[6:8] + walk.data.xmat[1].reshape(3, 3)[2, :2]

    walk.advance(6.0)
    assert walk.falls == 0
    of_command, of_gravity = map(np.abs, trimmed())
    legs = len(legged_robot(model.design, model).feet)
    # On two legs the turn alone.
    assert (of_command[:2].max() > 0.005) == (legs > 2)
    assert of_command[2] > 0.001
    assert (of_gravity.max() > 0.005) == (legs == 2)
    walk.restart()
    assert np.abs(np.concatenate(trimmed())).max() < 1e-6


def test_a_trim_has_the_size_of_its_robot() -> None:
    member = legged_robot(open_design("hexapod"))
    own, without = fit(open_design("hexapod").build()).policy.trim, any_legs().trim(6)
    # The same motion in both units, of a robot that misses 0.1 sqrt(g L) for sqrt(L / g).
    length = member.leg_length
    speed, rate = np.sqrt(9.81 * length), np.sqrt(9.81 / length)
    missed = np.array([0.1, -0.05, 0.2])
    units = np.array([speed, speed, rate])
    state = own.next(START, missed * units, np.zeros(3), 1 / rate)
    np.testing.assert_allclose(
        state, without.next(START, missed, np.zeros(3), 1.0) * [*units, 1, 1], rtol=1e-4
    )
    np.testing.assert_allclose(own.ends, without.ends * units, rtol=1e-4)


def test_the_file_of_one_robot_keeps_the_trim(tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    model = open_design("humanoid").build()
    policy = fit(model, "run").policy
    file = tmp_path / "humanoid.onnx"
    file.write_bytes(of_policy(policy, legged_robot(model.design, model), (1.0, 1.0, 1.0)))
    np.testing.assert_allclose(open_policy(file).trim.numbers(), policy.trim.numbers(), rtol=1e-8)


@pytest.mark.parametrize("numbers", [[0.1] * 6, [*[0.1] * 12, -1.0], [float("nan")] * 13])
def test_other_numbers_are_no_trim(numbers: list[float]) -> None:
    with pytest.raises(ValueError, match="trim has"):
        Trim.of(numbers)
