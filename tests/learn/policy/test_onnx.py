"""The exported policy does what the policy does, and tells a controller all it needs."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

import onnx  # noqa: E402
from onnx.reference import ReferenceEvaluator  # noqa: E402

import draft  # noqa: E402
from draft.learn.policy.controller import Controller  # noqa: E402
from draft.learn.policy.matching import Structure, structure_of  # noqa: E402
from draft.learn.policy.policy import open_policy  # noqa: E402
from draft.learn.training.ppo.onnx import export  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.run import Run  # noqa: E402
from draft.learn.watching.play import Player  # noqa: E402
from tests.learn.runs import QUICK, begin, trained  # noqa: E402
from tests.learn.small import member, plan  # noqa: E402
from tests.learn.task.states import place, turn  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore")
DOCS = Path(__file__).resolve().parents[3] / "docs" / "learning.md"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of a family that sees its design, after one iteration, stage push."""
    of = plan("cheetah", "bear", stage="push", seed=3, see_design=True, ground="flat")
    return trained(tmp_path_factory.mktemp("onnx") / "walk", of)


@pytest.fixture(scope="module")
def player(run: Run) -> Iterator[Player]:
    with contextlib.closing(Player(run, "cpu", member="bear", engine=QUICK)) as made:
        yield made


@pytest.fixture(scope="module")
def model(run: Run, player: Player) -> Any:
    export(player, run, run.folder / "policy.onnx")
    assert not list(run.folder.glob(".policy*"))
    return onnx.load(run.folder / "policy.onnx")


@pytest.fixture(scope="module")
def told(model: Any) -> dict[str, str]:
    found = {entry.key: entry.value for entry in model.metadata_props}
    assert len(found) == len(model.metadata_props)
    return found


def numbers(text: str) -> list[float]:
    return [float(part) for part in text.split(",")]


def pairs(text: str) -> np.ndarray:
    return np.array([[float(x) for x in pair.split(";")] for pair in text.split(",")])


def test_it_acts_as_the_policy_does_on_any_observation(player: Player, model: Any) -> None:
    evaluator = ReferenceEvaluator(model)
    size = player.env.get_observations()["actor"].shape[1]
    draw = torch.Generator().manual_seed(0)
    for spread in (0.1, 1.0, 10.0):
        seen = spread * torch.randn(1, size, generator=draw)
        with torch.inference_mode():
            wanted = player.policy({"actor": seen}).numpy()
        with np.errstate(over="ignore"):  # ONNX's reference of ELU looks at both its branches.
            found: Any = evaluator.run(None, {"obs": seen.numpy()})
        np.testing.assert_allclose(found[0], wanted, rtol=1e-5, atol=1e-5)
    # The normaliser is inside: after an iteration it is no longer one and nothing.
    normaliser: Any = player.runner.alg.get_policy().obs_normalizer
    assert normaliser.mean.abs().max() > 1e-3
    assert model.graph.input[0].type.tensor_type.shape.dim[1].dim_value == size


def test_gains_are_the_designs_own(told: dict[str, str]) -> None:
    torque = member("bear").peak_torque
    assert numbers(told["joint_stiffness"]) == pytest.approx([1.43 * t for t in torque])
    assert numbers(told["joint_damping"]) == pytest.approx([0.071 * t for t in torque])
    assert numbers(told["joint_peak_torque"]) == pytest.approx(torque)
    assert numbers(told["joint_no_load_speed"]) == pytest.approx(member("bear").no_load_speed)


def test_joints_are_listed_in_the_order_of_the_actions(told: dict[str, str]) -> None:
    bear = member("bear")
    assert tuple(told["joint_names"].split(",")) == bear.joints
    assert told["action_names"] == told["joint_names"]
    assert numbers(told["default_joint_pos"]) == pytest.approx(bear.home)
    assert numbers(told["action_scale"]) == pytest.approx([0.175] * 12)
    assert pairs(told["joint_range"]) == pytest.approx(np.array(bear.ranges))
    found, expected = Structure.of_texts(told), structure_of(bear)
    assert found is not None
    assert (found.places, found.axes) == (expected.places, expected.axes)
    assert found.bends == pytest.approx(expected.bends, rel=1e-8)


