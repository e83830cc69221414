"""Mirror-symmetric networks: exactly so, always, and what mirrored samples would have taught."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("mjlab")

import torch
from hypothesis import given
from hypothesis import strategies as st
from mjlab.rl import RslRlVecEnvWrapper
from tensordict import TensorDict

from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.machine import obstacle
from draft.learn.engine.worlds.simulate import make
from draft.learn.task.config import Config
from draft.learn.task.mdp.environment import environment
from draft.learn.task.world.mirror import Flip, flips
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.agent import Runner, agent, agent_settings
from draft.learn.training.ppo.ppo import Ppo
from draft.learn.training.ppo.symmetry import Symmetric

VALUES = {"learning.mirror": True, "learning.hidden": [16, 12], "learning.steps": 6}
MIRRORED = Config().with_values(VALUES)
PLAIN = {"learning.mirror": False}
SEEDS = st.integers(0, 2**31 - 1)


@pytest.fixture(scope="module")
def env(members: tuple[LeggedRobot, ...]) -> Iterator[Any]:
    """Eight cheetahs on a plane, which see their design: numbers that never change."""
    task = Task(members[:1], ground="flat", see_design=True)
    engine = "native" if obstacle() is None else "warp"
    made = make(environment(task, 8), "cpu", engine)
    yield made
    made.close()


def runner(env: Any, **values: Any) -> Any:
    """A runner with the numbers of these tests, and some others."""
    config = Config().with_values(VALUES | values)
    return Runner(RslRlVecEnvWrapper(env), agent_settings(config, "base", 1), None, "cpu")


def practise(of: Any, iterations: int) -> None:
    """Learn from rollouts, as training does."""
    alg, seen = of.alg, of.env.get_observations()
    for _ in range(iterations):
        with torch.no_grad():
            for _ in range(MIRRORED.learning.steps):
                seen, rewards, dones, extras = of.env.step(alg.act(seen))
                alg.process_env_step(seen, rewards, dones, extras)
            alg.compute_returns(seen)
        alg.update()


@pytest.fixture(scope="module")
def fresh(env: Any) -> Any:
    """An algorithm that has learnt nothing."""
    return runner(env).alg


@pytest.fixture(scope="module")
def practised(env: Any) -> Any:
    """An algorithm after 20 iterations of 20 mini-batches."""
    made = runner(env)
    before = parameters(made.alg)
    practise(made, 20)
    moved = [(a - b).abs().max() for a, b in zip(parameters(made.alg), before, strict=True)]
    assert min(moved) > 1e-3
    return made.alg


@pytest.fixture(params=["fresh", "practised"])
def alg(request: pytest.FixtureRequest) -> Any:
    """Either of them."""
    return request.getfixturevalue(request.param)


def parameters(alg: Any) -> list[torch.Tensor]:
    both = (*alg.actor.parameters(), *alg.critic.parameters())
    return [values.detach().clone() for values in both]


def observations(env: Any, seed: int, count: int = 16) -> TensorDict:
    """Random observations, some far out."""
    drawn = torch.Generator().manual_seed(seed)
    widths = {name: sum(d[0] for d in dims) for name, dims in dimensions(env).items()}
    values = {name: 3 * torch.randn(count, n, generator=drawn) for name, n in widths.items()}
    return TensorDict(values, batch_size=[count])


def dimensions(env: Any) -> dict[str, Any]:
    return env.observation_manager.group_obs_term_dim


def mirrored(env: Any, seen: TensorDict) -> TensorDict:
    known = flips(env)
    images = {name: known[name](seen[name]) for name in dimensions(env)}
    return TensorDict(images, batch_size=seen.batch_size)


def seen_twice(env: Any, alg: Any, seed: int) -> tuple[torch.Tensor, ...]:
    """Actions for observations and for their images, and values of both."""
    seen = observations(env, seed).double()  # In single precision sums of two orders differ.
    exact = [copy.deepcopy(model).double() for model in (alg.actor, alg.critic)]
    with torch.no_grad():
        both = [(model(seen), model(mirrored(env, seen))) for model in exact]
    return *both[0], *both[1]


@given(SEEDS)
def test_mirrored_observations_lead_to_mirrored_actions_and_are_worth_as_much(
    env: Any, alg: Any, seed: int
) -> None:
    action, image, value, worth = seen_twice(env, alg, seed)
    torch.testing.assert_close(image, flips(env)["actions"](action), atol=1e-9, rtol=1e-9)
    assert (image - action).abs().max() > 1e-3
    torch.testing.assert_close(worth, value, atol=1e-9, rtol=1e-9)
    assert value.std() > 1e-3


def test_networks_that_are_not_symmetric_do_not_pass_these_tests(env: Any) -> None:
    action, image, value, worth = seen_twice(env, runner(env, **PLAIN).alg, 0)
    assert (image - flips(env)["actions"](action)).abs().max() > 0.01
    assert (worth - value).abs().max() > 0.01


def matrix(flip: Flip) -> torch.Tensor:
    """A mirror image as a matrix, whose products with numbers are exact."""
    return torch.eye(len(flip.source))[flip.source] * flip.sign[:, None]


def swap(units: int) -> torch.Tensor:
    """The image of a hidden layer: its halves swapped."""
    return torch.eye(units).roll(units // 2, 0)


def check_symmetric(alg: Any, env: Any) -> None:
    """Check that all weights and statistics are their own images, bit by bit."""
    known = flips(env)
    for model, seen, out in (
        (alg.actor, matrix(known["actor"]), matrix(known["actions"])),
        (alg.critic, matrix(known["critic"]), torch.eye(1)),
    ):
        sides = [seen, swap(16), swap(12), out]
        layers = [layer for layer in model.mlp if isinstance(layer, torch.nn.Linear)]
        assert len(layers) == 3
        for layer, before, after in zip(layers, sides, sides[1:], strict=False):
            assert torch.equal(after @ layer.weight @ before.T, layer.weight)
            assert torch.equal(after @ layer.bias, layer.bias)
        statistics = model.obs_normalizer
        assert torch.equal(statistics._mean @ seen.T, statistics._mean)
        assert torch.equal(statistics._var @ seen.abs().T, statistics._var)
        assert torch.equal(statistics._std @ seen.abs().T, statistics._std)
    std = alg.actor.distribution.std_param
    assert torch.equal(matrix(known["actions"]).abs() @ std, std)


def test_weights_and_statistics_are_their_own_images_bit_by_bit(env: Any, alg: Any) -> None:
    check_symmetric(alg, env)
    assert not torch.equal(alg.actor.mlp[0].weight[:8], alg.actor.mlp[0].weight[8:])


def test_no_step_of_an_update_leaves_the_symmetric_networks(
    env: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = runner(env)
    alg, steps, known = made.alg, [], matrix(flips(env)["actor"])
    learn = alg._learn

    def spy(*given: torch.Tensor, **more: Any) -> torch.Tensor:
        before = alg.actor.mlp[0].weight.detach().clone()
        found = learn(*given, **more)
        weight = alg.actor.mlp[0].weight.detach()
        torch.testing.assert_close(swap(16) @ weight @ known.T, weight, atol=1e-7, rtol=1e-5)
        steps.append(float((weight - before).abs().max()))
        return found

    monkeypatch.setattr(alg, "_learn", spy)
    practise(made, 1)
    assert len(steps) == 20  # Five passes of four mini-batches.
    assert min(steps) > 5e-6


def symmetric(env: Any, alg: Any) -> Symmetric:
    known = flips(env)
    return Symmetric(alg.actor, alg.critic, known["actor"], known["critic"], known["actions"])


def spoil(alg: Any) -> None:
    """Give networks and statistics without symmetry."""
    drawn = torch.Generator().manual_seed(5)
    with torch.no_grad():
        for values in (*alg.actor.parameters(), *alg.critic.parameters()):
            values.copy_(0.1 + torch.rand(values.shape, generator=drawn))
        for model in (alg.actor, alg.critic):
            for values in (model.obs_normalizer._mean, model.obs_normalizer._var):
                values.copy_(torch.rand(values.shape, generator=drawn))


def test_the_projection_of_a_projection_is_itself(env: Any) -> None:
    alg = runner(env, **PLAIN).alg
    spoil(alg)
    image = symmetric(env, alg)
    spoilt = parameters(alg)
    image.project()
    once = parameters(alg), alg.actor.obs_normalizer._var.clone()
    changed = [not torch.equal(a, b) for a, b in zip(once[0], spoilt, strict=True)]
    assert changed == [*[True] * 12, False]  # The bias of the value is its own image.
    check_symmetric(alg, env)
    image.project()
    assert all(torch.equal(a, b) for a, b in zip(parameters(alg), once[0], strict=True))
    assert torch.equal(alg.actor.obs_normalizer._var, once[1])


def test_the_projection_is_the_nearest(env: Any) -> None:
    # What it takes away is at right angles to every symmetric network.
    alg, other = (runner(env, **PLAIN).alg for _ in range(2))
    spoil(alg)
    before = parameters(alg)
    symmetric(env, alg).project()
    symmetric(env, other).project()
    taken = [a - b for a, b in zip(before, parameters(alg), strict=True)]
    for gone, kept in zip(taken, parameters(other), strict=True):
        size = float(gone.norm() * kept.norm())
        assert abs(float((gone * kept).sum())) < 1e-5 * max(size, 1e-6)


def test_statistics_are_those_of_the_samples_and_their_images(env: Any) -> None:
    alg = runner(env, **PLAIN).alg
    seen = observations(env, 3, 500)["actor"] + torch.linspace(-2, 2, alg.actor.obs_dim)
    both = torch.cat((seen, flips(env)["actor"](seen))).double()
    statistics = alg.actor.obs_normalizer
    statistics._mean.copy_(seen.mean(0))
    statistics._var.copy_(seen.var(0, unbiased=False))
    symmetric(env, alg).project_statistics()
    torch.testing.assert_close(statistics.mean.double(), both.mean(0), atol=1e-6, rtol=1e-5)
    expected = both.var(0, unbiased=False)
    torch.testing.assert_close(statistics._var[0].double(), expected, atol=1e-6, rtol=1e-5)
    torch.testing.assert_close(statistics._std, statistics._var.sqrt())


def loss(alg: Any, seen: TensorDict, actions: torch.Tensor, drawn: torch.Generator) -> torch.Tensor:
    """The loss of PPO in other words: torch's own normal distribution, one sample at a time."""
    policy = torch.distributions.Normal(alg.actor(seen), alg.actor.distribution.std_param)
    count = len(actions)
    advantage, old, worth = torch.randn(3, count, generator=drawn).double()
    log = policy.log_prob(actions).sum(1)
    ratio = (log - log.detach() + 0.3 * old).exp()
    clipped = torch.min(ratio * advantage, ratio.clamp(0.8, 1.2) * advantage)
    value = (alg.critic(seen)[:, 0] - worth).square()
    return -clipped.mean() + value.mean() - 0.01 * policy.entropy().sum(1).mean()


