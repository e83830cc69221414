"""Pushes and what is drawn once for every world."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("mjlab")
import torch
from mjlab.utils.lab_api.math import quat_apply

from draft.learn.task.constants import Scaled
from draft.learn.task.mdp import events
from tests.learn.task.states import each, place, roots, turn

LEVEL, YAWED, TILTED = (1.0, 0.0, 0.0, 0.0), turn("z", 1.3), turn("x", 0.8)
MOST = torch.tensor([0.5, 0.5, 0.4, 0.52, 0.52, 0.78])


def largest(env: Any) -> torch.Tensor:
    """Largest pushes: velocities grow with the square root of the size, rates shrink."""
    power = torch.tensor([1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
    return MOST * roots(env)[:, None] ** power


def pushes(env: Any) -> tuple[Any, dict[str, Any]]:
    """The term that pushes, and its parameters."""
    term = env.event_manager.get_term_cfg("push")
    return term.func, term.params


def world_velocity(env: Any) -> torch.Tensor:
    """Velocity of the trunks in the world's axes, from the state itself."""
    data, index = env.sim.data, env.scene["robot"].indexing
    quat = data.qpos[:, index.free_joint_q_adr[3:7]]
    v = data.qvel[:, index.free_joint_v_adr]
    return torch.cat((v[:, :3], quat_apply(quat, v[:, 3:])), dim=1)


def pushed(env: Any) -> torch.Tensor:
    """What one push, due now, adds to the velocity."""
    term, params = pushes(env)
    before = world_velocity(env).clone()
    term.time_left[:] = env.step_dt
    term(env, None, **params)
    return world_velocity(env) - before


@pytest.mark.parametrize("quat", [LEVEL, YAWED, TILTED], ids=["level", "yawed", "tilted"])
def test_velocity_is_added_in_the_worlds_axes(flat: Any, quat: Any) -> None:
    place(flat, (0, 0, 3), quat, (0.3, 0.2, 0.1), (1.0, 2.0, 3.0))
    change = torch.tensor([0.1, -0.2, 0.3, 0.4, -0.5, 0.6]).expand(flat.num_envs, 6)
    before = world_velocity(flat).clone()
    events.add_velocity(flat.scene["robot"], change)
    torch.testing.assert_close(world_velocity(flat) - before, change, atol=1e-5, rtol=0)
    # The simulator's own reading agrees.
    flat.sim.forward()
    seen = flat.scene["robot"].data.root_link_vel_w
    torch.testing.assert_close(seen, before + change, atol=1e-4, rtol=0)


@pytest.mark.parametrize("drawn", [0.0, 0.25, 1.0])
def test_a_push_adds_the_drawn_share_of_the_largest(
    flat: Any, monkeypatch: pytest.MonkeyPatch, drawn: float
) -> None:
    place(flat, (0, 0, 3), TILTED)
    monkeypatch.setattr(events.torch, "rand_like", lambda like: torch.full_like(like, drawn))
    expected = (2 * drawn - 1) * largest(flat)
    torch.testing.assert_close(pushed(flat), expected, atol=1e-5, rtol=0)


def test_pushes_fill_their_range_and_never_leave_it(flat: Any) -> None:
    place(flat, (0, 0, 3), YAWED)
    share = torch.cat([pushed(flat) / largest(flat) for _ in range(60)])
    assert share.abs().max() < 1 + 1e-4
    assert (share.max(0).values > 0.95).all()
    assert (share.min(0).values < -0.95).all()
    # Uniform: the mean of n draws is within five of its standard errors, (3 n)^-1/2.
    assert (share.mean(0).abs() < 5 / (3 * len(share)) ** 0.5).all()


@pytest.mark.parametrize(
    ("iteration", "factor"),
    [(0, 1), (399, 1), (400, 2), (799, 2), (800, 3.5), (1199, 3.5), (1200, 5), (9000, 5)],
)
def test_pushes_of_the_push_stage_grow_alike_for_all_designs(
    push: Any, monkeypatch: pytest.MonkeyPatch, iteration: int, factor: float
) -> None:
    place(push, (0, 0, 3))
    monkeypatch.setattr(events.torch, "rand_like", torch.ones_like)
    for step in (24 * iteration, 24 * iteration + 23):
        push.common_step_counter = step
        expected = (factor * MOST).expand(push.num_envs, 6)
        torch.testing.assert_close(pushed(push), expected, atol=1e-4, rtol=0)


