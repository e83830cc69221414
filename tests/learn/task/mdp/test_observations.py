"""What the policy and the critic see: order, sizes, scales and noise."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("mjlab")
import torch

from tests.learn.task.states import ask, each, first, place, stand, turn

# Section 6 of the study: terms in their order, sizes, noise, scales.
ACTOR = {
    "base_lin_vel": (3, 0.5, 1.0),
    "base_ang_vel": (3, 0.2, 1.0),
    "projected_gravity": (3, 0.05, 1.0),
    "joint_pos": (12, 0.01, 1.0),
    "joint_vel": (12, None, 1.0),
    "actions": (12, 0.0, 1.0),
    "command": (3, 0.0, 1.0),
    "height_scan": (187, 0.1, 0.2),
}
CRITIC = {"foot_height": 4, "foot_air_time": 4, "foot_contact": 4, "foot_contact_forces": 12}
JOINT_VELOCITY = (0.416, 0.1176, 0.0409)  # Noise: 0.0104 of the no-load speed [rad/s].


def seen(env: Any, group: str) -> dict[str, torch.Tensor]:
    """What a group sees now, by term."""
    sizes = {name: size for name, (size, *_) in ACTOR.items()}
    if group == "critic":
        sizes |= CRITIC
    whole = env.observation_manager.compute(update_history=True)[group]
    return dict(zip(sizes, whole.split(tuple(sizes.values()), dim=1), strict=True))


def test_sizes_and_order_are_those_of_the_study(flat: Any, base: Any) -> None:
    for env in (flat, base):
        manager = env.observation_manager
        assert manager.active_terms["actor"] == list(ACTOR)
        assert manager.active_terms["critic"] == [*ACTOR, *CRITIC]
        assert manager.group_obs_dim == {"actor": (235,), "critic": (259,)}
        sizes = [size for size, *_ in ACTOR.values()]
        assert manager.group_obs_term_dim["actor"] == [(size,) for size in sizes]
        assert manager.group_obs_term_dim["critic"][8:] == [(n,) for n in CRITIC.values()]


def test_the_critic_sees_the_state_as_it_is(flat: Any) -> None:
    robot = flat.scene["robot"]
    joints = robot.data.default_joint_pos + 0.1 * torch.arange(12) / 12
    state = {"linear": (0.3, 0.2, 0.1), "angular": (0.4, 0.5, 0.6), "speeds": 0.7}
    stand(flat, lift=0.1, quat=turn("x", 0.2), joints=joints, **state)
    ask(flat, 0.5, 0.25, -0.125)
    flat.action_manager.process_action(torch.full((flat.num_envs, 12), 0.3))
    found = seen(flat, "critic")
    data = robot.data
    offset = (0.1 * torch.arange(12) / 12).expand(flat.num_envs, 12)
    expected = {
        "base_lin_vel": data.root_link_lin_vel_b,
        "base_ang_vel": data.root_link_ang_vel_b,
        "projected_gravity": data.projected_gravity_b,
        "joint_pos": offset,
        "joint_vel": torch.full_like(offset, 0.7),
        "actions": torch.full_like(offset, 0.3),
        "command": torch.tensor([0.5, 0.25, -0.125]).expand(flat.num_envs, 3),
        "height_scan": (data.root_link_pos_w[:, 2:] / 5).expand(-1, 187),
    }
    for name, value in expected.items():
        torch.testing.assert_close(found[name], value, atol=1e-4, rtol=1e-4, msg=name)
    # Turned about x by 0.2 rad: gravity leans to the trunk's right.
    lean = torch.tensor([0.0, -0.198669, -0.980067]).expand(flat.num_envs, 3)
    torch.testing.assert_close(found["projected_gravity"], lean, atol=1e-5, rtol=0)


def test_noise_of_the_actor_stays_within_its_bounds_and_fills_them(flat: Any) -> None:
    stand(flat, lift=0.1)
    clean = seen(flat, "critic")
    most = {name: torch.zeros(flat.num_envs) for name in ACTOR}
    for _ in range(30):
        for name, value in seen(flat, "actor").items():
            away = (value - clean[name]).abs().amax(1)
            most[name] = most[name].maximum(away)
    for name, (_, noise, scale) in ACTOR.items():
        bound = each(flat, JOINT_VELOCITY) if noise is None else torch.tensor(noise * scale)
        assert (most[name] <= bound * (1 + 1e-3) + 1e-6).all(), name
        assert (most[name] >= 0.9 * bound).all(), name


def test_the_critic_has_no_noise(flat: Any) -> None:
    stand(flat)
    for name, value in seen(flat, "critic").items():
        torch.testing.assert_close(seen(flat, "critic")[name], value, atol=0, rtol=0, msg=name)


def test_a_stance_foot_reads_its_own_radius_and_a_high_one_its_range(flat: Any) -> None:
    radius = flat.scene["robot"].cfg.members[0].foot_radius
    stand(flat)
    height = first(flat, seen(flat, "critic")["foot_height"])
    assert height.min() == pytest.approx(radius, abs=1e-4)
    place(flat, (0, 0, 9))
    assert (seen(flat, "critic")["foot_height"] == 1.0).all()


def test_the_critic_sees_contact_its_time_and_the_logarithm_of_its_force(flat: Any) -> None:
    stand(flat, lift=-0.01)
    found = {name: first(flat, value) for name, value in seen(flat, "critic").items()}
    assert (found["foot_contact"] == 1).all()
    assert (found["foot_air_time"] == 0).all()
    force = first(flat, flat.scene["feet_contact"].data.force).flatten(1)
    assert force[:, 2::3].abs().min() > 10
    expected = force.sign() * (1 + force.abs()).log()
    torch.testing.assert_close(found["foot_contact_forces"], expected)
    place(flat, (0, 0, 9))
    air = seen(flat, "critic")
    assert not air["foot_contact"].any()
    assert not air["foot_contact_forces"].any()


def test_the_scan_is_clipped_at_its_range(flat: Any) -> None:
    place(flat, (0, 0, 9))
    assert (seen(flat, "critic")["height_scan"] == 1.0).all()
