"""Policies of robots on driven wheels: trained, exported, and run in plain MuJoCo."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

import draft  # noqa: E402
from draft.errors import DraftError  # noqa: E402
from draft.learn.bodies.legged import legged_robot  # noqa: E402
from draft.learn.engine.machine import NATIVE  # noqa: E402
from draft.learn.policy.controller import Controller  # noqa: E402
from draft.learn.policy.matching import match, structure_of  # noqa: E402
from draft.learn.policy.playback import playback  # noqa: E402
from draft.learn.policy.policy import SKILLS, Policy, open_policy  # noqa: E402
from draft.learn.policy.policy import policy as shipped_policy  # noqa: E402
from draft.learn.policy.validity import fit  # noqa: E402
from draft.learn.policy.walk import Walk  # noqa: E402
from draft.learn.task.recipes import LAPTOP  # noqa: E402
from draft.learn.training.ppo.onnx import export  # noqa: E402
from draft.learn.training.run import Run  # noqa: E402
from draft.learn.watching.play import Player  # noqa: E402
from draft.model.model import preview  # noqa: E402
from tests.learn.runs import begin, train  # noqa: E402
from tests.learn.small import SMALL, member, plan  # noqa: E402
from tests.learn.task.states import place, turn  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore")
COMMAND = (0.4, 0.1, -0.2)
HINGES = [joint for joint in range(16) if joint % 4 != 3]
WHEELS = [3, 7, 11, 15]
DOCS = Path(__file__).resolve().parents[3] / "docs" / "learning.md"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of the shipped robot on wheels, with the recipe of a CPU, after three iterations."""
    pytest.importorskip("mjbatch")
    of = plan("wheeled", ground="flat", see_ground=False)
    of = replace(of, config=LAPTOP.config.with_values({**SMALL, "episodes.delay": [0.0, 0.0]}))
    run = begin(tmp_path_factory.mktemp("wheels") / "run", of)
    train(run, 1, 3, engine=NATIVE)  # Resumed once.
    return run


@pytest.fixture(scope="module")
def player(run: Run) -> Iterator[Player]:
    with contextlib.closing(Player(run, "cpu", command=COMMAND, engine=NATIVE)) as made:
        export(made, run, run.folder / "policy.onnx")
        yield made


@pytest.fixture(scope="module")
def policy(player: Player, run: Run) -> Policy:
    return open_policy(run.folder / "policy.onnx")


def test_a_robot_on_driven_wheels_trains(run: Run) -> None:
    assert run.done() == 3
    text = (run.folder / "progress.csv").read_text(encoding="utf-8")
    assert "air_time" not in text
    assert "clearance" not in text
    assert "linear_velocity" in text


def test_its_file_states_which_joints_have_a_speed_as_their_target(policy: Policy) -> None:
    robot = member("wheeled")
    assert policy.rolls.tolist() == list(robot.rolls)
    scale = [0.1 * 45.0 if rolls else 0.175 for rolls in robot.rolls]
    assert policy.action_scale == pytest.approx(scale)
    assert policy.stiffness == pytest.approx([0.0 if r else 1.43 * 40.0 for r in robot.rolls])
    assert dict(policy.terms)["joint_pos"] == 12
    assert dict(policy.terms)["joint_vel"] == dict(policy.terms)["actions"] == 16
    assert policy.structure is not None
    assert policy.structure.rolls == robot.rolls
    assert "`joint_rolls`" in DOCS.read_text(encoding="utf-8")
    shipped = shipped_policy("cheetah")
    assert "joint_rolls" not in shipped.network.metadata
    assert not shipped.rolls.any()


def test_torques_of_wheels_follow_the_speed_and_the_line_of_the_motor(policy: Policy) -> None:
    action, angle = np.zeros(16), np.random.default_rng(0).uniform(-40, 40, 16)
    peak, fastest = 8.0, 45.0
    for target, speed in ((4.5, 0.0), (4.5, 4.5), (40.0, 10.0), (0.0, 30.0), (-40.0, 44.0)):
        action[WHEELS] = target / 4.5
        found = policy.torque(action, angle, np.full(16, speed))[WHEELS]
        wanted = 0.071 * peak * (target - speed)
        line = peak * (1 - speed / fastest)
        assert found == pytest.approx(np.clip(wanted, -peak, min(line, peak)), rel=1e-6)


