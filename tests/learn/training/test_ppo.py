"""The update against rsl-rl's own; normalisation, learning rate and checkpoints."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mjlab")

import torch
from hypothesis import given
from hypothesis import strategies as st
from mjlab.rl import MjlabOnPolicyRunner
from rsl_rl.algorithms import PPO
from rsl_rl.models import MLPModel
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict

from draft.learn.training.ppo import ppo
from draft.learn.training.ppo.agent import agent_settings
from draft.learn.training.ppo.ppo import Ppo
from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.run import Run
from tests.learn import runs
from tests.learn.small import plan

WORLDS, STEPS, ACTIONS = 16, 12, 4
WIDTHS = {"actor": 7, "critic": 9}
NUMBERS: dict[str, Any] = {
    "num_learning_epochs": 1,
    "num_mini_batches": 1,
    "learning_rate": 1e-3,
    "schedule": "adaptive",
    "desired_kl": 0.01,
    "entropy_coef": 0.01,
    "value_loss_coef": 1.0,
}


@pytest.fixture(autouse=True)
def _double() -> Any:
    """Double precision: Adam makes steps of rounding errors where a gradient is next to nothing."""
    torch.set_default_dtype(torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


def observations(drawn: torch.Generator, worlds: int = WORLDS) -> TensorDict:
    """Random observations: of several sizes and means, and one that never changes."""
    values = {}
    for group, width in WIDTHS.items():
        spread = torch.logspace(-3, 1, width)
        values[group] = 5.0 + spread * torch.randn(worlds, width, generator=drawn)
        values[group][:, -1] = 0.3
    return TensorDict(values, batch_size=[worlds])


def algorithm(kind: type[PPO], worlds: int = WORLDS, **numbers: Any) -> Any:
    """An algorithm with the same weights each time."""
    torch.manual_seed(1)
    seen = observations(torch.Generator().manual_seed(0), worlds)
    groups = {name: [name] for name in WIDTHS}
    policy = {"class_name": "GaussianDistribution", "init_std": 0.5}
    more: dict[str, Any] = {"hidden_dims": (16, 8), "obs_normalization": True}
    actor = MLPModel(seen, groups, "actor", ACTIONS, distribution_cfg=policy, **more)
    critic = MLPModel(seen, groups, "critic", 1, **more)
    storage = RolloutStorage("rl", worlds, STEPS, seen, [ACTIONS])
    return kind(actor, critic, storage, **(NUMBERS | numbers))


def collect(alg: Any, seed: int = 0, worlds: int = WORLDS) -> list[TensorDict]:
    """Fill the storage with a rollout of chance; returns what was seen."""
    drawn, found = torch.Generator().manual_seed(seed), []
    torch.manual_seed(seed)
    with torch.no_grad():
        for _ in range(STEPS):
            found.append(observations(drawn, worlds))
            alg.act(found[-1])
            rewards = torch.randn(worlds, generator=drawn)
            dones = torch.rand(worlds, generator=drawn) < 0.1
            out = torch.rand(worlds, generator=drawn) < 0.05
            alg.process_env_step(found[-1], rewards, dones, {"time_outs": out.double()})
        alg.compute_returns(observations(drawn, worlds))
    return found


def settled(kind: type[PPO], **numbers: Any) -> Any:
    """An algorithm that knows the spread of its observations."""
    alg = algorithm(kind, **numbers)
    for model in (alg.actor, alg.critic):
        own = model.obs_normalizer
        own._mean.fill_(5.0)
        own._std = torch.logspace(-3, 1, own._mean.shape[1])[None]
    return alg


def moved(alg: Any, size: float = 0.12) -> None:
    """Move the weights away from those that acted, so that ratios are clipped."""
    drawn = torch.Generator().manual_seed(9)
    with torch.no_grad():
        for values in (*alg.actor.parameters(), *alg.critic.parameters()):
            values.add_(size * torch.randn(values.shape, generator=drawn))


def weights(alg: Any) -> dict[str, torch.Tensor]:
    both = {"actor": alg.actor, "critic": alg.critic}
    named = {f"{k}.{name}": v for k, model in both.items() for name, v in model.named_parameters()}
    return {name: values.detach().clone() for name, values in named.items()}


@pytest.fixture
def still(monkeypatch: pytest.MonkeyPatch) -> None:
    """Statistics of observations stay, as rsl-rl's change during a rollout; one order of samples.

    rsl-rl takes the samples in the same order in every pass.
    """
    monkeypatch.setattr(MLPModel, "update_normalization", lambda self, seen: None)
    monkeypatch.setattr(Ppo, "_normalise", lambda self, model, seen: None)
    order = torch.randperm(WORLDS * STEPS, generator=torch.Generator().manual_seed(3))
    monkeypatch.setattr(torch, "randperm", lambda n, **_: order)


@pytest.mark.usefixtures("still")
@pytest.mark.parametrize("epochs", [1, 3])
@pytest.mark.parametrize("batches", [1, 4])
@pytest.mark.parametrize(
    "numbers",
    [
        {},
        {"schedule": "fixed"},
        {"desired_kl": 1.0},
        {"desired_kl": 1e-4},
        {"max_grad_norm": 0.05},
        {"clip_param": 0.05},
        {"use_clipped_value_loss": False},
        {"entropy_coef": 0.3, "value_loss_coef": 0.2},
    ],
    ids=str,
)
def test_an_update_leads_to_the_weights_of_rsl_rls_update(
    numbers: dict[str, Any], batches: int, epochs: int
) -> None:
    numbers = numbers | {"num_mini_batches": batches, "num_learning_epochs": epochs}
    both = [settled(kind, **numbers) for kind in (PPO, Ppo)]
    losses = []
    for alg in both:
        collect(alg)
        moved(alg)
        before = weights(alg)
        losses.append(alg.update())
    theirs, ours = map(weights, both)
    for name, values in theirs.items():
        torch.testing.assert_close(ours[name], values, atol=1e-9, rtol=1e-9, msg=name)
        assert (values - before[name]).abs().max() > 1e-5  # pyright: ignore[reportPossiblyUnboundVariable]
    assert both[1].learning_rate == both[0].learning_rate
    for name, value in losses[0].items():
        assert losses[1][name] == pytest.approx(value, abs=1e-9), name


@pytest.mark.usefixtures("still")
def test_these_updates_clip_ratios_values_and_gradients() -> None:
    alg = settled(PPO)
    collect(alg)
    moved(alg)
    storage = alg.storage
    seen = storage.observations.flatten(0, 1)
    with torch.no_grad():
        alg.actor(seen, stochastic_output=True)
        new = alg.actor.get_output_log_prob(storage.actions.flatten(0, 1))
        ratio = (new - storage.actions_log_prob.flatten()).exp()
        change = (alg.critic(seen) - storage.values.flatten(0, 1)).abs()
    assert 0.1 < ((ratio - 1).abs() > alg.clip_param).double().mean() < 0.9
    assert 0.1 < (change > alg.clip_param).double().mean() < 0.9
    alg.update()
    assert alg.learning_rate != NUMBERS["learning_rate"]


def test_passes_take_the_samples_in_orders_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    alg = algorithm(Ppo, num_learning_epochs=2, num_mini_batches=3)
    collect(alg)
    batches: list[torch.Tensor] = []
    learn = alg._learn
    monkeypatch.setattr(
        alg, "_learn", lambda *given, **more: batches.append(given[2]) or learn(*given, **more)
    )
    alg.update()
    assert [len(batch) for batch in batches] == [WORLDS * STEPS // 3] * 6
    first, second = (torch.cat(batches[i : i + 3]) for i in (0, 3))
    assert not torch.equal(first, second)
    everything = alg.storage.actions.flatten(0, 1)
    for one in (first, second):
        assert torch.equal(one[one[:, 0].argsort()], everything[everything[:, 0].argsort()])


def test_a_step_is_recorded_as_rsl_rl_records_it() -> None:
    both = [algorithm(kind) for kind in (PPO, Ppo)]
    for alg in both:
        alg.actor.obs_normalizer.eval()  # What it does besides.
        alg.critic.obs_normalizer.eval()
        collect(alg)
    theirs, ours = (alg.storage for alg in both)
    for name in ("rewards", "dones", "values", "actions", "actions_log_prob", "returns"):
        assert torch.equal(getattr(ours, name), getattr(theirs, name)), name
    assert ours.dones.any()


# Normalisation.


def statistics(model: Any) -> list[np.ndarray]:
    own = model.obs_normalizer
    return [values[0].numpy().copy() for values in (own._mean, own._var, own._std)]


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
@pytest.mark.parametrize("iterations", [1, 3])
def test_observations_are_normalised_by_all_samples_so_far(
    iterations: int, dtype: torch.dtype
) -> None:
    torch.set_default_dtype(dtype)
    alg, seen = algorithm(Ppo), []
    for i in range(iterations):
        seen += collect(alg, seed=i)
        alg.update()
    for group, model in (("actor", alg.actor), ("critic", alg.critic)):
        samples = torch.cat([one[group] for one in seen]).double().numpy()
        mean, var, std = statistics(model)
        tight = 1e-9 if dtype is torch.float64 else 2e-4
        np.testing.assert_allclose(mean, samples.mean(0), rtol=1e-6)
        np.testing.assert_allclose(var, samples.var(0), rtol=tight, atol=1e-12)
        np.testing.assert_allclose(std, samples.std(0), rtol=tight, atol=1e-6)
        assert int(model.obs_normalizer.count) == len(samples)


@given(st.floats(-100, 100, width=32), st.integers(1, 3))
def test_an_observation_that_never_changes_is_normalised_to_nothing(
    value: float, iterations: int
) -> None:
    torch.set_default_dtype(torch.float32)
    shape = TensorDict({"actor": torch.zeros(1, 2)}, batch_size=[1])
    model: Any = MLPModel(shape, {"actor": ["actor"]}, "actor", 1, obs_normalization=True)
    values = torch.full((96 * 24, 2), value)
    values[:, 1] += 1e-3 * torch.randn(len(values))
    for _ in range(iterations):
        seen = TensorDict({"actor": values}, batch_size=[len(values)])
        Ppo._normalise(algorithm(Ppo), model, seen)
    found = model.obs_normalizer(values)
    assert found.isfinite().all()
    # A hundredth is added to the standard deviation.
    assert found[:, 0].abs().max() <= 1e-6 * max(1.0, abs(value)) / 0.01
    assert model.obs_normalizer._std[0, 1] == pytest.approx(1e-3, rel=0.1, abs=1e-5 * abs(value))


def test_statistics_stay_during_a_rollout_and_its_update(monkeypatch: pytest.MonkeyPatch) -> None:
    alg = algorithm(Ppo, num_learning_epochs=2, num_mini_batches=2)
    collect(alg)
    alg.update()
    before = statistics(alg.actor)
    kls: list[float] = []
    learn = alg._learn

    def spy(*given: torch.Tensor, **more: Any) -> torch.Tensor:
        assert all(map(np.array_equal, statistics(alg.actor), before))
        found = learn(*given, **more)
        kls.append(float(found[3]))
        return found

    monkeypatch.setattr(alg, "_learn", spy)
    collect(alg, seed=1)
    assert all(map(np.array_equal, statistics(alg.actor), before))
    alg.update()
    assert not np.array_equal(statistics(alg.actor)[0], before[0])
    # No gradient, no divergence.
    assert abs(kls[0]) < 1e-12
    assert min(kls[1:]) > 1e-6


def receive(total: torch.Tensor, values: torch.Tensor) -> None:
    values.copy_(total)


def test_processes_of_unequal_size_share_one_statistic(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes, sent = (5, 8, 3), []
    processes = [algorithm(Ppo, worlds) for worlds in sizes]
    seen = [observations(torch.Generator().manual_seed(n), n) for n in sizes]

    def run(reduce: Callable[[torch.Tensor], Any]) -> None:
        monkeypatch.setattr(ppo.distributed, "all_reduce", reduce)
        for alg, values in zip(processes, seen, strict=True):
            alg.gpu_world_size = 3
            alg._normalise(alg.actor, values)

    for _ in range(2):
        start = [statistics(alg.actor) for alg in processes]
        counts = [alg.actor.obs_normalizer.count.clone() for alg in processes]
        sent.clear()
        run(lambda values: sent.append(values.clone()))  # What each process sends.
        for alg, values, count in zip(processes, start, counts, strict=True):
            own = alg.actor.obs_normalizer
            for name, old in zip(("_mean", "_var", "_std"), values, strict=True):
                getattr(own, name).copy_(torch.from_numpy(old)[None])
            own.count.copy_(count)
        run(partial(receive, torch.stack(sent).sum(0)))
    samples = torch.cat([values["actor"] for values in seen]).numpy()
    for alg in processes:
        mean, var, std = statistics(alg.actor)
        np.testing.assert_allclose(mean, samples.mean(0), rtol=1e-9)
        np.testing.assert_allclose(var, samples.var(0), rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(std, samples.std(0), rtol=1e-9, atol=1e-6)
        assert all(map(np.array_equal, statistics(alg.actor), statistics(processes[0].actor)))
        assert int(alg.actor.obs_normalizer.count) == 2 * sum(sizes)


# Learning rate.


@pytest.mark.parametrize(
    ("numbers", "limit"),
    [
        ({"least_rate": 1e-5, "desired_kl": 1e-9}, 1e-5),
        ({"least_rate": 2e-4, "desired_kl": 1e-9}, 2e-4),
        ({"desired_kl": 1e3}, 1e-2),
    ],
)
def test_the_learning_rate_stays_between_its_floor_and_a_hundredth(
    numbers: dict[str, Any], limit: float
) -> None:
    alg, rates = algorithm(Ppo, num_learning_epochs=10, **numbers), [NUMBERS["learning_rate"]]
    for i in range(4):
        collect(alg, seed=i)
        moved(alg)
        alg.update()
        rates.append(alg.learning_rate)
        assert alg.optimizer.param_groups[0]["lr"] == alg.learning_rate
    assert rates[-1] == limit
    assert all(min(limit, 1e-3) <= rate <= max(limit, 1e-3) for rate in rates)
    assert len(set(rates)) > 1


@pytest.mark.parametrize(
    ("kl", "factor"), [(0.021, 1 / 1.5), (0.019, 1.0), (0.006, 1.0), (0.004, 1.5), (0.0, 1.0)]
)
def test_the_learning_rate_follows_the_divergence(kl: float, factor: float) -> None:
    alg = algorithm(Ppo)
    alg._adapt(kl)
    assert alg.learning_rate == pytest.approx(1e-3 * factor)


def test_the_learning_rate_and_the_entropy_fall_to_a_twentieth() -> None:
    alg = algorithm(Ppo, least_rate=2e-4)
    for share, most in ((0.0, 1e-2), (0.5, 1e-3 * 0.05**0.5), (1.0, 5e-5)):
        alg.decay(share)
        for _ in range(20):
            alg._adapt(0.001)
        assert alg.learning_rate == pytest.approx(most)
        for _ in range(20):
            alg._adapt(1.0)
        assert alg.learning_rate == pytest.approx(min(most, 2e-4))


# Checkpoints.


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A cheetah on a plane after two iterations."""
    torch.set_default_dtype(torch.float32)
    made = runs.begin(tmp_path_factory.mktemp("ppo") / "run", plan(ground="flat"))
    runs.train(made, 2)
    return made


