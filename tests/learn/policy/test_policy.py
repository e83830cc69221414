"""Shipped policies with NumPy, and a robot that they drive in plain MuJoCo."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.errors import DraftError
from draft.learn.policy.controller import Controller
from draft.learn.policy.play_options import Course
from draft.learn.policy.playback import KICK_EVERY, Playback, Scenario, playback, usual
from draft.learn.policy.policy import FAMILIES, STUDIED, Policy, designs, policy, scan_points
from draft.learn.task.groups import Observations

SHIPPED = [(design, skill) for design in designs() for skill in STUDIED]
STILL = (0.0, 0.0, 0.0)
MOST = 400_000  # Bytes of a shipped file.


@pytest.fixture(scope="module")
def walker() -> Policy:
    return policy("cheetah", "walk")


@pytest.fixture(scope="module")
def cheetah() -> draft.Design:
    return draft.load("quadruped").resolve("cheetah")


def drive(controller: Controller, speed: float, seconds: float) -> np.ndarray:
    """Mean velocity after the first second, in the trunk's frame."""
    data = mujoco.MjData(controller.model)
    controller.reset(data)
    found = []
    while data.time < seconds:
        controller.step(data, (speed, 0.0, 0.0))
        if data.time > 1.0:
            found.append(controller.velocity(data).copy())
    return np.mean(found, axis=0)


def test_policies_are_shipped_of_these_designs_and_nothing_else() -> None:
    assert designs() == ("bear", "cheetah", "giraffe")
    folder = Path(draft.__file__).parent / "robots" / "quadruped" / "policies"
    files = [*(f"{design}-{skill}.onnx" for design, skill in SHIPPED)]
    files += {file.name for file in FAMILIES.values()}
    assert sorted(path.name for path in folder.iterdir()) == sorted(files)


@pytest.mark.parametrize(("design", "skill"), SHIPPED)
def test_a_shipped_policy_is_small_and_of_the_design_as_it_is_now(design: str, skill: str) -> None:
    found = draft.policy(design, skill)
    assert found.file.stat().st_size < MOST
    assert found.stage == STUDIED[skill]
    assert found.design == f"quadruped:{design}"
    built = draft.load("quadruped").resolve(design)
    drives: list[Any] = [built.actuators[str(joint.actuator)] for joint in built.joints.values()]
    assert found.joints == tuple(built.joints)
    np.testing.assert_allclose(found.peak_torque, [d.peak_torque for d in drives], rtol=1e-6)
    np.testing.assert_allclose(found.no_load_speed, [d.no_load_speed for d in drives], rtol=1e-6)


@pytest.mark.parametrize("design", designs())
def test_a_shipped_walker_walks_in_plain_mujoco(design: str) -> None:
    model = draft.load("quadruped").resolve(design).build().scene()
    walker = policy(design, "walk")
    forward, sideways, _ = drive(Controller(walker, model), 0.6, 6.0)
    assert forward == pytest.approx(0.6, abs=0.15)
    assert abs(sideways) < 0.15


def test_an_unknown_design_is_reported() -> None:
    with pytest.raises(DraftError, match=r"no policy of 'lion' is shipped"):
        policy("lion")


def test_policies_that_do_not_fit_a_robot_or_an_observation_are_reported(
    walker: Policy, cheetah: draft.Design
) -> None:
    with pytest.raises(DraftError, match="has 48 numbers, not 47") as told:
        walker(np.zeros(47))
    assert "base_lin_vel 3, base_ang_vel 3" in str(told.value)
    with pytest.raises(DraftError, match="the model has no joint 'FL_hip_roll'"):
        Controller(walker, draft.load("hopper").resolve().build().scene())
    other = replace(walker, terms=(*walker.terms, ("wind", 4)))
    with pytest.raises(DraftError, match="observes wind, which a controller cannot compute"):
        Controller(other, cheetah.build().scene())


@given(action=st.floats(-20, 20), angle=st.floats(-3, 3), speed=st.floats(-100, 100))
def test_torques_stay_within_the_torque_speed_line(
    action: float, angle: float, speed: float
) -> None:
    walker = policy("cheetah", "walk")
    torque = walker.torque(np.full(12, action), np.full(12, angle), np.full(12, speed))
    share = np.clip(speed / walker.no_load_speed, -2, 2)
    assert (torque <= walker.peak_torque * (1 - share) + 1e-9).all()
    assert (torque >= walker.peak_torque * (-1 - share) - 1e-9).all()
    assert (np.abs(torque) <= np.abs(walker.peak_torque) + 1e-9).all() or abs(speed) > 40
    # The posture that is asked for needs none.
    assert walker.torque(np.zeros(12), walker.home, np.zeros(12)) == pytest.approx(np.zeros(12))


