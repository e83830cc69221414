"""Drake under a policy, with the exported SDFormat, compared with laws and MuJoCo."""

from __future__ import annotations

import json
import math
import re
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest

pytest.importorskip("pydrake.multibody", reason="drake has no wheel for this system")

import draft
from benchmarks import other_engine
from benchmarks.engines import FRICTION, STEP, Drake, Warp, substeps
from draft.errors import DraftError
from draft.learn.policy.play_options import Course
from draft.learn.policy.playback import Playback, playback
from draft.model import Model

GRAVITY = 9.81


@cache
def cheetah() -> Model:
    return draft.load("quadruped").resolve("cheetah").build()


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return cheetah().save(tmp_path_factory.mktemp("drake") / "robot", ("sdf",)) / "robot.sdf"


@pytest.fixture(scope="module")
def drake(file: Path) -> Drake:
    return Drake(file)


@pytest.fixture(scope="module")
def smooth(file: Path) -> Drake:
    """The robot without dry friction in its joints."""
    text = re.sub("<friction>.*?</friction>", "", file.read_text(encoding="utf-8"))
    (other := file.with_name("smooth.sdf")).write_text(text, encoding="utf-8")
    return Drake(other)


def walking(speed: float = 1.0, skill: str = "walk") -> Playback:
    course = Course(command=(speed, 0.0, 0.0), kick=0.0)
    return playback(cheetah().design, skill, course=course)[0]


def lifted(robot: Playback) -> mujoco.MjData:
    """A state of the robot far above the floor, at rest in its home pose."""
    data = mujoco.MjData(robot.model)
    mujoco.mj_resetDataKeyframe(robot.model, data, 0)
    data.qpos[2] += 3.0
    mujoco.mj_forward(robot.model, data)
    return data


def test_a_robot_falls_as_all_bodies_do(drake: Drake) -> None:
    robot = walking()
    data, steps = lifted(robot), 60
    mujoco.mj_comPos(robot.model, data)
    start, pose = data.subtree_com[1, 2], data.qpos[7:].copy()
    for _ in range(steps):
        drake(robot.model, data)
    mujoco.mj_comPos(robot.model, data)
    time = steps * robot.model.opt.timestep
    assert data.time == pytest.approx(time)
    assert data.qvel[2] == pytest.approx(-GRAVITY * time, rel=1e-6)
    # The integrator is semi-implicit: it falls by g t h / 2 more.
    fallen = GRAVITY * time * (time + STEP) / 2
    assert start - data.subtree_com[1, 2] == pytest.approx(fallen, rel=1e-6)
    assert data.qpos[7:] == pytest.approx(pose, abs=1e-9)


def tumbling(robot: Playback, seed: int) -> mujoco.MjData:
    """A state far above the floor with random speeds, turned any way, with torques."""
    data, rng = lifted(robot), np.random.default_rng(seed)
    turn = rng.normal(size=4)
    data.qpos[3:7] = turn / np.linalg.norm(turn)
    data.qpos[7:] += rng.uniform(-0.2, 0.2, 12)
    data.qvel[:] = rng.uniform(-2, 2, robot.model.nv)
    data.qfrc_applied[6:] = rng.uniform(-20, 20, 12)
    return data


@pytest.mark.parametrize("seed", range(4))
def test_a_tumbling_robot_moves_as_in_mujoco(smooth: Drake, seed: int) -> None:
    # MuJoCo's dry friction is a soft constraint of its own.
    robot, ours = walking(), substeps(STEP)
    robot.model.dof_frictionloss[:] = 0.0
    data, other = tumbling(robot, seed), tumbling(robot, seed)
    for _ in range(4):
        smooth(robot.model, data)
        ours(robot.model, other)
    moved = np.abs(other.qpos - tumbling(robot, seed).qpos).max()
    assert moved > 0.05
    assert data.qpos == pytest.approx(other.qpos, abs=0.001 * moved)


def test_dry_friction_is_a_torque_against_the_speed_of_a_joint(drake: Drake, smooth: Drake) -> None:
    robot = walking()
    robot.model.opt.timestep = STEP
    data, other = tumbling(robot, 0), tumbling(robot, 0)
    drake(robot.model, data)
    smooth(robot.model, other)
    masses = np.zeros((robot.model.nv, robot.model.nv))
    mujoco.mj_fullM(robot.model, lifted_as(robot), masses)
    speeds = tumbling(robot, 0).qvel[6:]
    loss = robot.model.dof_frictionloss[6:]
    found = (masses @ (data.qvel - other.qvel))[6:] / STEP
    fast = np.abs(speeds) > 0.2  # Slower ones may stick.
    assert fast.sum() > 8
    assert found[fast] == pytest.approx(-(loss * np.sign(speeds))[fast], rel=0.02)


def lifted_as(robot: Playback) -> mujoco.MjData:
    """State of `tumbling`, with its mass matrix."""
    data = tumbling(robot, 0)
    mujoco.mj_forward(robot.model, data)
    return data


