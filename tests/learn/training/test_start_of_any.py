"""Trainings of one robot that start from the policy of all legs."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")
pytest.importorskip("mjlab")

from draft import learn  # noqa: E402
from draft.errors import DraftError  # noqa: E402
from draft.learn.engine.machine import obstacle  # noqa: E402
from draft.learn.measuring.policies import config_of  # noqa: E402
from draft.learn.measuring.rollout import review  # noqa: E402
from draft.learn.policy.policy import ANY, open_policy  # noqa: E402
from draft.learn.policy.reduced import open_legs_policy  # noqa: E402
from draft.learn.task.world.access import robot_of  # noqa: E402
from draft.learn.training.options import TrainOptions  # noqa: E402
from draft.learn.training.ppo.legs_onnx import export_legs  # noqa: E402
from draft.learn.training.ppo.onnx import export  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.ppo.warm_start import ALONE  # noqa: E402
from draft.learn.training.progress import FASTEST, PROGRESS, gained  # noqa: E402
from draft.learn.training.run import policy_file  # noqa: E402
from draft.learn.training.train import prepare  # noqa: E402
from draft.learn.watching.play import Player  # noqa: E402
from tests.commands import Command  # noqa: E402
from tests.learn.legs import mixed_plan, random_legs, robot  # noqa: E402
from tests.learn.runs import QUICK  # noqa: E402
from tests.learn.small import plan  # noqa: E402
from tests.learn.training.test_start import agree, learner  # noqa: E402

if obstacle() is not None:
    pytest.skip("needs mjbatch", allow_module_level=True)
FLAT: dict[str, Any] = {"ground": "flat", "see_ground": False}
SYMMETRIC = {"learning.mirror": True}


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return random_legs(tmp_path_factory.mktemp("legs") / "any")


def started(folder: Path, file: Path, name: str, **more: Any) -> Trainer:
    of = replace(plan(values=SYMMETRIC, **{**FLAT, **more}), members=(robot(name),))
    return Trainer(learn.begin(folder, of, {}, file), "cpu", engine=QUICK)


@pytest.mark.parametrize("name", ["quadruped", "biped", "hexapod", "humanoid"])
def test_the_actor_is_the_policy_of_the_robot(file: Path, tmp_path: Path, name: str) -> None:
    trainer, own = started(tmp_path / "run", file, name), open_legs_policy(file)
    agree(trainer, own.of_robot(robot(name)))
    model = learner(trainer).get_policy()
    assert float(learner(trainer)._symmetry.deviation()) < 1e-6
    assert int(model.obs_normalizer.count) == 10_000_000
    assert (model.obs_normalizer._std > 0).all()
    noise = float(own.network.metadata["action_std"].split(",")[0])
    assert model.distribution.std_param.detach().numpy() == pytest.approx(noise)
    asked = own.of_robot(robot(name))
    for actuator in robot_of(trainer.env).actuators:
        for column, joint in enumerate(actuator.target_ids.tolist()):
            kp, kd = (getattr(actuator, one)[0, column] for one in ("stiffness", "damping"))
            assert (float(kp), float(kd)) == pytest.approx(
                (asked.stiffness[joint], asked.damping[joint])
            )
    origin = learn.open_run(tmp_path / "run").plan.origin
    assert origin is not None
    assert origin.policy_file == file


def test_an_export_and_its_evaluation_keep_the_gains_of_the_policy_that_it_started_from(
    file: Path, tmp_path: Path
) -> None:
    weak = replace(robot("quadruped"), peak_torque=(40.0,) * 12)
    of = replace(plan(values=SYMMETRIC, **FLAT), members=(weak,))
    run = learn.begin(tmp_path / "run", of, {}, file)
    assert run.plan.config.actuation.support == 0.6
    with contextlib.closing(Trainer(run, "cpu", engine=QUICK)) as trainer:
        trainer.keep()
    own = open_legs_policy(file).of_robot(weak)
    assert not np.allclose(own.servo_torque, own.peak_torque)
    with contextlib.closing(Player(run, "cpu", engine=QUICK)) as player:
        export(player, run, tmp_path / "own.onnx")
    found = open_policy(tmp_path / "own.onnx")
    assert found.stiffness == pytest.approx(own.stiffness)
    assert found.damping == pytest.approx(own.damping)
    assert config_of(found).actuation == config_of(own).actuation == run.plan.config.actuation
    resumed = learn.begin(tmp_path / "run", of, {}, None)
    assert resumed.plan == run.plan


def test_gains_that_the_policy_does_not_have_are_refused(file: Path, tmp_path: Path) -> None:
    of = plan(values={**SYMMETRIC, "actuation.support": 0.5}, **FLAT)
    with pytest.raises(DraftError, match=r"actuation.support is 0.5, and the .* has 0.6\n.*omit"):
        learn.begin(tmp_path / "run", replace(of, members=(robot("biped"),)), {}, file)
    wheels = replace(of, members=(robot("wheeled"),))
    with pytest.raises(DraftError, match=r"actuation.support is for hip pitch .* drives a wheel"):
        learn.begin(tmp_path / "run", wheels, {}, "scratch")
    assert not (tmp_path / "run").exists()


def test_a_mixture_starts_with_the_policy_itself(file: Path, tmp_path: Path) -> None:
    trainer = Trainer(learn.begin(tmp_path / "run", mixed_plan(), {}, file), "cpu", engine=QUICK)
    own = open_legs_policy(file).network
    seen = torch.randn(3, own.size)
    observed = trainer._seen[:1].expand(3).clone()
    observed["actor"] = seen
    learnt = learner(trainer).get_policy()(observed).detach().numpy()
    assert learnt == pytest.approx(np.stack([own(one) for one in seen.numpy()]), abs=1e-5)
    trainer.train(ALONE + 1)
    export_legs(trainer._run, tmp_path / "more.onnx")
    before, after = (open_legs_policy(one) for one in (file, tmp_path / "more.onnx"))
    for legs, most in before.commands.items():
        assert (np.array(after.commands[legs]) >= most).all()


def test_joints_without_a_slot_and_the_height_scan_are_learnt(file: Path, tmp_path: Path) -> None:
    """Arms hold still at first, and have statistics of their own kind."""
    uneven: dict[str, Any] = {"ground": "uneven", "see_ground": True}
    trainer, member = started(tmp_path / "run", file, "humanoid", **uneven), robot("humanoid")
    model, count = learner(trainer).get_policy(), len(member.joints)
    legs = {joint for leg in member.leg_joints for joint in leg}
    arms = [joint for joint in range(count) if joint not in legs]
    sizes = [dims[0] for dims in trainer.env.observation_manager.group_obs_term_dim["actor"]]
    assert sizes[-1] > count
    assert not model.mlp[0].weight[:, sum(sizes[:-1]) :].any()
    last = model.mlp[-1].weight
    assert not last[arms].any()
    trainer.train(ALONE + 1)
    assert last[arms].any()
    assert model.mlp[0].weight[:, sum(sizes[:-1]) :].any()
    assert (tmp_path / "run" / "model_11.pt").is_file()


def test_a_training_prints_what_it_gained(file: Path, tmp_path: Path, command: Command) -> None:
    small = "--envs 4 --replicas 1 --iterations 4 --set learning.steps=4 learning.hidden=16,16"
    out = tmp_path / "run"
    said = command(f"train biped --from {file} {small} --no-review --out", out).out
    text = gained(out / PROGRESS)
    assert text is not None
    assert text in said
    assert re.search(r"missed by \d.\d\d m/s, at first .*by \d.\d\d m/s.*of 2 iterations", text)
    assert f"starts from {file}, policy: iteration 0" in said
    run = learn.open_run(out)
    assert review.before(run, "cpu", QUICK, 2)


def test_the_policy_of_all_legs_is_named_by_a_word() -> None:
    assert policy_file("any") == ANY


def test_a_training_in_which_no_episode_ended_says_nothing_of_falls(tmp_path: Path) -> None:
    rows = ["iteration,tracking_error,falls", "1,0.27,nan", "2,0.16,nan"]
    (tmp_path / PROGRESS).write_text("\n".join(rows) + "\n", encoding="utf-8")
    assert gained(tmp_path / PROGRESS) == (
        "gained in training: commands are missed by 0.16 m/s, at first by 0.27 m/s "
        "(means of 1 iteration)"
    )


def test_a_gain_names_the_commands_that_grew(tmp_path: Path) -> None:
    rows = [f"iteration,tracking_error,falls,{FASTEST}", "1,0.30,0.5,0.6", "2,0.34,0.1,1.5"]
    (tmp_path / PROGRESS).write_text("\n".join(rows) + "\n", encoding="utf-8")
    assert gained(tmp_path / PROGRESS) == (
        "gained in training: commands of up to 1.50 m/s are missed by 0.34 m/s, at first those of "
        "up to 0.60 m/s by 0.30 m/s, and 10% of episodes end in a fall, at first 50% "
        "(means of 1 iteration)"
    )


def changed(file: Path, folder: Path, change: Callable[[Any], None]) -> Path:
    model = onnx.load(str(file))
    change(model)
    onnx.save(model, str(folder / "changed.onnx"))
    return folder / "changed.onnx"


def not_finite(model: Any) -> None:
    tensor = next(one for one in model.graph.initializer if one.name == "weight1")
    values = onnx.numpy_helper.to_array(tensor).copy()
    values[0, 0] = np.nan
    tensor.CopyFrom(onnx.numpy_helper.from_array(values, tensor.name))


def other_layout(model: Any) -> None:
    for entry in model.metadata_props:
        if entry.key == "layout":
            entry.value = "tokens"


def negative_noise(model: Any) -> None:
    onnx.helper.set_model_props(
        model, {one.key: one.value for one in model.metadata_props} | {"velocity_noise": "-0.1"}
    )


def other_slots(model: Any) -> None:
    for tensor in model.graph.initializer:
        if tensor.name in ("weight2", "bias2"):
            values = onnx.numpy_helper.to_array(tensor)[:-1]
            tensor.CopyFrom(onnx.numpy_helper.from_array(values, tensor.name))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (not_finite, "its numbers are not finite"),
        (other_layout, "its layout is 'tokens'"),
        (other_slots, "it has not 36 outputs"),
        (negative_noise, "velocity_noise is -0.1, and no number that is 0 or more"),
    ],
)
def test_another_file_is_refused(
    file: Path, tmp_path: Path, change: Callable[[Any], None], message: str
) -> None:
    wrong = changed(file, tmp_path, change)
    with pytest.raises(DraftError, match=message):
        started(tmp_path / "run", wrong, "biped")
    assert not (tmp_path / "run").exists()


def test_what_the_policy_cannot_drive_is_refused(file: Path, tmp_path: Path) -> None:
    for name, message in (("hopper", "left and right legs"),):
        with pytest.raises(DraftError, match=message):
            prepare(name, tmp_path / "run", TrainOptions(origin=file, device="cpu"))
    biped = robot("biped")
    long = replace(biped, leg_joints=(tuple(sum(biped.leg_joints, ())),) * 2)
    several = (robot("biped"), replace(robot("biped"), name="other"))
    for members, message in (((long,), "more than"), (several, "the policy of one robot")):
        of = replace(plan(**FLAT), members=members)
        with pytest.raises(DraftError, match=message):
            learn.begin(tmp_path / "run", of, {}, file)
    with pytest.raises(DraftError, match="does not start from the run 'elsewhere'"):
        learn.begin(tmp_path / "run", mixed_plan(), {}, "elsewhere")
    assert not (tmp_path / "run").exists()