def test_points_of_the_scan_are_a_grid_about_the_trunk() -> None:
    numbers = Observations()
    found = scan_points(numbers.scan_size, numbers.scan_pitch)
    assert found.shape == (numbers.scan_points(), 2)
    np.testing.assert_allclose(found.mean(0), 0, atol=1e-12)
    np.testing.assert_allclose(found[0], [-0.8, -0.5])
    np.testing.assert_allclose(found[1] - found[0], [0.1, 0.0])


def test_a_controller_sees_the_heights_of_steps(cheetah: draft.Design) -> None:
    climber = policy("cheetah", "climb")
    shown = Playback(climber, cheetah, Scenario((0.5, 0.0, 0.0), step=0.1))
    shown.data.qpos[0] = 1.5  # The first step begins there, and rises every 0.3 m.
    controller = shown.controller
    seen = controller.observe(shown.data, (0.5, 0.0, 0.0))[-187:].reshape(11, 17) * 5.0
    trunk = shown.data.xpos[1]
    expected = trunk[2] - 0.1 * np.clip(np.floor((np.arange(-8, 9) * 0.1 + 1e-9) / 0.3) + 1, 0, 4)
    clear = np.abs((np.arange(-8, 9) * 0.1) % 0.3) > 0.01  # Points on an edge see either side.
    np.testing.assert_allclose(seen[5, clear], expected[clear], atol=0.02)


def test_a_robot_that_falls_restarts_and_is_counted(cheetah: draft.Design) -> None:
    shown = Playback(policy("cheetah", "walk"), cheetah, Scenario((0.5, 0.0, 0.0)))
    shown.data.qpos[3:7] = [0, 1, 0, 0]  # On its back.
    shown.step()
    assert shown.falls == 1
    assert shown.data.qpos[3] == 1.0


def test_kicks_come_at_their_time(cheetah: draft.Design) -> None:
    shown, still = (
        Playback(policy("cheetah", "push"), cheetah, Scenario(STILL, kick=kick))
        for kick in (2.0, 0.0)
    )
    before = round(KICK_EVERY / shown.policy.timestep) - 2
    for step in range(before + 4):
        if step == before:
            np.testing.assert_array_equal(shown.data.qvel, still.data.qvel)
        shown.step()
        still.step()
    assert np.linalg.norm(shown.data.qvel[:2] - still.data.qvel[:2]) > 0.1


def test_each_stage_is_shown_by_what_it_taught() -> None:
    walk, run, climb, push = (
        usual(policy("cheetah", skill), stage) for skill, stage in STUDIED.items()
    )
    assert (walk.step, walk.kick) == (0.0, 0.0)
    assert run.command[0] > walk.command[0]
    assert climb.step > 0
    assert push.kick > 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"command": (math.nan, 0.0, 0.0)},
            "`command` [nan, 0, 0] is not three numbers from -100 to 100",
        ),
        ({"step": 2.0}, "`step` 2 is not a number from 0 to 0.6 m"),
        ({"kick": -3.0}, "`kick` -3 is not a number from 0 to 100 m/s"),
        ({"seconds": 0.0}, "`seconds` 0 is not a number above 0 and of at most 600 s"),
        ({"seconds": math.nan}, "`seconds` nan is not a number above 0 and of at most 600 s"),
        ({"skill": "dance"}, "there is no skill 'dance'"),
        ({"policy": "none.onnx"}, "cannot read none.onnx"),
    ],
)
def test_bad_arguments_are_one_line_with_what_to_give(
    arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises(draft.DraftError) as raised:
        draft.play("quadruped", **arguments)
    assert message in str(raised.value)
    assert raised.value.problems[0].remedy


def test_a_skill_sets_the_scene_unless_it_is_given(cheetah: draft.Design) -> None:
    climbing, _ = playback(cheetah, "climb")
    assert climbing.policy.stage == "terrain"
    assert climbing.model.ngeom > playback(cheetah, "climb", course=Course(step=0.0))[0].model.ngeom
    assert playback(cheetah, "push", course=Course(kick=0.5))[0].kick == 0.5


def test_a_robot_outside_the_region_is_played_with_a_warning() -> None:
    longer = draft.load("quadruped").resolve({"thigh_length": 0.5})
    _, warning = playback(longer)
    assert "outside the region of the policy" in warning
    assert playback(draft.load("quadruped").resolve())[1] == ""
