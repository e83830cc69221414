"""Configuration of the environments: what the paper's table asks for, design by design."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("mjlab")

import draft
from draft.learn.bodies.legged import legged_robot
from draft.learn.task.config import STAGES, Config
from draft.learn.task.constants import Scaled
from draft.learn.task.mdp.environment import environment
from draft.learn.task.recipes import RECIPES
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.agent import agent

WEIGHTS = {
    "linear_velocity": 1.0,
    "angular_velocity": 1.0,
    "upright": 1.0,
    "air_time": 0.4,
    "height": 0.4,
    "clearance": -2.0,
    "vertical_velocity": -2.0,
    "joint_limits": -1.0,
    "upper_legs": -1.0,
    "action_rate": -0.05,
}


def made(members: Any, stage: str = "base", **task: Any) -> Any:
    """Configuration of a stage."""
    return environment(Task(members, stage, **task), 5)


@pytest.mark.parametrize("stage", ["base", "terrain"])
def test_rewards_are_those_of_the_papers_table(members: Any, stage: str) -> None:
    found = made(members, stage)
    assert found.scale_rewards_by_dt
    assert {name: term.weight for name, term in found.rewards.items()} == WEIGHTS
    # Their numbers in the base stage: test_rewards.py.
    assert found.rewards == made(members).rewards


def test_the_velocity_stage_changes_four_rewards_and_adds_one(members: Any) -> None:
    base, found = (made(members, s).rewards for s in ("base", "velocity"))
    changed = {name for name in found if name not in base or found[name] != base[name]}
    assert changed == {"linear_velocity", "air_time", "action_rate", "speed"}
    weights = WEIGHTS | {"air_time": 0.3, "action_rate": -0.01, "speed": 0.6}
    assert {name: term.weight for name, term in found.items()} == weights
    assert found["air_time"].params["most"] == Scaled(0.5)
    assert found["linear_velocity"].params == {"headroom": 1.5, "share": 0.4}
    assert found["speed"].params == {"headroom": 1.5, "gate": 0.5}


def test_the_push_stage_changes_one_reward(members: Any) -> None:
    base, found = (made(members, s).rewards for s in ("base", "push"))
    assert [name for name in found if found[name] != base[name]] == ["linear_velocity"]
    assert found["linear_velocity"].params == {"sigma": Scaled(0.5)}


def test_feet_may_rise_higher_on_stairs_than_in_the_other_stages(members: Any) -> None:
    config = Config().with_values({"terrain.clearance": 0.2, "terrain.clearance_share": 0.25})
    usual, terrain = (
        made(members, s, config=config).rewards["clearance"] for s in ("base", "terrain")
    )
    assert usual.params["target"] == Scaled(0.1, 1.0)
    assert (terrain.weight, terrain.params["target"]) == (-0.5, Scaled(0.2, 1.0))


@pytest.mark.parametrize(("name", "first", "most"), [("hexapod", 1.0, 6.5), ("humanoid", 0.5, 1.3)])
def test_robots_on_two_legs_begin_and_end_with_slower_commands(
    name: str, first: float, most: float
) -> None:
    robot = legged_robot(draft.load(name).resolve())
    command: Any = made((robot,), "any", config=RECIPES["any"].config).commands["twist"]
    assert command.growth.start == Scaled(first, 0.5)
    assert command.forward.value == pytest.approx(most)


@pytest.mark.parametrize(
    ("name", "ahead", "aside"), [("hexapod", 1.0, 1.0), ("humanoid", 0.2, 0.5)]
)
def test_pushes_of_robots_of_any_legs_are_as_large_for_their_size(
    name: str, ahead: float, aside: float
) -> None:
    robot = legged_robot(draft.load(name).resolve())
    task, p = made((robot,), "any", config=RECIPES["any"].config), RECIPES["any"].config.push
    command: Any = task.commands["twist"]
    assert command.pushed[1:3] == (Scaled(ahead * p.forward, 0.5), Scaled(aside * p.sideways, 0.5))
    assert command.pushed.turn == Scaled(p.turn, -0.5)
    strong = task.events["push"].params["kinds"][-1].most
    assert strong[:3] == tuple(Scaled(value, 0.5) for value in p.linear)
    assert strong[3:] == tuple(Scaled(value, -0.5) for value in p.angular)


@pytest.mark.parametrize("stage", STAGES)
def test_simulation_and_control_are_those_of_the_study(members: Any, stage: str) -> None:
    found = made(members, stage, seed=7)
    assert (found.sim.mujoco.timestep, found.decimation, found.seed) == (0.005, 4, 7)
    assert (found.sim.mujoco.iterations, found.sim.mujoco.ls_iterations) == (10, 20)
    assert found.scene.num_envs == 5
    assert found.actions["joint_pos"].scale == 0.175
    # The longest of the family; each world ends by the time of its own design.
    assert found.episode_length_s == pytest.approx(20 * 1.6457, abs=1e-3)
    terms = {"velocity": ["speed_share"], "terrain": ["row"], "push": ["push_factor"]}
    terms["any"] = terms["velocity"]  # It makes the changes of that stage first.
    assert list(found.curriculum) == terms.get(stage, [])
    assert found.terminations["left_ground"].time_out == (stage != "terrain")


def test_a_stage_that_there_is_not_is_refused(members: Any) -> None:
    with pytest.raises(ValueError, match="no stage 'swim'; stages: base, velocity"):
        made(members, "swim")


def test_the_mix_of_patches_is_that_of_the_study(members: Any) -> None:
    names = ("flat", "stairs", "stairs_pit", "slope", "slope_pit", "rough", "waves")
    mixes = {
        "base": (0.2, 0.2, 0.2, 0.1, 0.1, 0.1, 0.1),
        "terrain": (0.05, 0.3, 0.3, 0.05, 0.05, 0.1, 0.15),
    }
    for stage, mix in mixes.items():
        patches = made(members, stage).scene.terrain.terrain_generator.sub_terrains
        shares = {name: patch.proportion for name, patch in patches.items()}
        assert shares == pytest.approx(dict(zip(names, mix, strict=True)))
    patches = made(members, "terrain").scene.terrain.terrain_generator.sub_terrains
    assert patches["stairs"].step_height_range == (0.1, 0.5)
    # Cells of height fields: twice the radius of the largest foot, and 0.1 m at least.
    patches = made(members[:1]).scene.terrain.terrain_generator.sub_terrains
    assert patches["slope"].horizontal_scale == 0.1
    big = (members[0], replace(members[1], foot_radius=0.06))
    patches = made(big).scene.terrain.terrain_generator.sub_terrains
    assert patches["slope"].horizontal_scale == 0.12


def test_a_changed_number_reaches_the_environment(members: Any) -> None:
    config = Config().with_values({"rewards.upright_weight": 3, "episodes.tilt": 0.5})
    found = made(members, config=config)
    assert found.rewards["upright"].weight == 3.0
    assert found.terminations["tilted"].params == {"limit": 0.5}


def test_the_agent_has_the_numbers_of_the_study() -> None:
    found: Any = agent(Config(), "velocity", seed=3)
    assert found.actor.hidden_dims == found.critic.hidden_dims == (512, 256, 128)
    assert (found.seed, found.num_steps_per_env, found.max_iterations) == (3, 24, 1800)
    ppo = found.algorithm
    assert (ppo.gamma, ppo.lam, ppo.clip_param, ppo.entropy_coef) == (0.99, 0.95, 0.2, 0.01)
    assert (ppo.num_learning_epochs, ppo.num_mini_batches, ppo.learning_rate) == (5, 4, 1e-3)
    assert (ppo.schedule, ppo.desired_kl, ppo.max_grad_norm) == ("adaptive", 0.01, 1.0)
    assert found.actor.distribution_cfg["init_std"] == 0.5
