"""A robot that walks in plain MuJoCo while its body is replaced, and recordings of it."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import draft
from draft.learn.policy.gait import SECONDS, record
from draft.learn.policy.validity import fit
from draft.learn.policy.walk import DOWN, Walk, limiting, on_line, share_of_limit
from draft.model import Model
from draft.model.model import preview

Values = dict[str, float] | str


def body(values: Values = "cheetah") -> Model:
    return preview(draft.load("quadruped").resolve(values))


def walking(values: Values = "cheetah", seconds: float = 0.0) -> Walk:
    """A robot that walks ahead, after some seconds."""
    model = body(values)
    walk = Walk(model, fit(model), (0.5, 0.0, 0.0))
    walk.advance(seconds)
    return walk


def swap(walk: Walk, values: dict[str, float]) -> None:
    model = body(values)
    walk.swap(model, fit(model))


def topple(walk: Walk) -> None:
    """Put the robot on its back."""
    walk.data.qpos[2:7] = (0.3, 0, 1, 0, 0)
    mujoco.mj_forward(walk.model, walk.data)
    walk.step()
    assert walk.down


def depth(walk: Walk) -> float:
    """How deep the robot reaches into the floor [m]."""
    mujoco.mj_fwdPosition(walk.model, walk.data)
    return -float(walk.data.contact.dist.min(initial=0.0))


def test_a_new_body_keeps_the_state_and_walks_on() -> None:
    walk = walking(seconds=2.0)
    before = walk.data.qpos.copy(), walk.data.qvel.copy(), walk.data.time
    swap(walk, {"thigh_length": 0.27})
    np.testing.assert_array_equal(np.delete(walk.data.qpos, 2), np.delete(before[0], 2))
    np.testing.assert_array_equal(walk.data.qvel, before[1])
    assert walk.data.time == before[2]
    assert walk.fit.name == "the family of quadrupeds"
    walk.command = (2.0, 0.0, 0.0)
    walk.advance(2.0)
    start = walk.data.qpos[0]
    walk.advance(4.0)
    assert (walk.data.qpos[0] - start) / 4.0 == pytest.approx(2.0, abs=0.1)  # as asked
    assert walk.falls == 0


def test_a_motor_that_moves_no_foot_does_not_move_the_robot() -> None:
    walk = walking(seconds=2.0)
    assert depth(walk) > 0.001  # a foot that bears the robot reaches into the floor
    before = walk.data.qpos.copy()
    for damping in (0.01, 0.02, 0.03):
        swap(walk, {"actuators.leg.damping": damping})
    np.testing.assert_array_equal(walk.data.qpos, before)


@pytest.mark.parametrize(
    ("values", "least", "most"),
    [
        pytest.param({"actuators.leg.peak_torque": 80.0}, -0.001, 0.001, id="longer housing"),
        pytest.param({"thigh_length": 0.35}, 0.05, 0.15, id="longer leg"),
    ],
)
def test_a_body_that_grows_into_the_floor_is_lifted_by_as_much(
    values: dict[str, float], least: float, most: float
) -> None:
    walk = walking(seconds=2.0)
    height, deep = walk.data.qpos[2], depth(walk)
    swap(walk, values)
    assert least <= walk.data.qpos[2] - height <= most
    assert depth(walk) == pytest.approx(deep, abs=1.1e-4)
    walk.advance(0.3)
    assert walk.data.ncon > 0  # it stays on the floor


def test_the_swapped_body_is_the_one_compiled_alone() -> None:
    walk = walking(seconds=0.5)
    swap(walk, {"thigh_length": 0.3, "actuators.leg.peak_torque": 90.0})
    alone = body({"thigh_length": 0.3, "actuators.leg.peak_torque": 90.0}).mujoco
    np.testing.assert_allclose(walk.model.body_mass, alone.body_mass)
    np.testing.assert_allclose(walk.model.body_pos, alone.body_pos)
    assert [walk.model.body(i).name for i in range(alone.nbody)] == [
        alone.body(i).name for i in range(alone.nbody)
    ]


def test_a_robot_that_falls_lies_for_a_moment_and_starts_again_where_it_lay() -> None:
    walk = walking(seconds=0.2)
    topple(walk)
    assert walk.falls == 1
    walk.advance(DOWN + 0.1)
    assert not walk.down
    assert walk.data.xmat[1][8] > 0.9
    assert walk.falls == 1


@pytest.mark.parametrize("fallen", [False, True])
def test_a_simulation_that_diverges_is_a_fall_and_starts_again_where_it_was(fallen: bool) -> None:
    walk = walking(seconds=2.0)
    if fallen:
        topple(walk)
    falls, time, place = walk.falls, walk.data.time, walk.data.qpos[:2].copy()
    assert place[0] > 0.5
    walk.data.qvel[:] = 1e12
    walk.step()
    assert walk.falls == falls + 1
    assert not walk.down
    assert walk.data.time == time
    np.testing.assert_array_equal(walk.data.qpos[:2], place)
    walk.advance(1.0)
    assert walk.falls == falls + 1
    assert walk.data.qpos[0] > place[0]


def test_torques_of_another_motor_are_forgotten() -> None:
    walk = walking(seconds=0.1)
    swap(walk, {"thigh_length": 0.27})
    assert len(walk.loads()[0]) > 0
    for motor in (
        {"peak_torque": 60.0},
        {"peak_torque": 60.0, "no_load_speed": 30.0},
        {"peak_torque": 60.0, "no_load_speed": 30.0, "corner_speed": 10.0},
    ):
        swap(walk, {f"actuators.leg.{name}": value for name, value in motor.items()})
        assert len(walk.loads()[0]) == 0
        walk.step()
        assert len(walk.loads()[0]) == 1


def test_a_push_is_in_the_frame_of_the_trunk() -> None:
    walk = walking()
    walk.data.qpos[3:7] = (np.sqrt(0.5), 0, 0, np.sqrt(0.5))  # faces +y
    mujoco.mj_forward(walk.model, walk.data)
    before = walk.data.qvel[:2].copy()
    walk.push(1.0, 0.5)
    assert walk.data.qvel[:2] - before == pytest.approx((-0.5, 1.0))


CORNER = {"actuators.leg.corner_speed": 20.0}  # Of a motor whose no-load speed is 40 rad/s.


@pytest.mark.parametrize(
    ("values", "torque", "speed", "share"),
    [
        pytest.param("cheetah", 1.0, 0.0, 1.0, id="peak torque"),
        pytest.param("cheetah", 0.5, 0.5, 1.0, id="on the line"),
        pytest.param("cheetah", 0.25, 0.5, 0.5, id="half of the line"),
        pytest.param("cheetah", -0.5, 0.5, 0.5, id="a brake gives its peak at any speed"),
        pytest.param(CORNER, 1.0, 0.5, 1.0, id="peak torque up to the corner"),
        pytest.param(CORNER, 0.5, 0.75, 1.0, id="on the line beyond the corner"),
    ],
)
def test_a_torque_is_a_share_of_what_the_motor_gives_at_its_speed(
    values: Values, torque: float, speed: float, share: float
) -> None:
    found = fit(body(values))
    peak, no_load = found.policy.peak_torque, found.policy.no_load_speed
    assert share_of_limit(found, torque * peak, speed * no_load) == pytest.approx(share)


def test_a_motor_with_a_corner_is_outside_what_the_policy_knows() -> None:
    found = fit(body(CORNER))
    # The policy was trained without such a limit of the current.
    assert {one.name.split(" of ")[0] for one in found.outside} == {"stall torque"}
    assert "stall torque 144 N m (trained at 72)" in found.warning


@pytest.mark.parametrize("values", ["cheetah", CORNER], ids=["plain", "corner"])
@pytest.mark.parametrize("ahead", [1.0, -1.0])
def test_a_joint_that_is_faster_than_its_motor_is_at_its_limit(
    values: Values, ahead: float
) -> None:
    found = fit(body(values))
    peak, speed = found.policy.peak_torque, ahead * 1.1 * found.policy.no_load_speed
    # The line goes on below zero: the motor cannot but brake a little.
    limit = -ahead * 0.1 * found.policy.stall_torque
    assert share_of_limit(found, limit, speed) == pytest.approx(1.0)
    assert share_of_limit(found, -ahead * 0.6 * peak, speed) == pytest.approx(0.6)
    np.testing.assert_allclose(on_line(found, limit, speed), (np.abs(speed), 0 * peak))
    braked = on_line(found, -ahead * 0.6 * peak, speed)
    np.testing.assert_allclose(braked, (0 * peak, 0.6 * peak))


def test_torques_of_the_policy_at_any_speed_lie_on_or_below_the_line() -> None:
    found = fit(body(CORNER))
    random = np.random.default_rng(0)
    no_load, peak = found.policy.no_load_speed, found.policy.peak_torque
    speeds = random.uniform(-2.0, 2.0, (500, len(peak))) * no_load
    action = random.normal(scale=3.0, size=speeds.shape)
    torques = found.policy.torque(action, found.policy.home, speeds)
    speed, torque = on_line(found, torques, speeds)
    line = found.policy.stall_torque * np.maximum(1.0 - speed / no_load, 0.0)
    assert (torque <= np.minimum(peak, line) + 1e-9).all()
    least, most = found.policy.torque_bounds(speeds)
    limited = (torques == least) | (torques == most)
    assert 0.2 < limited.mean() < 0.9
    np.testing.assert_array_equal(share_of_limit(found, torques, speeds) == 1.0, limited)


def test_what_limits_a_robot_is_named() -> None:
    strong = walking(seconds=3.0)
    joint, what, share = limiting(strong)
    assert joint in strong.fit.policy.joints
    assert what == ""
    assert 0.2 < share < 1.0
    weak = walking({"actuators.leg.peak_torque": 12.0}, 1.0)
    joint, what, share = limiting(weak)
    assert what == "torque"
    assert share > 0.05


def test_a_joint_at_its_speed_limit_is_named_with_its_speed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walk = walking()
    policy = walk.fit.policy
    torques = np.tile(0.1 * policy.peak_torque, (10, 1))
    speeds = np.tile(0.1 * policy.no_load_speed, (10, 1))
    # Faster than the motor for four steps of ten, and at the peak torque for one; at the peak
    # torque, though it is fast, for three.
    speeds[:4, 5] = 1.2 * policy.no_load_speed[5]
    torques[:4, 5] = policy.torque_bounds(speeds)[1][:4, 5]
    torques[4, 5] = policy.peak_torque[5]
    speeds[:3, 7], torques[:3, 7] = -0.8 * policy.no_load_speed[7], policy.peak_torque[7]
    monkeypatch.setattr(walk, "loads", lambda: (torques, speeds))
    assert limiting(walk) == (policy.joints[5], "speed", pytest.approx(0.5))
    speeds[:, 5] = 0.0
    assert limiting(walk) == (policy.joints[7], "torque", pytest.approx(0.3))


def test_a_gait_is_repeated_without_a_jump() -> None:
    cheetah = record(body())
    assert cheetah.walks
    assert 3.0 <= len(cheetah.positions) * cheetah.period <= SECONDS
    steps = np.abs(np.diff(cheetah.positions, axis=0)).max()
    assert np.abs(cheetah.positions[0] - cheetah.positions[-1]).max() < 1.5 * steps
    # On the spot, and facing ahead.
    assert np.abs(cheetah.positions[:, 0, :2]).max() < 0.05
    heading = 2 * np.arctan2(cheetah.quaternions[:, 0, 3], cheetah.quaternions[:, 0, 0])
    assert np.abs(heading).max() < 0.15
    assert np.linalg.norm(cheetah.quaternions, axis=2) == pytest.approx(1.0)
    # Its speed is the distance over the time.
    time = len(cheetah.positions) * cheetah.period
    assert cheetah.speed == pytest.approx(cheetah.stride / time)
    assert cheetah.speed == pytest.approx(cheetah.command, abs=0.1)
    assert (np.diff(cheetah.travel) > 0).all()


def test_a_robot_that_falls_stands_and_the_reason_is_given() -> None:
    weak = {"actuators.leg.peak_torque": 30.0}
    values = {"thigh_length": 0.9, "shank_length": 0.9, **weak}
    gait = record(body(values))
    assert not gait.walks
    walk = walking(values)
    walk.command = (0.5 * walk.fit.policy.forward, 0.0, 0.0)
    while not walk.falls:
        walk.step()
    assert 0.1 < walk.data.time < 1.4  # while it settles, of which nothing is recorded
    assert gait.reason == f"it falls after {walk.data.time:.1f} s"
    assert "leg length 1.8 m (trained at " in gait.note
    words = "thigh_length=0.9 shank_length=0.9 actuators.leg.peak_torque=30.0"
    assert gait.remedy == f"draft train quadruped --set {words}"


def test_a_robot_without_a_policy_stands() -> None:
    gait = record(preview(draft.load("hopper").resolve()))
    assert not gait.walks
    assert "no policy drives the joints of hopper: hopper cannot be trained" in gait.reason
    assert gait.remedy == ""