def gradients(alg: Any) -> list[torch.Tensor]:
    both = (*alg.actor.parameters(), *alg.critic.parameters())
    return [values.grad.clone() for values in both]


@given(SEEDS)
def test_the_projected_gradient_is_the_mean_of_those_of_samples_and_images(
    env: Any, double: tuple[Any, Symmetric], seed: int
) -> None:
    alg, image = double
    seen = observations(env, seed).double()
    actions = torch.randn(16, 12, generator=torch.Generator().manual_seed(seed)).double()
    samples = (mirrored(env, seen), flips(env)["actions"](actions)), (seen, actions)
    found = []
    for states, moves in samples:
        for values in (*alg.actor.parameters(), *alg.critic.parameters()):
            values.grad = None
        loss(alg, states, moves, torch.Generator().manual_seed(seed + 1)).backward()
        found.append(gradients(alg))
    image.project_gradients()
    projected = gradients(alg)
    for ours, one, other in zip(projected, *found, strict=True):
        torch.testing.assert_close(ours, (one + other) / 2, atol=1e-12, rtol=1e-10)
    apart = [(one - other).abs().max() > 1e-3 for one, other in zip(*found, strict=True)]
    assert sum(apart) == 12  # All but the bias of the value.


@pytest.fixture(scope="module")
def double(env: Any) -> tuple[Any, Symmetric]:
    """A symmetric algorithm in double precision."""
    made = runner(env)
    practise(made, 1)
    for model in (made.alg.actor, made.alg.critic):
        model.double()
    return made.alg, symmetric(env, made.alg)