def test_plain_mujoco_rolls_it_as_the_training_does(player: Player, policy: Policy) -> None:
    model = draft.load("wheeled").resolve().build().scene()
    controller = Controller(policy, model)
    player.env.reset()
    random, env = np.random.default_rng(3), player.env.unwrapped
    offsets = random.uniform(-0.2, 0.2, 16)
    offsets[WHEELS] = random.uniform(-20.0, 20.0, 4)  # Wheels at any angle.
    place(
        env,
        at=(0.3, -0.2, 0.49),
        quat=turn("y", 0.1),
        linear=random.uniform(-0.5, 0.5, 3),
        angular=random.uniform(-0.5, 0.5, 3),
        joints=policy.home + offsets,
        speeds=torch.tensor(random.uniform(-3.0, 3.0, 16), dtype=torch.float32),
    )
    data = mujoco.MjData(model)
    controller.reset(data)
    state: Any = env.sim.data
    data.qpos[:], data.qvel[:] = state.qpos[0].numpy(), state.qvel[0].numpy()
    with torch.inference_mode():
        for _ in range(10):
            seen: Any = env.observation_manager.compute(update_history=True)
            expected = seen["actor"][0].numpy()
            np.testing.assert_allclose(controller.observe(data, COMMAND), expected, atol=2e-3)
            player.env.step(player.policy(seen))
            for _ in range(4):
                controller.step(data, COMMAND)
            # Neither is set to the other's state in between.
            np.testing.assert_allclose(data.qpos[:7], state.qpos[0, :7].numpy(), atol=1e-3)
            np.testing.assert_allclose(data.qpos[7:], state.qpos[0, 7:].numpy(), atol=1e-2)


def test_it_is_played_with_its_own_robot_and_commanded(policy: Policy) -> None:
    robot, warning = playback(draft.load("wheeled").resolve(), own=[policy.file])
    assert not warning
    outcome = robot.play(1.0)
    assert np.isfinite((outcome.speed, outcome.error)).all()


def rewritten(folder: Path) -> draft.Design:
    """The same robot with its legs in another order, and axles that point the other way."""
    shipped = Path(draft.__file__).parent / "robots/wheeled"
    folder.mkdir()
    for file in shipped.iterdir():
        text = file.read_text(encoding="utf-8")
        if file.name == "tree.yaml":
            text = text.replace("{name: roll, axis: y,", "{name: spin, axis: -y,")
            *head, fl, fr, rl, rr = text.rstrip().split("\n")
            text = "\n".join([*head, rr, fl, rl, fr, ""])
        (folder / file.name).write_text(text, encoding="utf-8")
    return draft.load(folder).resolve()


def test_it_rolls_a_robot_whose_axles_point_the_other_way_alike(
    policy: Policy, tmp_path: Path
) -> None:
    ways = []
    for design in (draft.load("wheeled").resolve(), rewritten(tmp_path / "other")):
        model = preview(design)
        found = fit(model, policies=[policy])
        assert not found.warning
        walk = Walk(model, found, (0.5, 0.0, 0.2))
        ways.append([])
        for _ in range(10):
            walk.advance(0.1)
            ways[-1].append(walk.data.qpos[:7].copy())
    assert abs(ways[0][-1][:2]).max() > 1e-3
    np.testing.assert_allclose(ways[1], ways[0], atol=1e-3)


def test_a_hinge_in_place_of_a_wheel_is_not_driven_and_neither_is_the_reverse() -> None:
    robot = member("wheeled")
    wheels = structure_of(robot)
    hinges = replace(wheels, rolls=())
    names = robot.joints
    assert match(names, wheels, names, hinges) == (
        "the policy gives FL_roll a speed, and the robot drives it to an angle"
    )
    assert match(names, hinges, names, wheels) == (
        "the policy gives FL_roll an angle, and the robot drives it to a speed"
    )


def test_policies_that_ship_refuse_driven_wheels_and_name_the_training() -> None:
    model = draft.load("wheeled").resolve().build()
    for skill in SKILLS:
        with pytest.raises(DraftError) as caught:
            fit(model, skill)
        (problem,) = caught.value.problems
        assert problem.cause.startswith("no policy drives the joints of wheeled: ")
        words = ', with `recipe="machine"`, from a policy that can run'
        own = words if skill == "machine" else ""
        assert problem.remedy == f"train one: draft train wheeled{own}"


def test_other_motors_of_the_wheels_have_targets_of_their_own(policy: Policy) -> None:
    design = draft.load("wheeled").resolve({"actuators.drive.no_load_speed": 60})
    found = fit(preview(design), policies=[policy])
    assert found.policy.action_scale[WHEELS] == pytest.approx(0.1 * 60.0)
    assert found.policy.action_scale[HINGES] == pytest.approx(0.175)
    assert "no-load speed 60 rad/s (trained at 45)" in found.warning
    assert legged_robot(design).rolls == tuple(policy.rolls)
