"""Deployed controllers act as ONNX does, and move MuJoCo's robot as Draft's own runner does."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.deployment.deploy import deploy
from draft.design.references import open_design
from draft.learn.bodies.legged import legged_robot
from draft.learn.policy.controller import Controller
from draft.learn.policy.onnx_write import of_policy
from draft.learn.policy.policy import FAMILIES, FOLDER, Policy, designs, has, open_policy
from draft.learn.policy.validity import fit
from draft.learn.policy.walk import Walk
from tests.deployment.conftest import Written, body
from tests.deployment.controllers import Compiled, Deployed, Python, Seen, needs_compiler
from tests.deployment.machine import Machine
from tests.deployment.made_policies import policy_file
from tests.learn.policy.test_matching import SIGNS, made, tree

onnx = pytest.importorskip("onnx")
from onnx.reference import ReferenceEvaluator  # noqa: E402

SHIPPED = [(name, skill) for name in designs() for skill in ("walk", "run", "push")]
OTHERS = [("family", "run"), ("bear", "machine"), ("hexapod", "walk"), ("humanoid", "walk")]
STEPS = 400  # Physics steps: 2 s.
# As in tests/browser/test_walk.py: Draft's network is of single precision, which the order of sums
# lets drift apart, and a robot that runs more so.
FIRST, PRECISE, WHOLE = 100, 1e-5, 1e-3


def exact(data: bytes) -> Any:
    """ONNX's own evaluator of a file whose numbers were widened to double precision.

    A runtime of single precision rounds: actions of onnxruntime 1.32 for the policies that ship are
    within 1e-6 of it, absolute and relative, and some reach that.
    """
    model = onnx.load_from_string(data)
    double = onnx.TensorProto.DOUBLE
    for tensor in model.graph.initializer:
        if tensor.data_type == onnx.TensorProto.FLOAT:
            values = onnx.numpy_helper.to_array(tensor).astype(float)
            tensor.CopyFrom(onnx.numpy_helper.from_array(values, tensor.name))
    for node in model.graph.node:
        if node.op_type == "Cast":
            node.attribute[0].i = double
    for one in (*model.graph.input, *model.graph.output):
        one.type.tensor_type.elem_type = double
    return ReferenceEvaluator(model)


def file_of(name: str, skill: str) -> bytes:
    """The policy as an ONNX file: the one that ships, or what that of all legs is for a robot."""
    if has(name, skill):
        return (FOLDER / f"{name}-{skill}.onnx").read_bytes()
    if name in ("family", *designs()):
        return FAMILIES[skill].read_bytes()
    model = open_design(name).build()
    return of_policy(fit(model, skill).policy, legged_robot(model.design, model), (1.0, 1.0, 1.0))


def observations(policy: Policy, count: int = 50) -> np.ndarray:
    """Random observations, as the normalisation of a policy expects them."""
    mean, divisor, _ = policy.network.layers()
    drawn = np.random.default_rng(1).normal(size=(count, len(mean)))
    return (mean + divisor * drawn).astype(np.float32)


@pytest.mark.parametrize(("name", "skill"), [*SHIPPED, *OTHERS])
def test_actions_are_those_of_onnx(name: str, skill: str, written: Written) -> None:
    reference = exact(file_of(name, skill))
    entry = reference.input_names[0]
    controller = Python(written(name, skill))
    policy = fit(body(name).build(), skill).policy
    for seen in observations(policy):
        (expected,) = reference.run(None, {entry: seen[None].astype(float)})
        found = controller.network(seen)
        np.testing.assert_allclose(found, np.asarray(expected)[0], rtol=1e-6, atol=1e-6)
        # Draft's own evaluation, of single precision.
        np.testing.assert_allclose(policy(seen), found, rtol=1e-5, atol=1e-5)


@needs_compiler
@pytest.mark.parametrize(("name", "skill"), [("cheetah", "run"), ("bear", "push"), *OTHERS])
def test_actions_of_the_compiled_controller_are_those_of_onnx(
    name: str, skill: str, written: Written
) -> None:
    reference = exact(file_of(name, skill))
    policy = fit(body(name).build(), skill).policy
    with closing(Compiled(written(name, skill))) as controller:
        assert controller.names == list(policy.joints)
        for seen in observations(policy, 20):
            inputs = {reference.input_names[0]: seen[None].astype(float)}
            (expected,) = reference.run(None, inputs)
            found = controller.network(seen)
            np.testing.assert_allclose(found, np.asarray(expected)[0], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "skill"), [("cheetah", "walk"), ("cheetah", "run"), ("bear", "push"), *OTHERS]
)
def test_a_robot_moves_as_in_drafts_own_runner(name: str, skill: str, written: Written) -> None:
    model = body(name).build()
    found = fit(model, skill)
    command = (0.6 * found.policy.forward, 0.05, 0.2)
    controller = Python(written(name, skill))
    machine, own = Machine(model, found, controller.own.names), Walk(model, found, command)
    every = round(found.policy.control_period / found.policy.timestep)
    for i in range(STEPS):
        now = i * found.policy.timestep
        if i % every == 0:
            controller.step(machine.seen(now, command))
        assert controller.stop == ""
        machine.drive(controller.torque(*machine.state(), now))
        own.step()
        off = np.abs(machine.data.qpos - own.data.qpos).max()
        assert off < (PRECISE if i < FIRST else WHOLE), f"after step {i + 1}"
    assert own.falls == 0
    assert own.data.qpos[0] > 0.2  # It walked.


@needs_compiler
@pytest.mark.parametrize(("name", "skill"), [("cheetah", "run"), *OTHERS])
def test_both_languages_do_the_same(name: str, skill: str, written: Written) -> None:
    folder = written(name, skill)
    model = body(name).build()
    found = fit(model, skill)
    python = Python(folder)
    machine = Machine(model, found, python.own.names)
    with closing(Compiled(folder)) as other:
        for i in range(200):
            now = i * found.policy.timestep
            if i % 4 == 0:
                # Beyond the training, which both hold back.
                seen = machine.seen(now, (9.0, 0.05, -9.0))
                for one, its in zip(python.step(seen), other.step(seen), strict=True):
                    np.testing.assert_allclose(its, one, rtol=1e-9, atol=1e-9)
            torques = [one.torque(*machine.state(), now) for one in (python, other)]
            np.testing.assert_allclose(torques[1], torques[0], rtol=1e-9, atol=1e-9)
            assert python.stop == other.stop == ""
            machine.drive(torques[0])


def test_each_joint_of_mujoco_is_the_one_that_the_controller_means(
    tmp_path: Path, shipped_quadruped: Path
) -> None:
    # Legs in another order, other names, and axes that point the other way.
    turned = tree(("sway", "swing", "fold"), SIGNS, ("RR", "FL", "RL", "FR"))
    model = made(tmp_path / "robot", shipped_quadruped, turned)
    found = fit(model)
    assert (found.policy.sign < 0).any()
    folder = deploy(model.design, tmp_path / "controller", "walk").folder
    controller = Python(folder)
    machine = Machine(model, found, controller.own.names)
    own = Controller(found.policy, machine.model)
    rest = controller.step(machine.seen(0.0, (0.1, 0.0, 0.0))).observation
    start = machine.data.qpos.copy()
    for i, name in enumerate(controller.own.names):
        controller.start(0.0)
        own.resume(Controller(found.policy, machine.model))
        machine.data.qpos[:] = start
        machine.data.qpos[machine.model.joint(name).qposadr[0]] += 0.05
        seen = machine.seen(0.0, (0.1, 0.0, 0.0))
        observation = controller.step(seen).observation
        np.testing.assert_array_equal(observation, own.observe(machine.data, (0.1, 0.0, 0.0)))
        first = sum(n for _, n in found.policy.terms[:3])
        moved = (observation - rest)[first : first + 12]
        assert moved[i] == pytest.approx(0.05 * found.policy.sign[i], abs=1e-6)
        assert np.abs(np.delete(moved, i)).max() < 1e-6
    # Its table of axes is that of MuJoCo.
    machine.data.qpos[:] = start
    machine.data.qpos[3:7] = (1, 0, 0, 0)
    machine.data.qpos[[j.qposadr[0] for j in machine.joints]] = found.policy.home
    mujoco.mj_forward(machine.model, machine.data)
    text = (folder / "README.md").read_text(encoding="utf-8")
    for i, name in enumerate(controller.own.names):
        axis = machine.data.xaxis[machine.model.joint(name).id]
        shown = ", ".join(f"{x + 0.0:.3g}" for x in np.round(axis, 4))
        assert f"| {i} | `{name}` | {shown} | {found.policy.sign[i]:+.0f} | an angle |" in text


def test_torques_are_those_of_the_policy_at_any_speed(written: Written) -> None:
    controller = Python(written("cheetah", "run"))
    policy = open_policy(FOLDER / "cheetah-run.onnx")
    numbers = st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12).map(np.array)

    @given(numbers, numbers, numbers)
    def holds(action: np.ndarray, angle: np.ndarray, speed: np.ndarray) -> None:
        action, angle, speed = 6 * action, policy.home + angle, 120 * speed
        controller.start(0.0)
        controller.own.action = action
        out = controller.own.output()
        found = controller.own.torque(out, angle, speed, 0.0)
        np.testing.assert_allclose(found, policy.torque(action, angle, speed), atol=1e-9)

    holds()


def test_wheels_are_driven_to_speeds_and_their_angles_are_not_seen(tmp_path: Path) -> None:
    design = open_design("wheeled")
    file = policy_file(tmp_path / "wheels.onnx", design)
    found = deploy(design, tmp_path / "wheels", policy=file)
    policy, controller = found.policy, Python(found.folder)
    assert policy.rolls.sum() == 4
    angle = policy.home + 1000.0 * policy.rolls
    seen = Seen(0, 0, 0, (0.5, 0, 0), (0,) * 3, (0,) * 3, (0, 0, -1), angle, np.zeros(16))
    step = controller.step(seen)
    assert controller.stop == ""
    assert len(step.observation) == 6 + 12 + 16 + 16 + 3
    np.testing.assert_allclose(step.action, policy(step.observation), atol=1e-5)
    assert (step.output[1][policy.rolls] != 0).all()
    assert (step.output[1][~policy.rolls] == 0).all()
    np.testing.assert_allclose(
        controller.torque(angle, np.ones(16), 0.0), policy.torque(step.action, angle, np.ones(16))
    )
    text = (found.folder / "README.md").read_text(encoding="utf-8")
    assert "| a speed |" in text
    # Nothing checks the angle of a wheel, and its action is a speed.
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| `")]
    table = {row[0][3:-1]: row[2:5] for row in rows if len(row) > 8}
    assert len(table) == 16
    for i, name in enumerate(controller.own.names):
        low, high, scale = table[name]
        assert (low == high == "-") == bool(policy.rolls[i])
        assert float(scale) == pytest.approx(policy.action_scale[i], rel=1e-3)
    assert "| action scale [rad, rad/s of a wheel] |" in text


def test_gravity_of_an_orientation_is_that_of_mujoco(controller: Deployed) -> None:
    for quaternion in np.random.default_rng(2).normal(size=(20, 4)):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, quaternion / np.linalg.norm(quaternion))
        expected = turn.reshape(3, 3).T @ (0, 0, -1)
        np.testing.assert_allclose(controller.gravity(quaternion), expected, atol=1e-12)
