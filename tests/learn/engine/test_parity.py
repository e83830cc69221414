"""Both engines lead from the same states to the same, to single precision."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("mjlab")
pytest.importorskip("mjbatch")

import torch

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.worlds.simulate import make
from draft.learn.task.config import Config
from draft.learn.task.mdp.environment import environment
from draft.learn.task.world.access import FEET
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.snapshot import capture, restore
from tests.learn.small import SMALL

STATES = 256


def both(task: Task, worlds: int) -> list[Any]:
    """A task on both engines, without noise, pushes and ends of episodes."""
    made = []
    for engine in ("native", "warp"):
        settings = environment(task, worlds, play=True)
        settings.terminations = {}
        made.append(make(settings, "cpu", engine))
        made[-1].reset(seed=0)
    return made


@pytest.fixture(scope="module")
def pair(members: tuple[LeggedRobot, ...]) -> Iterator[list[Any]]:
    """The same robots on a plane on both engines."""
    made = both(Task(members[:1], ground="flat"), STATES)
    yield made
    for env in made:
        env.close()


def walking(env: Any, drawn: torch.Generator) -> torch.Tensor:
    """Robots that took 10 to 40 random steps, and are jolted; returns the next action."""
    for _ in range(int(torch.randint(10, 41, (), generator=drawn))):
        env.step(noise(drawn, 12))
    data = env.sim.data
    data.qpos[:, 7:] += 0.05 * noise(drawn, 12)
    data.qvel[:, :6] += 0.2 * noise(drawn, 6)
    data.qvel[:, 6:] += noise(drawn, 12)
    return noise(drawn, 12)


def tumbling(env: Any, drawn: torch.Generator) -> torch.Tensor:
    """Robots that fell from any attitude, thrashing; returns the next action."""
    data = env.sim.data
    quat = torch.randn(STATES, 4, generator=drawn)
    data.qpos[:, 3:7] = quat / quat.norm(dim=1, keepdim=True)
    data.qpos[:, 2] = 0.45 + 0.15 * noise(drawn, 1)[:, 0]
    data.qpos[:, 7:] += 1.5 * noise(drawn, 12)
    data.qvel[:] = 5 * noise(drawn, 18)
    for _ in range(20):
        env.step(10 * noise(drawn, 12))
    return 10 * noise(drawn, 12)


def noise(drawn: torch.Generator, width: int) -> torch.Tensor:
    """Uniform from -1 to 1."""
    return 2 * torch.rand(STATES, width, generator=drawn) - 1


def outcome(env: Any, state: dict[str, Any], action: torch.Tensor) -> dict[str, torch.Tensor]:
    """What one step from a state leads to, by name."""
    restore(env, state)
    seen, *_ = env.step(action.clone())
    data, found = env.sim.data, {}
    found["joint positions"], found["joint velocities"] = data.qpos[:, 7:], data.qvel[:, 6:]
    found["pose"], found["motion"] = data.qpos[:, :7], data.qvel[:, :6]
    manager = env.observation_manager
    for group, names in manager.active_terms.items():
        widths = [dims[0] for dims in manager.group_obs_term_dim[group]]
        for name, values in zip(names, seen[group].split(widths, dim=1), strict=True):
            found[f"{group} {name}"] = values
    rewards = env.reward_manager
    for i, name in enumerate(rewards.active_terms):
        found[f"reward {name}"] = rewards._step_reward[:, i : i + 1]
    found["contacts"] = env.scene[FEET].data.found > 0
    return {name: values.clone() for name, values in found.items()}


@pytest.fixture(scope="module")
def outcomes(pair: list[Any]) -> tuple[dict[str, torch.Tensor], ...]:
    """Outcomes of one step on either engine: of 256 robots that walk, then of 256 that tumble."""
    found: list[dict[str, list[torch.Tensor]]] = [{}, {}]
    for seed, begin in enumerate((walking, tumbling)):
        pair[0].reset(seed=seed)
        action = begin(pair[0], torch.Generator().manual_seed(seed))
        pair[0].sim.forward()
        state = capture(pair[0])
        del state["tensors"]["sim.state"]  # In double precision, which one of them has alone.
        for of, env in zip(found, pair, strict=True):
            for name, values in outcome(env, state, action).items():
                of.setdefault(name, []).append(values)
    native, warp = ({k: torch.cat(v) for k, v in of.items()} for of in found)
    return native, warp


def gaps(outcomes: Any, name: str) -> torch.Tensor:
    """Largest difference of a quantity in each state."""
    native, warp = (one[name].double() for one in outcomes)
    return (native - warp).abs().amax(1)


# Medians that were measured are 10 times less, and more: those of single precision through four
# physics steps. What a foot or a thigh does that just touches the ground is of the tails.
@pytest.mark.parametrize(
    ("name", "tolerance"),
    [
        ("joint positions", 2e-6),  # rad
        ("joint velocities", 1e-4),  # rad/s
        ("pose", 5e-6),  # m, and of the quaternion
        ("motion", 2e-5),  # m/s, rad/s
    ],
)
def test_one_step_leads_to_the_same_state_on_both_engines(
    outcomes: Any, name: str, tolerance: float
) -> None:
    found = gaps(outcomes, name)
    for kind in found.split(STATES):
        assert kind.median() < tolerance
        assert kind.quantile(0.95) < 10 * tolerance


def test_the_states_of_these_tests_are_not_easy(outcomes: Any) -> None:
    native = outcomes[0]
    walk, tumble = native["contacts"].float().split(STATES)
    assert 0.1 < walk.mean() < 0.9
    assert 0.02 < tumble.mean() < 0.9
    for name in ("upper_legs", "joint_limits"):
        assert (native[f"reward {name}"][STATES:] < 0).float().mean() > 0.1, name
    assert native["joint velocities"].std() > 1.0
    assert native["pose"][STATES:, 3:].std() > 0.3


def test_feet_touch_the_ground_on_both_engines_alike(outcomes: Any) -> None:
    native, warp = (one["contacts"] for one in outcomes)
    assert (native == warp).float().mean() >= 0.995


def test_actor_and_critic_see_the_same_on_both_engines(outcomes: Any) -> None:
    names = [name for name in outcomes[0] if name.startswith(("actor ", "critic "))]
    assert len(names) == 20
    looser = {"joint_vel": 1e-4, "foot_contact_forces": 2e-4, "base_ang_vel": 2e-5}
    for name in names:
        tolerance = looser.get(name.partition(" ")[2], 2e-6)
        assert gaps(outcomes, name).median() < tolerance, name
        assert outcomes[0][name].std() > 1e-3, name


def test_rewards_are_the_same_on_both_engines(outcomes: Any) -> None:
    names = [name for name in outcomes[0] if name.startswith("reward ")]
    assert len(names) == 10
    for name in names:
        # Of the cost of clearance, up to 50 where a robot thrashes, to six digits.
        size = max(1.0, float(outcomes[0][name].abs().max()))
        assert gaps(outcomes, name).median() < 2e-6 * size, name
        assert outcomes[0][name].std() > 1e-3, name


def test_on_uneven_ground_feet_touch_alike_and_stairs_are_the_same_on_both_engines(
    members: tuple[LeggedRobot, ...],
) -> None:
    worlds = 128
    pair = both(Task(members[:1], config=Config().with_values(SMALL)), worlds)
    drawn = torch.Generator().manual_seed(0)
    for _ in range(20):
        pair[0].step(torch.randn(worlds, 12, generator=drawn))
    state, action = capture(pair[0]), torch.randn(worlds, 12, generator=drawn)
    found = [outcome(env, state, action) for env in pair]
    native, warp = (one["contacts"] for one in found)
    assert 0.1 < native.float().mean() < 0.9
    terrain = pair[0].scene.terrain
    kinds = list(terrain.cfg.terrain_generator.sub_terrains)
    boxes = [i for i, kind in enumerate(kinds) if kind in ("flat", "stairs", "stairs_pit")]
    stairs = torch.isin(terrain.terrain_types, torch.tensor(boxes))
    assert stairs.sum() > 50
    # Of the triangles of a height field that a foot touches, Warp keeps four, MuJoCo all.
    assert (native == warp).float().mean() >= 0.98
    assert (native == warp)[stairs].float().mean() >= 0.995
    assert gaps(found, "joint positions")[stairs].quantile(0.9) < 2e-6
    assert gaps(found, "joint velocities")[stairs].quantile(0.9) < 1e-4
    assert gaps(found, "joint positions").median() < 1e-4
