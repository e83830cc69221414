"""The exported policy does what the policy does, and tells a controller all it needs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

import onnx  # noqa: E402
from onnx.reference import ReferenceEvaluator  # noqa: E402

from draft.learn.policy.matching import Structure, structure_of  # noqa: E402
from draft.learn.training.ppo.onnx import export  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.run import Run, create  # noqa: E402
from draft.learn.watching.play import Player  # noqa: E402
from tests.learn.small import member, plan  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning:mujoco_warp.*")
DOCS = Path(__file__).resolve().parents[3] / "docs" / "learning.md"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of a family that sees its design, after one iteration, stage push."""
    of = plan("cheetah", "bear", stage="push", seed=3, see_design=True, ground="flat")
    made = create(tmp_path_factory.mktemp("onnx") / "walk", of, {})
    trainer = Trainer(made, "cpu")
    trainer.train(1)
    trainer.close()
    return made


@pytest.fixture(scope="module")
def player(run: Run) -> Iterator[Player]:
    made = Player(run, "cpu", member="bear")
    yield made
    made.close()


@pytest.fixture(scope="module")
def model(run: Run, player: Player) -> Any:
    path = run.folder / "policy.onnx"
    export(player, run, path)
    assert not list(run.folder.glob(".policy*"))
    return onnx.load(path)


@pytest.fixture(scope="module")
def told(model: Any) -> dict[str, str]:
    found = {entry.key: entry.value for entry in model.metadata_props}
    assert len(found) == len(model.metadata_props)
    return found


def numbers(text: str) -> list[float]:
    return [float(part) for part in text.split(",")]


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


def test_the_normaliser_is_inside(player: Player, model: Any) -> None:
    # After an iteration it is no longer one and nothing.
    normaliser: Any = player.runner.alg.get_policy().obs_normalizer
    assert normaliser.mean.abs().max() > 1e-3
    size = model.graph.input[0].type.tensor_type.shape.dim[1].dim_value
    assert size == player.env.get_observations()["actor"].shape[1]


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
    ranges = [[float(x) for x in pair.split(";")] for pair in told["joint_range"].split(",")]
    assert np.array(ranges) == pytest.approx(np.array(bear.ranges))


def test_places_and_axes_of_the_joints_are_in_the_metadata(told: dict[str, str]) -> None:
    found, expected = Structure.of_texts(told), structure_of(member("bear"))
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


def test_rates_and_ranges_are_in_the_metadata(told: dict[str, str]) -> None:
    assert (float(told["control_rate"]), float(told["physics_timestep"])) == (50.0, 0.005)
    ranges = [[float(x) for x in pair.split(";")] for pair in told["command_ranges"].split(",")]
    assert np.array(ranges) == pytest.approx(np.array([[-1, 1], [-0.6, 0.6], [-0.5, 0.5]]))


def test_the_origin_is_in_the_metadata(told: dict[str, str]) -> None:
    assert told["design"] == "quadruped:bear"
    assert told["designs"] == "quadruped:cheetah,quadruped:bear"
    assert (told["stage"], told["seed"], told["iteration"]) == ("push", "3", "1")
    assert told["run_path"] == "walk"


def test_the_documentation_lists_every_key(told: dict[str, str]) -> None:
    text = DOCS.read_text(encoding="utf-8")
    assert [key for key in told if f"`{key}`" not in text] == []