@pytest.fixture
def ours(run: Run, _double: None) -> Trainer:
    """Its trainer, which goes on."""
    torch.set_default_dtype(torch.float32)
    return Trainer(run, "cpu", engine=runs.QUICK)


@pytest.fixture
def theirs(ours: Trainer) -> MjlabOnPolicyRunner:
    """mjlab's runner with rsl-rl's PPO, in the same environment."""
    numbers = agent_settings(ours._run.plan.config, "base", 5)
    numbers["algorithm"]["class_name"] = "rsl_rl.algorithms:PPO"
    for own in ("symmetric", "least_rate"):
        del numbers["algorithm"][own]
    return MjlabOnPolicyRunner(ours._wrapped, numbers, None, "cpu")


def same(a: Any, b: Any) -> bool:
    """Whether actor and critic of two algorithms have the same weights and statistics."""
    both = [(getattr(of, name).state_dict() for of in (a, b)) for name in ("actor", "critic")]
    return all(runs.same(one, other) for one, other in both)


def test_rsl_rls_ppo_in_mjlabs_runner_resumes_from_a_checkpoint(
    run: Run, ours: Trainer, theirs: Any
) -> None:
    assert type(theirs.alg) is PPO
    theirs.load(str(run.checkpoint()[1]))
    alg: Any = ours.runner.alg
    assert same(alg, theirs.alg)
    assert theirs.current_learning_iteration == 2
    states = [of.optimizer.state_dict()["state"] for of in (alg, theirs.alg)]
    assert int(states[0][0]["step"]) == int(states[1][0]["step"]) > 0
    theirs.learn(1)
    assert not same(alg, theirs.alg)


def test_a_checkpoint_of_rsl_rls_ppo_is_gone_on_from(ours: Trainer, theirs: Any) -> None:
    theirs.learn(1)
    alg: Any = ours.runner.alg
    alg.load(theirs.alg.save(), None, strict=True)
    assert same(alg, theirs.alg)
    assert alg.optimizer.param_groups[0]["fused"]
    ours.runner.learn(1)
    assert not same(alg, theirs.alg)
