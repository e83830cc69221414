"""What ends an episode, and whether it counts as a fall."""

from __future__ import annotations

import math
from typing import Any

import pytest

pytest.importorskip("mjlab")
import torch

from tests.learn.task.states import each, first, place, stand, turn

# 20 sqrt(s) seconds at 50 Hz, rounded up.
STEPS = (1000, 1242, 1646)


def ends(env: Any) -> dict[str, torch.Tensor]:
    """Which endings hold now, by name."""
    env.termination_manager.compute()
    manager = env.termination_manager
    return {name: manager.get_term(name).clone() for name in manager.active_terms}


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_trunk_tilted_by_more_than_1_rad_has_fallen(flat: Any, axis: str, sign: int) -> None:
    for tilt, fallen in ((0.99, False), (1.01, True), (math.pi, True)):
        stand(flat, lift=2.0, quat=turn(axis, sign * tilt))
        assert (ends(flat)["tilted"] == fallen).all()
        assert (flat.termination_manager.terminated | (not fallen)).all()
        assert not flat.termination_manager.time_outs.any()
    stand(flat, quat=turn("z", 3.0))  # Yaw is no tilt.
    assert not ends(flat)["tilted"].any()


@pytest.mark.parametrize(("share", "fallen"), [(0.99, False), (1.01, True)])
def test_a_trunk_too_low_above_its_feet_has_fallen(flat: Any, share: float, fallen: bool) -> None:
    robot = flat.scene["robot"]
    stand(flat)
    feet = robot.data.site_pos_w[:, robot.foot_sites, 2].mean(1)
    above = robot.data.root_link_pos_w[:, 2] - feet
    term = flat.termination_manager.get_term_cfg("low")
    assert term.params["share"] == 0.5
    for world in range(3):
        # The share of the home height at which this world's posture is just too low.
        just = float(above[world] / robot.height[world]) * share
        assert bool(term.func(flat, share=just)[world]) == fallen


def test_folded_legs_count_as_a_fall_and_straight_ones_do_not(flat: Any) -> None:
    robot = flat.scene["robot"]
    joints = robot.data.default_joint_pos.clone()
    stand(flat, lift=3.0, joints=joints)
    assert not first(flat, ends(flat)["low"]).any()
    for _, pitch, knee in robot.cfg.members[0].leg_joints:
        joints[:, pitch], joints[:, knee] = 1.5, -2.8
    stand(flat, lift=3.0, joints=joints)
    assert ends(flat)["low"].all()
    assert flat.termination_manager.terminated.all()


def test_an_episode_lasts_20_roots_of_s_seconds_and_ends_by_time(flat: Any) -> None:
    stand(flat)
    last = each(flat, STEPS).long()
    flat.episode_length_buf[:] = last - 1
    assert not ends(flat)["time_out"].any()
    flat.episode_length_buf[:] = last
    assert ends(flat)["time_out"].all()
    assert flat.termination_manager.time_outs.all()
    assert not first(flat, flat.termination_manager.terminated).any()


@pytest.mark.parametrize(("stage", "falls"), [("base", False), ("terrain", True)])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [1, -1])
def test_leaving_the_ground_is_a_time_out_and_on_hard_ground_a_fall(
    request: pytest.FixtureRequest, stage: str, falls: bool, axis: int, side: int
) -> None:
    env = request.getfixturevalue(stage)
    # Ten rows of seven patches of 8 m, a border of 20 m, less a margin of 0.3 m.
    edge = (10 * 4, 7 * 4)[axis] + 20 - 0.3
    for beyond, left in ((-0.05, False), (0.05, True)):
        at = [0.0, 0.0, 2.0]
        at[axis] = side * (edge + beyond)
        place(env, at)
        assert (ends(env)["left_ground"] == left).all()
        assert (env.termination_manager.time_outs == (left and not falls)).all()
        assert (first(env, env.termination_manager.terminated) == (left and falls)).all()


def test_flat_ground_has_no_edge(flat: Any) -> None:
    assert "left_ground" not in flat.termination_manager.active_terms


def test_watching_never_ends_by_time(members: Any) -> None:
    from draft.learn.task.mdp.environment import environment
    from draft.learn.task.world.task import Task

    shown = environment(Task(members[:1]), 1, play=True)
    assert set(shown.terminations) == {"tilted", "low"}
    assert shown.episode_length_s >= 1e9
    assert set(shown.events) == {"reset_base", "reset_joints"}
    assert not shown.observations["actor"].enable_corruption
    assert not shown.curriculum