def test_a_joint_goes_to_its_target_as_in_mujoco(drake: Drake) -> None:
    robot = walking()
    policy, angles = robot.policy, {}
    action = np.zeros(12)
    action[2] = 1.0
    for engine in (drake, substeps(STEP)):
        data, angles[engine] = lifted(robot), []
        for _ in range(40):
            joints, dofs = robot.controller.positions, robot.controller.dofs
            torque = policy.torque(action, data.qpos[joints], data.qvel[dofs])
            data.qfrc_applied[dofs] = torque
            engine(robot.model, data)
            angles[engine].append(data.qpos[joints[2]] - policy.home[2])
    found, expected = angles.values()
    assert max(expected) > 0.7 * policy.action_scale[2]
    assert found == pytest.approx(expected, abs=0.01 * max(expected))


def test_the_floor_carries_the_weight_of_a_robot_that_stands(drake: Drake) -> None:
    robot = walking()
    data, forces = lifted(robot), []
    data.qpos[2] -= 3.0
    joints, dofs = robot.controller.positions, robot.controller.dofs
    for step in range(240):
        torque = robot.policy.torque(np.zeros(12), data.qpos[joints], data.qvel[dofs])
        data.qfrc_applied[dofs] = torque
        drake(robot.model, data)
        if step >= 200:
            forces.append(np.abs(drake.floor_forces()[:, 2]).sum())
    weight = GRAVITY * cheetah().mujoco.body_mass.sum()
    assert np.mean(forces) == pytest.approx(weight, rel=0.005)
    assert np.abs(data.qvel).max() < 0.1


def test_a_sliding_robot_has_the_friction_of_the_floor(drake: Drake) -> None:
    robot = walking()
    data, ratios = lifted(robot), []
    data.qpos[2] -= 3.0
    joints, dofs = robot.controller.positions, robot.controller.dofs
    data.qvel[0] = 3.0
    for _ in range(30):
        torque = robot.policy.torque(np.zeros(12), data.qpos[joints], data.qvel[dofs])
        data.qfrc_applied[dofs] = torque
        drake(robot.model, data)
        forces = np.abs([one for one in drake.floor_forces() if abs(one[2]) > 1.0])
        ratios += [math.hypot(x, y) / z for x, y, z in forces]
    assert max(ratios) == pytest.approx(FRICTION, rel=1e-6)


def test_a_policy_walks_in_drake_as_in_mujoco(drake: Drake) -> None:
    robot = walking()
    ours = robot.play(2.0)
    robot.controller.advance = drake
    found = robot.play(2.0)
    assert (ours.falls, found.falls) == (0, 0)
    assert found.speed == pytest.approx(ours.speed, rel=0.1)


def test_shorter_steps_alone_change_a_little_and_a_held_torque_is_held() -> None:
    robot = walking()
    data = lifted(robot)
    substeps(robot.model.opt.timestep)(robot.model, data)
    other = lifted(robot)
    mujoco.mj_step(robot.model, other)
    assert data.qpos == pytest.approx(other.qpos, abs=0.0)
    substeps(STEP, 0.004)(robot.model, data)
    assert (robot.model.geom_solref[:, 0] == 0.004).all()
    assert robot.model.opt.timestep == robot.policy.timestep


@pytest.mark.slow
def test_mujoco_warp_steps_as_mujoco() -> None:
    pytest.importorskip("mujoco_warp")
    robot = walking()
    data, other = standing(robot), standing(robot)
    warp = Warp(robot.model)
    for _ in range(10):
        warp(robot.model, data)
        mujoco.mj_step(robot.model, other)
    assert data.time == pytest.approx(other.time)
    assert data.qpos == pytest.approx(other.qpos, abs=1e-4)
    assert data.qvel == pytest.approx(other.qvel, abs=1e-2)


def standing(robot: Playback) -> mujoco.MjData:
    """A state on the floor, in the home pose, with torques."""
    data = lifted(robot)
    data.qpos[2] -= 3.0
    data.qfrc_applied[6:] = 1.0
    return data


def test_what_is_measured_is_kept_and_not_measured_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "rows.json"
    for _ in range(2):
        other_engine.main(("cheetah",), engines=("MuJoCo",), starts=1, kicks=1, out=out)
    found = json.loads(out.read_text(encoding="utf-8"))
    assert found["versions"].keys() == {"mujoco"}
    assert [row["skill"] for row in found["rows"]] == ["walk", "run", "run", "run", "push", "push"]
    for row in found["rows"]:
        if "command" in row:
            assert row["falls"] == 0
            assert row["speed"] == pytest.approx(row["command"], rel=0.2)
        else:
            assert row["stood"] in (0.0, 1.0)
    assert len(capsys.readouterr().out.splitlines()) == len(found["rows"])


def test_an_unknown_engine_is_refused_with_those_that_are_known(tmp_path: Path) -> None:
    with pytest.raises(DraftError, match="no engine 'Gazebo'"):
        other_engine.main(("cheetah",), engines=("Gazebo",), out=tmp_path / "rows.json")
    assert not (tmp_path / "rows.json").exists()
