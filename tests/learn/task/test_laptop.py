"""What the recipe `laptop` adds to the tasks: growing commands, headings, progress, new inputs."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("mjlab")
pytest.importorskip("mjbatch")
import torch

from draft.learn.engine.machine import NATIVE
from draft.learn.task.config import Config
from draft.learn.task.constants import Scaled
from draft.learn.task.mdp import curriculums, rewards
from draft.learn.task.mdp.commands import command_term
from draft.learn.task.recipes import LAPTOP
from draft.learn.task.world.ground import worlds_on
from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.run import Origin, create, file_digest
from tests.learn.small import member, plan
from tests.learn.task.states import ask, drive, laptop, place

WORLDS = 16
DESIGN = {"cheetah": "values: {}\n"}
UNEVEN = {"observations.map_pitch": 0.1, "ground.border": 2.0, "ground.rows": 3}


@pytest.fixture(scope="module")
def running() -> Any:
    return laptop("velocity", worlds=WORLDS)


@pytest.fixture(scope="module")
def climbing() -> Any:
    return laptop("terrain", worlds=WORLDS, ground="uneven", **UNEVEN)


# After 1.5 s four samples per world are enough; then 0.9 m/s is fast for 1.2 m/s too. Speeds below
# `missed` of the command let the range shrink.
@pytest.mark.parametrize(
    ("share", "seconds", "grown", "missed", "change"),
    [
        pytest.param(0.85, 1.55, 0.0, None, 0.0, id="tracked too shortly"),
        pytest.param(0.85, 1.65, 0.0, None, 0.2, id="tracked"),
        pytest.param(0.85, 3.0, 0.0, None, 0.4, id="tracked twice as long"),
        pytest.param(0.75, 5.0, 0.0, None, 0.0, id="not tracked"),
        pytest.param(0.65, 1.65, 1.0, None, -0.2, id="missed, as the recipe has it"),
        pytest.param(0.65, 1.65, 1.0, 0.0, 0.0, id="missed, where it never shrinks"),
        pytest.param(0.65, 1.65, 1.0, 0.7, -0.2, id="missed"),
        pytest.param(0.75, 1.65, 1.0, 0.7, 0.0, id="neither missed nor tracked"),
        pytest.param(0.85, 1.65, 1.0, 0.7, 0.2, id="tracked where it may shrink"),
        pytest.param(0.65, 1.65, 0.0, 0.7, 0.0, id="missed at the start of the range"),
    ],
)
def test_the_fastest_command_grows_where_fast_ones_are_tracked_and_shrinks_where_missed(
    running: Any,
    monkeypatch: pytest.MonkeyPatch,
    share: float,
    seconds: float,
    grown: float,
    missed: float | None,
    change: float,
) -> None:
    term: Any = command_term(running)
    if missed is not None:
        monkeypatch.setattr(term.cfg, "growth", term.cfg.growth._replace(missed=missed))
    for one in (term._reached, term._since):
        one.zero_()
    term.grown.fill_(grown)
    before = term.range_now()[0, 0].item()
    drive(running, monkeypatch, 0.9, 0.9 * share, seconds)
    assert term.range_now()[0, 0].item() - before == pytest.approx(change)


def test_robots_that_have_just_begun_and_may_fall_ahead_let_nothing_grow(
    running: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    term: Any = command_term(running)
    for one in (term._reached, term._since, term.grown):
        one.zero_()
    monkeypatch.setattr(running, "episode_length_buf", torch.zeros(WORLDS, dtype=torch.long))
    drive(running, monkeypatch, 0.9, 0.9, 3.0, steady=False)
    assert not term.grown.any()


def test_a_reset_of_some_robots_is_no_sample(running: Any) -> None:
    term: Any = command_term(running)
    term._since.zero_()
    term._update_command(torch.arange(2))
    assert not term._since.any()
    term._update_command()
    assert term._since.all()


def test_each_group_of_worlds_grows_by_what_it_tracks_itself(
    running: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    term: Any = command_term(running)
    before, group = term.group, torch.arange(WORLDS) % 2
    term.divide(group, 2)
    term._since.zero_()
    drive(running, monkeypatch, 0.9, torch.where(group == 0, 0.8, 0.6), 1.65)
    assert term.grown.tolist() == [1.0, 0.0]
    term.divide(before, 1)


def test_commands_begin_with_the_range_of_the_base_stage_and_end_below_that_of_the_stage(
    running: Any,
) -> None:
    term: Any = command_term(running)
    term.grown.zero_()
    assert term.range_now()[0, 0] == pytest.approx(1.0)
    term.grown.fill_(1000.0)
    assert term.range_now()[0, 0] == pytest.approx(LAPTOP.config.velocity.forward)
    term.grown.zero_()


def test_most_robots_are_led_straight_away_along_their_heading(climbing: Any) -> None:
    term: Any = command_term(climbing)
    yaw = torch.linspace(-3.0, 3.0, WORLDS)
    none = torch.zeros(WORLDS)
    place(climbing, quat=torch.stack(((yaw / 2).cos(), none, none, (yaw / 2).sin()), dim=1))
    torch.manual_seed(0)
    flat = worlds_on(climbing, "flat")
    assert flat is not None
    count, speeds = 0, []
    for _ in range(100):
        term._resample_command(torch.arange(WORLDS))
        led = term.is_heading_env & ((term.heading_target - yaw).abs() < 1e-4)
        assert (term.vel_command_b[led, 1:] == 0).all()
        assert not (led & flat).any()
        speeds.append(term.vel_command_b[led, 0])
        count += int(led.sum())
    found = torch.cat(speeds)
    low, high = LAPTOP.config.terrain.forward
    assert low <= found.min()
    assert found.max() <= high
    share = count / (100 * int((~flat).sum()))
    assert share == pytest.approx(LAPTOP.config.terrain.away, abs=0.05)


def test_a_slow_design_is_led_no_faster_than_its_limit() -> None:
    env = laptop("terrain", "giraffe", worlds=WORLDS, ground="uneven", **UNEVEN)
    term, slow = command_term(env), member("giraffe")
    most = LAPTOP.config.terrain.limit * slow.top_speed
    assert most < LAPTOP.config.terrain.forward[1] * slow.scale**0.5
    for _ in range(20):
        term._resample_command(torch.arange(WORLDS))
        assert term.vel_command_b[:, 0].max() <= most + 1e-6


def test_progress_is_the_share_of_the_command_that_is_walked(
    climbing: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = torch.tensor([[0.8, 0.0, 0.3], [0.0, 0.5, 0.0], [0.8, 0.0, 0.0], [0.0, 0.0, 0.4]])
    moved = torch.tensor([[0.4, 0.7, 0.0], [0.3, -0.5, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    monkeypatch.setattr(rewards, "command_of", lambda env: asked)

    robot = SimpleNamespace(
        data=SimpleNamespace(root_link_lin_vel_b=moved),
        scaled=lambda number: torch.full((4,), number.value),
    )
    monkeypatch.setattr(rewards, "robot_of", lambda env: robot)
    found = rewards.progress(climbing, Scaled(0.05))
    torch.testing.assert_close(found, torch.tensor([0.5 / rewards.ENOUGH, -1.0, 1.0, 0.0]))


def test_a_turn_counts_by_the_share_of_its_command_and_slow_commands_do_not(
    climbing: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, turned = torch.zeros(4, 3), torch.zeros(4, 3)
    asked[:, 2] = torch.tensor([1.0, -1.0, 1.0, 0.1])
    turned[:, 2] = torch.tensor([0.4, 0.5, 3.0, 0.1])
    monkeypatch.setattr(rewards, "command_of", lambda env: asked)
    monkeypatch.setattr(
        rewards, "command_term", lambda env: SimpleNamespace(largest=torch.ones(4, 3))
    )
    robot = SimpleNamespace(data=SimpleNamespace(root_link_ang_vel_b=turned))
    monkeypatch.setattr(rewards, "robot_of", lambda env: robot)
    found = rewards.turning(climbing, 0.2)
    torch.testing.assert_close(
        found, torch.tensor([0.4 / rewards.ENOUGH, -0.5 / rewards.ENOUGH, 1.0, 0.0])
    )


def test_a_share_of_the_commands_has_one_component_only(
    running: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    term = command_term(running)
    monkeypatch.setattr(term.cfg, "single", 0.6)
    monkeypatch.setattr(term.cfg, "rel_forward_envs", 0.0)
    monkeypatch.setattr(term.cfg, "rel_heading_envs", 1.0)
    count = torch.zeros(4)
    for _ in range(100):
        term._resample_command(torch.arange(WORLDS))
        alone = (term.vel_command_b != 0).sum(1) == 1
        assert not (alone & term.is_heading_env).any()  # A heading would add a turn.
        assert (alone | term.is_heading_env).all()
        count[:3] += ((term.vel_command_b != 0) & alone[:, None]).sum(0)
        count[3] += (~alone).sum()
    shares = (count / count.sum()).tolist()
    assert shares == pytest.approx([0.2, 0.2, 0.2, 0.4], abs=0.05)


def test_the_penalty_on_changes_of_the_action_grows_over_the_first_iterations(
    running: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = torch.full((WORLDS,), 3.0)
    monkeypatch.setattr(rewards.envs_mdp, "action_rate_l2", lambda env: whole)
    shares = []
    for iteration in (0, 25, 100, 500):
        monkeypatch.setattr(rewards, "iteration", lambda env, steps, at=iteration: at)
        shares.append(rewards.action_rate(running, 100, 24)[0].item() / 3.0)
    assert shares == pytest.approx([0.0, 0.25, 1.0, 1.0])
    monkeypatch.setattr(rewards, "iteration", lambda env, steps: 0)
    assert rewards.action_rate(running, 0, 24)[0].item() == 3.0


def test_a_robot_that_falls_or_turns_back_does_not_move_up(climbing: Any) -> None:
    env, terrain = climbing, climbing.scene.terrain
    terrain.terrain_levels[:] = 1
    ids = torch.arange(WORLDS)
    terrain.update_env_origins(ids, torch.zeros(WORLDS) > 0, torch.zeros(WORLDS) > 0)
    ask(env, 0.8)
    env.common_step_counter = 100
    # 0.8 m/s for 7 s are 5.6 m, more than the 4 m that lead a row up at most.
    at = env.scene.env_origins.clone()
    at[:, 0] += torch.tensor([4.1, 4.1, 3.0, 1.0] * (WORLDS // 4))
    place(env, at)
    env.termination_manager._terminated_buf[:] = torch.tensor([False, True, False, False] * 4)
    t = LAPTOP.config.terrain
    curriculums.rows(env, ids, t.promotion, t.demotion, by_way=True)
    assert terrain.terrain_levels.view(-1, 4)[0].tolist() == [2, 1, 1, 0]


def test_a_policy_that_begins_to_see_the_ground_acts_as_before(tmp_path: Path) -> None:
    flat = replace(plan(), ground="flat", see_ground=False)
    base = Trainer(create(tmp_path / "base", flat, DESIGN), "cpu", 0, NATIVE)
    assert base.train(2)
    file = tmp_path / "base/model_2.pt"
    origin = Origin(str(tmp_path / "base"), 2, file_digest(file))
    sees = plan(stage="terrain", ground="uneven", origin=origin)
    later: Any = Trainer(create(tmp_path / "terrain", sees, DESIGN), "cpu", 0, NATIVE)
    seen = later._wrapped.get_observations()
    names = later.env.observation_manager.active_terms
    models: tuple[tuple[str, Any, Any], ...] = (
        ("actor", later.runner.alg.actor, base.runner.alg.actor),
        ("critic", later.runner.alg.critic, base.runner.alg.critic),
    )
    for group, one, other in models:
        sizes = [dims[0] for dims in later.env.observation_manager.group_obs_term_dim[group]]
        parts = dict(zip(names[group], seen[group].split(sizes, dim=1), strict=True))
        scan = parts.pop("height_scan")
        assert scan.shape[1] == Config().observations.scan_points()
        narrow = {group: torch.cat(list(parts.values()), dim=1)}
        torch.testing.assert_close(one(seen), other(narrow), atol=1e-5, rtol=1e-5)
        assert math.isfinite(one.obs_normalizer._std.sum().item())
    assert later.train(1)


def test_a_flat_stage_sees_no_scan_and_a_climbing_one_does(running: Any, climbing: Any) -> None:
    for group in ("actor", "critic"):
        assert "height_scan" not in running.observation_manager.active_terms[group]
        assert "height_scan" in climbing.observation_manager.active_terms[group]
    sizes = running.observation_manager.group_obs_dim
    assert sizes["actor"] == (48,)