@pytest.mark.parametrize("hidden", [[16, 13], [7, 16], [5]])
def test_a_layer_with_an_odd_number_of_units_is_explained(env: Any, hidden: list[int]) -> None:
    odd = next(n for n in hidden if n % 2)
    with pytest.raises(DraftError, match=f"a layer of {odd} units has no mirror image") as caught:
        runner(env, **{"learning.hidden": hidden})
    remedy = caught.value.problems[0].remedy
    assert "`learning.hidden` even" in remedy
    assert "set `learning.mirror` to false" in remedy
    runner(env, **{"learning.hidden": hidden, "learning.mirror": False})


def test_a_policy_that_is_loaded_is_symmetric_to_the_last_digit(env: Any) -> None:
    other, ours = runner(env).alg, runner(env).alg
    with torch.no_grad():
        other.actor.mlp[0].weight.mul_(2.0)[0, 0] += 1e-5
    assert ours.load(other.save(), {"actor": True, "critic": True}, strict=True) is False
    check_symmetric(ours, env)
    expected = other.actor.mlp[0].weight
    torch.testing.assert_close(ours.actor.mlp[0].weight, expected, atol=1e-5, rtol=0)


@pytest.mark.parametrize("part", ["actor", "critic"])
def test_a_policy_without_symmetry_is_not_bent_into_one_that_has_it(env: Any, part: str) -> None:
    other, ours = runner(env, **PLAIN).alg, runner(env).alg
    with pytest.raises(DraftError, match="is not mirror-symmetric, and this training is") as caught:
        ours.load(other.save(), {part: True}, strict=True)
    assert "learning.mirror=false" in str(caught.value)
    plain = runner(env, **PLAIN).alg
    plain.load(other.save(), {part: True}, strict=True)


def test_the_number_turns_symmetric_networks_on(env: Any) -> None:
    for config, on in ((Config(), False), (MIRRORED, True)):
        algorithm: Any = agent(config, "base").algorithm
        assert algorithm.symmetric is on
        assert getattr(algorithm, "symmetry_cfg", None) is None  # rsl-rl doubles samples so.
    for on in (False, True):
        alg = runner(env, **{"learning.mirror": on}).alg
        assert type(alg) is Ppo
        assert (alg._symmetry is not None) == on