def test_observations_add_up_to_the_input(told: dict[str, str], model: Any) -> None:
    names = told["observation_names"].split(",")
    dims = [int(part) for part in told["observation_terms_dim"].split(",")]
    assert names[:3] == ["base_lin_vel", "base_ang_vel", "projected_gravity"]
    assert names[-1] == "design"
    assert sum(dims) == model.graph.input[0].type.tensor_type.shape.dim[1].dim_value
    scales = dict(zip(names, numbers(told["observation_terms_scale"]), strict=True))
    assert scales["height_scan"] == pytest.approx(0.2)
    assert dict(zip(names, dims, strict=True))["height_scan"] == 17 * 11


def test_rates_ranges_and_the_origin_are_in_the_metadata(told: dict[str, str]) -> None:
    assert (float(told["control_rate"]), float(told["physics_timestep"])) == (50.0, 0.005)
    largest = np.array([[-1, 1], [-0.6, 0.6], [-0.5, 0.5]])
    assert pairs(told["command_ranges"]) == pytest.approx(largest)
    assert told["design"] == "quadruped:bear"
    assert told["designs"] == "quadruped:cheetah,quadruped:bear"
    assert (told["stage"], told["seed"], told["iteration"]) == ("push", "3", "1")
    assert told["run_path"] == "walk"


def test_the_documentation_lists_every_key(told: dict[str, str]) -> None:
    text = DOCS.read_text(encoding="utf-8")
    assert [key for key in told if f"`{key}`" not in text] == []


# A controller in plain MuJoCo sees and does what mjlab's environment does.

COMMAND = (0.4, 0.1, -0.2)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Player, Controller]]:
    """A policy in mjlab, and its file in plain MuJoCo, on the same engine."""
    pytest.importorskip("mjbatch")
    folder = tmp_path_factory.mktemp("both")
    run = begin(folder / "run", plan(ground="flat", see_ground=False))
    with contextlib.closing(Trainer(run, "cpu", engine="native")) as trainer:
        trainer.keep()
    with contextlib.closing(Player(run, "cpu", command=COMMAND, engine="native")) as player:
        export(player, run, folder / "policy.onnx")
        model = draft.load("quadruped").resolve("cheetah").build().scene()
        yield player, Controller(open_policy(folder / "policy.onnx"), model)


def same_state(player: Player, controller: Controller) -> mujoco.MjData:
    """A tumbling state, in both simulations."""
    player.env.reset()
    random, env = np.random.default_rng(3), player.env.unwrapped
    place(
        env,
        at=(0.3, -0.2, 0.46),
        quat=turn("y", 0.3),
        linear=random.uniform(-0.5, 0.5, 3),
        angular=random.uniform(-0.5, 0.5, 3),
        joints=controller.policy.home + random.uniform(-0.2, 0.2, 12),
        speeds=torch.tensor(random.uniform(-0.5, 0.5, 12), dtype=torch.float32),
    )
    data = mujoco.MjData(controller.model)
    controller.reset(data)
    state: Any = env.sim.data
    data.qpos[:], data.qvel[:] = state.qpos[0].numpy(), state.qvel[0].numpy()
    return data


def seen(player: Player) -> Any:
    return player.env.unwrapped.observation_manager.compute(update_history=True)


def test_both_see_the_same(both: tuple[Player, Controller]) -> None:
    player, controller = both
    data = same_state(player, controller)
    expected = seen(player)["actor"][0].numpy()
    np.testing.assert_allclose(controller.observe(data, COMMAND), expected, atol=2e-5)


def test_both_do_the_same_in_a_control_step(both: tuple[Player, Controller]) -> None:
    player, controller = both
    data = same_state(player, controller)
    with torch.inference_mode():
        action = player.policy(seen(player))
        found = controller.policy(controller.observe(data, COMMAND))
        np.testing.assert_allclose(found, action[0].numpy(), atol=1e-4)
        player.env.step(action)
    for _ in range(4):
        controller.step(data, COMMAND)
    state: Any = player.env.unwrapped.sim.data
    np.testing.assert_allclose(data.qpos[7:], state.qpos[0, 7:].numpy(), atol=1e-5)
    np.testing.assert_allclose(data.qvel[6:], state.qvel[0, 6:].numpy(), atol=1e-3)
