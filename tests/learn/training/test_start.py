"""Trainings that start from an exported policy."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

import draft  # noqa: E402
from draft import learn  # noqa: E402
from draft.errors import DraftError  # noqa: E402
from draft.learn.bodies.legged import legged_robot  # noqa: E402
from draft.learn.measuring.policies import commanded, open_source  # noqa: E402
from draft.learn.policy.matching import Match, match_of  # noqa: E402
from draft.learn.policy.policy import FAMILY, Policy, open_policy  # noqa: E402
from draft.learn.policy.sensed import with_inputs  # noqa: E402
from draft.learn.task.recipes import LAPTOP, RecipeName  # noqa: E402
from draft.learn.training.options import SliceOptions, TrainOptions  # noqa: E402
from draft.learn.training.ppo.ppo import action_std  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.ppo.warm_start import ALONE  # noqa: E402
from draft.learn.training.progress import PROGRESS, fastest  # noqa: E402
from draft.learn.training.session import origin_line  # noqa: E402
from draft.learn.training.train import prepare  # noqa: E402
from tests.learn.policy.test_matching import LEGS, SIGNS, made, tree  # noqa: E402
from tests.learn.runs import QUICK, exported, train, trained, weights  # noqa: E402
from tests.learn.small import member, plan  # noqa: E402

FLAT: dict[str, Any] = {"ground": "flat", "see_ground": False}
pytestmark = pytest.mark.filterwarnings("ignore::UserWarning:mujoco_warp.*")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Policy of the cheetah after one iteration, which does not see its design."""
    return exported(trained(tmp_path_factory.mktemp("start") / "walk", plan(**FLAT)))


def started(folder: Path, origin: str | Path, **more: Any) -> Trainer:
    """A trainer that starts from a policy, of stage push on a plane unless stated."""
    of = plan(**{"stage": "push", **FLAT, **more})
    return Trainer(learn.begin(folder, of, {}, origin), "cpu", engine=QUICK)


def learner(trainer: Trainer) -> Any:
    return trainer.runner.alg


def agree(trainer: Trainer, policy: Policy) -> None:
    """Check that the mean actions of the trainer's actor are those of a policy."""
    model = learner(trainer).get_policy()
    seen = np.random.default_rng(0).normal(size=(20, policy.network.size)).astype(np.float32)
    with torch.inference_mode():
        found = model.mlp(model.obs_normalizer(torch.from_numpy(seen))).numpy()
    np.testing.assert_allclose(found, policy(seen), atol=2e-5)


def test_the_actor_is_that_of_the_file_and_its_noise_too(file: Path, tmp_path: Path) -> None:
    policy = open_policy(file)
    assert policy.action_std.shape == (12,)
    trainer = started(tmp_path / "run", file)
    agree(trainer, policy)
    own = action_std(learner(trainer).get_policy()).detach().numpy()
    np.testing.assert_allclose(own, policy.action_std, rtol=1e-6)
    origin = learn.open_run(tmp_path / "run").plan.origin
    assert origin is not None
    assert (origin.run, origin.iteration) == (str(file), 1)