@pytest.mark.parametrize(("stage", "low", "high"), [("flat", 2.0, 5.0), ("push", 1.0, 3.0)])
def test_the_time_between_two_pushes(
    request: pytest.FixtureRequest, stage: str, low: float, high: float
) -> None:
    env = request.getfixturevalue(stage)
    term, params = pushes(env)
    last = torch.zeros(env.num_envs)
    gaps: list[torch.Tensor] = []
    term.reset()
    for step in range(1, 2001):
        left = term.time_left.clone()
        place_v = world_velocity(env).clone()
        term(env, None, **params)
        due = left - env.step_dt < 1e-6
        moved = (world_velocity(env) != place_v).any(1)
        assert (moved == due).all()
        now = torch.full_like(last, step * env.step_dt)
        gaps.append(torch.where(due, (now - last) / roots(env), torch.nan))
        last = torch.where(due, now, last)
    found = torch.cat([gap[~gap.isnan()] for gap in gaps])
    assert len(found) > 80
    # A push comes with the first step at or after its time.
    assert found.min() > low - 1e-3
    assert found.max() < high + env.step_dt + 1e-3
    assert found.min() < low + 0.2 * (high - low)
    assert found.max() > high - 0.2 * (high - low)


def test_a_reset_starts_the_time_to_the_next_push_of_those_worlds(flat: Any) -> None:
    term, _ = pushes(flat)
    term.time_left[:] = -1.0
    flat.event_manager.reset(torch.tensor([1, 5]))
    assert (term.time_left[[1, 5]] >= 2.0 * roots(flat)[[1, 5]]).all()
    assert (term.time_left[[0, 2, 3, 4, 6]] == -1.0).all()


def test_a_trunks_centre_is_shifted_within_its_reach_and_nothing_else_is(flat: Any) -> None:
    model = flat.sim.model.body_ipos
    before = model.clone()
    trunk = flat.scene["robot"].indexing.root_body_id
    shifts = []
    for _ in range(20):
        events.shift_centre(flat, None, Scaled(0.02, 1.0))
        change = model - before
        shifts.append(change[:, trunk] / (0.02 * roots(flat)[:, None] ** 2))
        change[:, trunk] = 0.0
        assert not change.any()
        model[:] = before
    share = torch.cat(shifts)
    assert share.abs().max() <= 1 + 1e-4
    assert (share.max(0).values > 0.9).all()
    assert (share.min(0).values < -0.9).all()


def test_the_shift_is_drawn_once_for_each_world(flat: Any) -> None:
    trunk = flat.scene["robot"].indexing.root_body_id
    centres = flat.sim.model.body_ipos[:, trunk].clone()
    assert len(centres.unique(dim=0)) == flat.num_envs
    flat.reset()
    torch.testing.assert_close(flat.sim.model.body_ipos[:, trunk], centres)


def test_friction_is_one_draw_for_the_four_feet_of_a_world(flat: Any) -> None:
    robot = flat.scene["robot"]
    ids = [flat.sim.mj_model.geom(f"robot/{name}").id for name in robot.cfg.members[0].foot_geoms]
    friction = flat.sim.model.geom_friction[:, ids]
    sliding = friction[..., 0]
    assert (sliding == sliding[:, :1]).all()
    assert len(sliding[:, 0].unique()) == flat.num_envs
    assert (sliding >= 0.4).all()
    assert (sliding <= 1.1).all()
    assert sliding.max() - sliding.min() > 0.3
    rolling = torch.tensor(flat.sim.mj_model.geom_friction[ids][:, 1:], dtype=torch.float32)
    torch.testing.assert_close(friction[..., 1:], rolling.expand(flat.num_envs, 4, 2))


def test_encoder_bias_moves_the_target_and_not_what_is_seen(flat: Any) -> None:
    robot = flat.scene["robot"]
    bias = robot.data.encoder_bias
    assert bias.abs().max() <= 0.015
    assert bias.abs().max() > 0.013
    assert len(bias.unique()) == bias.numel()
    place(flat, (0, 0, 3))
    action = torch.linspace(-1, 1, 12).expand(flat.num_envs, 12)
    flat.action_manager.process_action(action)
    flat.action_manager.apply_action()
    target = robot.data.default_joint_pos + 0.175 * action - bias
    torch.testing.assert_close(robot.data.joint_pos_target, target)
    seen = flat.observation_manager.get_term_cfg("actor", "joint_pos")
    value = seen.func(flat, **seen.params)
    torch.testing.assert_close(value, torch.zeros_like(value), atol=1e-6, rtol=0)


def test_a_robot_starts_still_at_home_above_its_patch(flat: Any) -> None:
    robot = flat.scene["robot"]
    pose = robot.data.root_link_pose_w
    around = pose[:, :2] - flat.scene.env_origins[:, :2]
    assert (around.abs() <= 0.5).all()
    lift = pose[:, 2] - each(flat, [member.height for member in robot.cfg.members])
    assert (lift >= 0.01 - 1e-5).all()
    assert (lift <= 0.05 + 1e-5).all()
    torch.testing.assert_close(pose[:, 4:6], torch.zeros(flat.num_envs, 2))
    assert len(robot.data.heading_w.unique()) == flat.num_envs
    torch.testing.assert_close(robot.data.joint_pos, robot.data.default_joint_pos)
    assert not flat.sim.data.qvel.any()
