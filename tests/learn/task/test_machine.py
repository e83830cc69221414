"""Recipe `machine`: a policy sees what an inertial sensor and encoders give, of other machines."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("mjlab")
pytest.importorskip("mjbatch")
import torch

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.worlds.simulate import make
from draft.learn.task.mdp.environment import environment
from draft.learn.task.mdp.world_models import redraw
from draft.learn.task.recipes import LAPTOP, RECIPES
from draft.learn.task.world import mirror
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.snapshot import capture, restore
from tests.learn.conftest import WORLDS
from tests.learn.small import member
from tests.learn.task.test_mirror import of_terms, walk_mirrored

MACHINE, STEPS = RECIPES["machine"].config, 5
MEASURED = {
    "base_ang_vel": 3,
    "projected_gravity": 3,
    "joint_pos": 12,
    "joint_vel": 12,
    "actions": 12,
}


def built(
    members: tuple[LeggedRobot, ...], worlds: int = WORLDS, play: bool = False, **values: Any
) -> Any:
    config = MACHINE.with_values(values)
    task = Task(members, config=config, ground="flat", see_ground=False)
    made = make(environment(task, worlds, play), "cpu", "native")
    made.reset()
    return made


@pytest.fixture(scope="module")
def env(members: tuple[LeggedRobot, ...]) -> Any:
    return built(members)


def of_steps(env: Any, seen: torch.Tensor, name: str) -> torch.Tensor:
    """A term of the actor by steps, the oldest first, shape (worlds, steps, entries)."""
    return of_terms(env, "actor", seen)[name].reshape(env.num_envs, STEPS, -1)


def test_its_numbers_are_those_of_a_machine_that_is_not_the_model() -> None:
    e = MACHINE.episodes
    assert e.delay == (0.0, 0.02)
    assert e.delay[1] <= MACHINE.physics.timestep * MACHINE.physics.decimation
    for number in ("motor", "joint_friction", "dry_friction", "encoder"):
        usual, own = (getattr(one.episodes, number) for one in (LAPTOP.config, MACHINE))
        width, wide = (one[1] - one[0] if isinstance(one, tuple) else one for one in (usual, own))
        assert wide > width, number


def test_the_actor_sees_no_velocity_and_the_critic_everything(env: Any) -> None:
    manager = env.observation_manager
    sizes = {name: (STEPS * count,) for name, count in MEASURED.items()} | {"command": (3,)}
    assert manager.active_terms["actor"] == list(sizes)
    assert manager.group_obs_term_dim["actor"] == list(sizes.values())
    critic = manager.active_terms["critic"]
    assert critic[:7] == ["base_lin_vel", *sizes]
    assert manager.group_obs_term_dim["critic"][:7] == [
        (3,),
        *((n,) for n in MEASURED.values()),
        (3,),
    ]


def test_past_steps_are_those_that_were_seen_and_the_first_one_at_the_start(env: Any) -> None:
    seen = env.reset(seed=2)[0]["actor"]
    for name in MEASURED:
        steps = of_steps(env, seen, name)
        assert (steps == steps[:, -1:]).all(), name
    known = {name: [of_steps(env, seen, name)[:, -1]] * STEPS for name in MEASURED}
    for _ in range(STEPS + 2):
        seen = env.step(0.3 * torch.randn(env.num_envs, 12))[0]["actor"]
        for name, past in known.items():
            steps = of_steps(env, seen, name)
            assert torch.equal(steps[:, :-1], torch.stack(past[1:], dim=1)), name
            known[name] = [*past[1:], steps[:, -1]]


def test_encoders_are_seen_with_their_bias(members: tuple[LeggedRobot, ...]) -> None:
    env = built(members)
    env.observation_manager.cfg["actor"].enable_corruption = False
    robot = env.scene["robot"]
    bias = robot.data.encoder_bias
    assert len(bias.unique()) == bias.numel()
    assert 0.02 < bias.abs().max() <= 0.03
    for term in env.observation_manager._group_obs_term_cfgs["actor"]:
        term.noise = None
    seen = env.step(torch.zeros(env.num_envs, 12))[0]
    off = of_steps(env, seen["actor"], "joint_pos")[:, -1]
    off = off - of_terms(env, "critic", seen["critic"])["joint_pos"]
    torch.testing.assert_close(off.abs(), bias.abs(), atol=1e-5, rtol=0)
    # The servo reads the same encoder: a target is reached where the encoder says so.
    assert (off.sign() == (robot.data.joint_pos_biased - robot.data.joint_pos).sign()).all()


def test_the_mirrored_robot_sees_the_mirror_image_of_past_steps_too() -> None:
    robot = member("cheetah")
    env = built((robot,), 2, play=True, **{"episodes.delay": (0.0, 0.0)})
    seen = walk_mirrored(env, robot, 12)["actor"]
    expected = mirror.flips(env)["actor"](seen[0])
    torch.testing.assert_close(seen[1], expected, atol=2e-3, rtol=2e-3)
    assert not torch.allclose(seen[0], expected, atol=0.05)


def test_dry_friction_is_on_top_of_that_of_the_design_and_stays(env: Any) -> None:
    robot = env.scene["robot"]
    at = robot.indexing.joint_v_adr

    def shares() -> torch.Tensor:
        own = env.sim.get_default_field("dof_frictionloss")[..., at]
        return (env.sim.model.dof_frictionloss[:, at] - own) / robot.peak_torque

    before = shares().clone()
    assert before.min() >= -1e-6
    assert 0.025 < before.max() <= 0.03 + 1e-6
    assert len(before.unique()) == before.numel()
    bear = robot.cfg.members[1]
    redraw(env, torch.tensor([0, 3]), [bear, bear])
    torch.testing.assert_close(shares(), before, atol=1e-5, rtol=1e-4)


def test_a_saved_state_has_the_past_steps(members: tuple[LeggedRobot, ...]) -> None:
    env = built(members)
    env.reset(seed=1)
    torch.manual_seed(5)
    for _ in range(STEPS + 2):  # So that the newest is no longer where it began.
        env.step(0.5 * torch.randn(env.num_envs, 12))
    state = capture(env)
    other = built(members)
    restore(other, state)
    for _ in range(STEPS):
        action = 0.5 * torch.randn(env.num_envs, 12)
        random = torch.get_rng_state()
        one = env.step(action)[0]
        torch.set_rng_state(random)
        two = other.step(action)[0]
        for group in ("actor", "critic"):
            torch.testing.assert_close(one[group], two[group], atol=0, rtol=0)