def test_the_critic_learns_alone_at_first_and_the_actor_gently_then(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer = started(tmp_path / "run", file)
    alg = learner(trainer)

    def weights(model: Any) -> Any:
        return torch.cat([one.flatten().clone() for one in model.state_dict().values()])

    actor, critic, rate = weights(alg.actor), weights(alg.critic), alg.learning_rate
    trainer.train(ALONE)
    assert torch.equal(weights(alg.actor), actor)
    assert not torch.equal(weights(alg.critic), critic)
    assert alg.learning_rate == rate
    # Steps without a gradient would count in Adam's averages, and the actor's first be too long.
    assert not any(alg.optimizer.state.get(one) for one in alg.actor.parameters())
    rates: list[float] = []
    update = alg.update

    def seen() -> dict[str, float]:
        rates.append(alg.learning_rate)
        return update()

    monkeypatch.setattr(alg, "update", seen)
    trainer.train(ALONE + 1)
    assert not torch.equal(weights(alg.actor), actor)
    assert rates == [alg.least_rate]  # Those of a new policy would undo what it can do.


def test_values_of_a_critic_that_learns_alone_are_not_clipped(file: Path, tmp_path: Path) -> None:
    alg = learner(started(tmp_path / "run", file))
    rows, zero = 8, torch.zeros(8, 1)
    seen = torch.randn(rows, alg.critic.mlp[0].in_features)
    own = torch.randn(rows, alg.actor.mlp[0].in_features)
    values = alg.critic.mlp(seen).detach()
    std = action_std(alg.actor).detach().expand(rows, -1)

    def loss(alone: bool) -> float:
        alg.learns_actor = not alone
        state = {name: one.clone() for name, one in alg.critic.state_dict().items()}
        old = values + 10.0  # Far from what it says now: clipping would bring it back near that.
        mean = alg.actor.mlp(own).detach()
        rest = (mean, old, zero, values, zero, mean, std)
        found = float(alg._learn(own, seen, *rest, present=None, taught=None)[0])
        alg.critic.load_state_dict(state)
        return found

    assert loss(alone=True) == pytest.approx(0.0, abs=1e-9)
    assert loss(alone=False) > 50.0


HIDDEN = {"learning.hidden": LAPTOP.config.learning.hidden}  # Of the family's policy.


def test_a_policy_of_the_package_is_named_by_a_word(tmp_path: Path) -> None:
    trainer = started(tmp_path / "run", "family", values=HIDDEN | {"learning.mirror": True})
    run = learn.open_run(tmp_path / "run")
    assert run.plan.see_design
    assert run.plan.origin is not None
    assert run.plan.origin.run == "family"
    agree(trainer, open_policy(FAMILY))
    # Features of one design do not vary: their statistics must stay those of the family, when the
    # actor learns too.
    before = learner(trainer).get_policy().obs_normalizer.mean
    trainer.train(ALONE + 1)
    moved = (learner(trainer).get_policy().obs_normalizer.mean - before).abs().max()
    assert 0 < moved < 1e-4


def test_a_policy_that_learns_to_climb_keeps_what_it_knows_of_designs(tmp_path: Path) -> None:
    uneven: dict[str, Any] = {"ground": "uneven", "see_ground": True}
    trainer = started(tmp_path / "run", "family", stage="terrain", values=HIDDEN, **uneven)
    normaliser = learner(trainer).get_policy().obs_normalizer
    # As many samples as an exported policy's count for: one design's own move them little.
    assert int(normaliser.count) == 10_000_000
    assert normaliser.mean.shape[-1] > open_policy(FAMILY).network.size


# What a machine observes: no velocity, and three steps of the rest.
SENSED = HIDDEN | {"observations.linear_velocity": False, "observations.history": 3}


def with_lessons(folder: Path, lessons: int, **more: Any) -> Trainer:
    return started(folder, "family", values=SENSED | {"learning.lessons": lessons}, **more)


def test_an_actor_without_the_velocity_first_acts_as_if_commands_were_followed(
    tmp_path: Path,
) -> None:
    trainer, policy = with_lessons(tmp_path / "run", 0), open_policy(FAMILY)
    manager = trainer.env.observation_manager
    names, dims = manager.active_terms["actor"], manager.group_obs_term_dim["actor"]
    terms = [(name, dim[0]) for name, dim in zip(names, dims, strict=True)]
    past = [manager.get_term_cfg("actor", name).history_length or 1 for name in names]
    agree(trainer, with_inputs(policy, terms, past))
    # Without lessons the critic alone learns, as for any exported policy.
    assert learner(trainer).teacher is None


def test_an_actor_imitates_the_policy_that_it_starts_from(tmp_path: Path) -> None:
    trainer = with_lessons(tmp_path / "run", 12, environments=32)
    alg, lost = learner(trainer), []
    noise = action_std(alg.actor).detach().clone()
    trainer.train(12, report=lambda one: lost.append(one.row["loss/difference"]))
    assert max(lost[-3:]) < 0.7 * lost[0]
    assert torch.equal(action_std(alg.actor).detach(), noise)
    assert not any(alg.optimizer.state.get(one) for one in alg.actor.distribution.parameters())
    # Then it learns from rewards, and has no teacher.
    trainer.train(13, report=lambda one: lost.append(one.row["loss/difference"]))
    assert alg.teacher is None
    assert lost[-1] == 0.0
    assert not torch.equal(action_std(alg.actor).detach(), noise)


def test_what_is_imitated_is_said_before(tmp_path: Path) -> None:
    def line(**values: Any) -> str | None:
        name = f"run {len([*tmp_path.iterdir()])}"
        of = plan(stage="push", values=HIDDEN | values, **FLAT)
        run = learn.begin(tmp_path / name, of, {}, "family")
        return origin_line(run.plan, tmp_path)

    usual = line(**{"learning.lessons": 12})
    assert usual == f"starts from family, policy: iteration {open_policy(FAMILY).iterations}"
    assert (
        line(**SENSED | {"learning.lessons": 12}) == f"{usual}, which it imitates for 12 iterations"
    )
    assert line(**SENSED) == usual


def test_a_teacher_acts_by_what_the_critic_observes(tmp_path: Path) -> None:
    """It sees the true velocity, joints without their bias, and nothing of the feet."""
    trainer, policy = with_lessons(tmp_path / "run", 12), open_policy(FAMILY)
    seen = trainer.runner.env.get_observations()["critic"]
    sizes = [dim[0] for dim in trainer.env.observation_manager.group_obs_term_dim["critic"]]
    names = trainer.env.observation_manager.active_terms["critic"]
    parts = dict(zip(names, seen.split(sizes, dim=1), strict=True))
    own = torch.cat([parts[name] for name, _ in policy.terms], dim=1)
    found = learner(trainer).teacher(seen)
    np.testing.assert_allclose(found.numpy(), policy(own.numpy()), atol=2e-5)


def test_lessons_go_on_where_they_stopped(tmp_path: Path) -> None:
    of = plan(stage="push", values=SENSED | {"learning.lessons": 4}, **FLAT)
    whole, parts = (
        train(learn.begin(tmp_path / name, of, {}, "family"), *slices)
        for name, slices in (("whole", (6,)), ("parts", (3, 5, 6)))
    )
    one, other = weights(whole), weights(parts)
    assert all(torch.equal(one[name], other[name]) for name in one)


def test_a_run_that_starts_anew_is_known_to_run_as_fast_as_its_policy(tmp_path: Path) -> None:
    of = HIDDEN | {"velocity.growth": 0.2}
    trainer = started(tmp_path / "run", "family", stage="velocity", values=of)
    trainer.train(1)
    run = learn.open_run(tmp_path / "run")
    # No robot has restarted yet, and the speed is recorded all the same.
    assert fastest(run.folder / PROGRESS) == pytest.approx(1.0)
    family, (robot,) = open_policy(FAMILY), run.plan.members
    own = family.forward * (robot.leg_length / family.leg_length) ** 0.5
    assert commanded(run) == open_source(run.folder).forward == pytest.approx(own)
    other = learn.begin(tmp_path / "push", plan(stage="push", values=of, **FLAT), {}, "family")
    assert commanded(other) is None


def test_a_policy_that_can_run_is_tuned_in_a_quarter_of_the_iterations(tmp_path: Path) -> None:
    def prepared(recipe: str) -> Any:
        words: dict[str, Any] = {"stage": "velocity", "origin": "family", "device": "cpu"}
        return prepare("cheetah", tmp_path / recipe, TrainOptions.of({"recipe": recipe, **words}))

    usual, tuned = prepared("laptop"), prepared("tune")
    own = LAPTOP.config.iterations
    assert 4 * SliceOptions().total(tuned.plan) == own("base") + own("velocity")
    # Commands do not outgrow the body, and gaits keep the power that the family learnt to save.
    assert tuned.plan.config.velocity.missed == usual.plan.config.velocity.missed > 0
    assert tuned.plan.config.rewards.power_weight < usual.plan.config.rewards.power_weight == 0
    assert tuned.plan.ground == "flat"
    # A run that exists goes on without its policy being named again.
    options = TrainOptions(stage="velocity", recipe="tune", device="cpu")
    again = prepare("cheetah", tmp_path / "tune", options)
    assert again.plan == tuned.plan


@pytest.mark.parametrize("recipe", ["tune", "machine"])
@pytest.mark.parametrize("origin", [None, "scratch"])
def test_nothing_is_tuned_from_nothing(
    origin: str | None, recipe: RecipeName, tmp_path: Path
) -> None:
    options = TrainOptions(stage="velocity", origin=origin, recipe=recipe)
    with pytest.raises(DraftError, match=f"recipe {recipe} starts from a policy") as caught:
        prepare("cheetah", tmp_path / "run", options)
    assert '`origin="family"`' in str(caught.value)
    assert not (tmp_path / "run").exists()


OTHER = replace(member(), home=tuple(-angle for angle in member().home))  # Knees to the front.


@pytest.mark.parametrize(
    ("origin", "change", "message"),
    [
        ("nowhere.onnx", {}, "cannot read nowhere.onnx"),
        ("{file}", {"members": (member("bear"),)}, "is of another design than quadruped:bear: "),
        ("{file}", {"see_design": True}, "was trained without `see_design`"),
        (
            "{file}",
            {"config": plan(values={"learning.hidden": [8, 8]}).config},
            "`values` learning.hidden=16,16",
        ),
        ("{broken}", {}, "is not a policy that Draft can read"),
        ("family", {"members": (OTHER,)}, "does not drive the joints of"),
    ],
)
def test_policies_that_do_not_fit_are_refused(
    file: Path, tmp_path: Path, origin: str, change: dict[str, Any], message: str
) -> None:
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(file.read_bytes()[:2000])
    of = replace(plan(stage="push", **FLAT), **change)
    name = origin.format(file=file, broken=broken)
    with pytest.raises(DraftError, match=re.escape(message)):
        Trainer(learn.begin(tmp_path / "run", of, {}, name), "cpu", engine=QUICK)


def test_a_file_that_changed_since_is_not_taken(file: Path, tmp_path: Path) -> None:
    copy = tmp_path / "policy.onnx"
    copy.write_bytes(file.read_bytes())
    run = learn.begin(tmp_path / "run", plan(stage="push", **FLAT), {}, copy)
    copy.write_bytes(FAMILY.read_bytes())
    with pytest.raises(DraftError, match="has changed since"):
        Trainer(run, "cpu", engine=QUICK)
    copy.unlink()
    with pytest.raises(DraftError, match="has changed since"):
        Trainer(run, "cpu", engine=QUICK)


def test_a_robot_with_other_joints_starts_as_it_is_driven(tmp_path: Path) -> None:
    """Its network gives what the policy gives, with the joints and signs of the robot."""
    shipped = Path(draft.__file__).parent / "robots/quadruped"
    model = made(tmp_path / "robot", shipped, tree(("a", "b", "c"), SIGNS, LEGS[::-1]))
    robot, policy = legged_robot(model.design, model), open_policy(FAMILY)
    found = match_of(policy, robot)
    assert isinstance(found, Match)
    of = replace(plan(stage="push", values=HIDDEN | {"learning.mirror": True}, **FLAT))
    run = learn.begin(tmp_path / "run", replace(of, members=(robot,)), {}, "family")
    actor = learner(Trainer(run, "cpu", engine=QUICK)).get_policy()
    seen = np.random.default_rng(0).normal(size=(5, policy.network.size)).astype(np.float32)
    theirs, sign, start = seen.copy(), np.array(found.sign), 0
    for _, length in policy.terms:
        if length == len(sign):
            own = seen[:, start : start + length]
            theirs[:, start : start + length] = own[:, list(found.joints)] * sign
        start += length
    wanted = np.zeros((5, 12))
    wanted[:, list(found.joints)] = policy(theirs) * sign
    with torch.inference_mode():
        given = actor.mlp(actor.obs_normalizer(torch.from_numpy(seen))).numpy()
    np.testing.assert_allclose(given, wanted, atol=2e-5)
    assert not found.same
