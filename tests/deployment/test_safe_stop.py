"""A deployed controller damps the joints when something is wrong, until it is started again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from draft.learn.policy.policy import FOLDER, open_policy
from tests.deployment.controllers import Deployed, Seen

POLICY = open_policy(FOLDER / "cheetah-run.onnx")
PERIOD = POLICY.control_period


def seen(now: float = 0.0, **other: Any) -> Seen:
    """A robot that stands in its home pose."""
    level, none = (0.0, 0.0, -1.0), (0.0, 0.0, 0.0)
    usual = Seen(now, now, now, (0.5, 0.0, 0.0), none, none, level, POLICY.home, np.zeros(12))
    return usual._replace(**other)


def at(array: np.ndarray, joint: int, value: float) -> np.ndarray:
    """An array with another number for one joint."""
    return np.where(np.arange(len(array)) == joint, value, array)


NOT_FINITE = "a measurement, the command or a target is not finite"
OLD = "the measurements are old, or ahead of the clock"
LATE = "the controller is late, or its clock went back"
STILL, HOME = np.zeros(12), POLICY.home
TILTED = (np.sin(1.05), 0.0, -np.cos(1.05))
WRONG: Mapping[str, tuple[dict[str, Any], str]] = {
    "nan angle": ({"angle": at(HOME, 4, np.nan)}, NOT_FINITE),
    "infinite speed": ({"speed": at(STILL, 0, -np.inf)}, NOT_FINITE),
    "nan gyro": ({"turning": (0.0, np.nan, 0.0)}, NOT_FINITE),
    "nan gravity": ({"gravity": (0.0, 0.0, np.nan)}, NOT_FINITE),
    "nan velocity": ({"velocity": (np.nan, 0.0, 0.0)}, NOT_FINITE),
    "nan command": ({"command": (np.nan, 0.0, 0.0)}, NOT_FINITE),
    "nan time": ({"time": np.nan}, NOT_FINITE),
    "old": ({"time": -2.1 * PERIOD}, OLD),
    "ahead": ({"time": 2.1 * PERIOD}, OLD),
    "ahead without end": ({"time": 1e9}, OLD),
    "late": ({"now": 2.1 * PERIOD, "time": 2.1 * PERIOD}, LATE),
    "a clock that went back": ({"now": -2.1 * PERIOD, "time": -2.1 * PERIOD}, LATE),
    "in m/s2": ({"gravity": (0.0, 0.0, -9.81)}, "gravity is no unit vector"),
    "none": ({"gravity": (0.0, 0.0, 0.0)}, "gravity is no unit vector"),
    "tilted": ({"gravity": TILTED}, "the trunk is tilted"),
    "upside down": ({"gravity": (0.0, 0.0, 1.0)}, "the trunk is tilted"),
    "beyond its range": ({"angle": at(HOME, 0, 0.91)}, "a joint is out of its range"),
    "below its range": ({"angle": at(HOME, 2, -2.91)}, "a joint is out of its range"),
    "too fast": ({"speed": at(STILL, 5, -60.1)}, "a joint is too fast"),
}
RIGHT: Mapping[str, dict[str, Any]] = {
    "a period old": {"time": -PERIOD},
    "measured after the clock was read": {"time": 0.1 * PERIOD},
    "a step later": {"now": 1.9 * PERIOD, "time": 1.9 * PERIOD},
    "inclined": {"gravity": (np.sin(0.95), 0.0, -np.cos(0.95))},
    "at the end of its range": {"angle": at(HOME, 0, 0.85)},
    "driven beyond its no-load speed": {"speed": at(STILL, 5, 50.0)},
}


@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_stops_it(what: str, controller: Deployed) -> None:
    other, reason = WRONG[what]
    controller.start(0.0)
    given = controller.step(seen(**other))
    assert controller.stop == reason
    assert_damps(controller, given.output)


@pytest.mark.parametrize("what", RIGHT)
def test_what_is_usual_does_not(what: str, controller: Deployed) -> None:
    controller.start(0.0)
    controller.step(seen(**RIGHT[what]))
    assert controller.stop == ""


def assert_damps(controller: Deployed, output: np.ndarray) -> None:
    """Its targets are speed zero without stiffness, and its torques only take energy away."""
    angle, speed, stiffness, damping, limit = output
    assert not stiffness.any()
    assert not speed.any()
    assert not angle.any()
    assert (damping > 0).all()
    np.testing.assert_array_equal(limit, POLICY.peak_torque)
    for moving in np.random.default_rng(0).uniform(-70, 70, (20, 12)):
        torque = controller.torque(HOME + 0.5, moving, 0.0)
        assert (torque * moving < 0).all()
        least, most = POLICY.torque_bounds(moving)
        assert (torque >= least - 1e-9).all()
        assert (torque <= most + 1e-9).all()


def test_a_stop_holds_until_the_controller_is_started(controller: Deployed) -> None:
    controller.start(0.0)
    controller.step(seen(gravity=TILTED))
    for i in range(1, 5):
        assert not controller.step(seen(i * PERIOD)).output[2].any()
        assert controller.stop == "the trunk is tilted"  # The first reason stays.
    controller.start(0.1)
    assert controller.step(seen(0.1)).output[2].all()
    assert controller.stop == ""


def test_torques_are_damping_if_nobody_calls_step(controller: Deployed) -> None:
    controller.start(0.0)
    controller.step(seen())
    pushed = controller.torque(HOME + 0.2, STILL, 1.9 * PERIOD)
    assert (pushed < 0).any()
    assert controller.stop == ""
    np.testing.assert_array_equal(controller.torque(HOME + 0.2, STILL, 2.1 * PERIOD), STILL)
    assert controller.stop == LATE
    # A step comes too late.
    controller.step(seen(2.2 * PERIOD))
    assert controller.stop == LATE


def test_torques_are_damping_if_the_clock_went_back(controller: Deployed) -> None:
    controller.start(0.0)
    controller.step(seen())
    np.testing.assert_array_equal(controller.torque(HOME + 0.2, STILL, -2.1 * PERIOD), STILL)
    assert controller.stop == LATE


@pytest.mark.parametrize("angle", [np.nan, np.inf, -np.inf, 1e308])
def test_a_target_that_is_not_finite_stops_it(angle: float, controller: Deployed) -> None:
    controller.start(0.0)
    controller.hold(at(HOME, 4, angle), 0.0)
    moving = np.linspace(-3.0, 3.0, 12)
    torque = controller.torque(HOME, moving, 0.0)
    assert controller.stop == NOT_FINITE
    np.testing.assert_allclose(torque, -moving * POLICY.damping)


def test_a_joint_that_is_not_measured_has_no_torque_and_the_others_are_damped(
    controller: Deployed,
) -> None:
    controller.start(0.0)
    controller.step(seen())
    speed = at(np.full(12, 2.0), 3, np.nan)
    torque = controller.torque(HOME, speed, 0.0)
    assert controller.stop == NOT_FINITE
    assert torque[3] == 0.0
    np.testing.assert_allclose(np.delete(torque, 3), np.delete(-2.0 * POLICY.damping, 3))


def test_an_old_command_counts_as_zero_and_one_beyond_the_training_as_its_end(
    controller: Deployed,
) -> None:
    def commanded(**other: Any) -> list[float]:
        controller.start(1.0)
        observation = controller.step(seen(1.0, **other)).observation
        assert controller.stop == ""
        return np.asarray(observation, float)[-3:].tolist()

    assert commanded(command=(0.5, 0.1, -0.1)) == pytest.approx([0.5, 0.1, -0.1])
    assert commanded(command=(0.5, 0.1, -0.1), asked=0.4) == [0.0, 0.0, 0.0]
    assert commanded(command=(0.5, 0.1, -0.1), asked=1.6) == [0.0, 0.0, 0.0]  # Ahead.
    assert commanded(command=(0.5, 0.1, -0.1), asked=1.4) == pytest.approx([0.5, 0.1, -0.1])
    assert commanded(command=(99, -99, 99)) == pytest.approx([5.0, -0.4, 0.4])
    assert POLICY.commands == pytest.approx((5.0, 0.4, 0.4))


def test_the_way_to_the_home_pose_is_straight_and_has_the_gains_of_the_policy(
    controller: Deployed,
) -> None:
    controller.start(0.0)
    first = HOME - np.linspace(-0.4, 0.4, 12)
    for share in (0.0, 0.25, 1.0):
        angle, speed, stiffness, damping, _ = controller.hold(first, share)
        np.testing.assert_allclose(angle, first + share * (HOME - first))
        assert not speed.any()
        np.testing.assert_allclose(stiffness, POLICY.stiffness)
        np.testing.assert_allclose(damping, POLICY.damping)
    assert np.abs(controller.torque(HOME, STILL, 0.0)).max() < 1e-9
