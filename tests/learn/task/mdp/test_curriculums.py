"""Curricula: ramps by iteration, and rows of rising difficulty."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("mjlab")
import torch

from draft.learn.engine.worlds.ranks import Ranks
from draft.learn.task.mdp import curriculums
from draft.learn.training.ppo.log import Tally
from tests.learn.task.states import ask, place, roots

ALONE = Ranks(0, 1, "cpu")


@pytest.mark.parametrize(
    ("stage", "name", "steps"),
    [
        ("velocity", "speed_share", {0: 0.4, 9599: 0.4, 9600: 0.6, 21600: 0.8, 33600: 1.0}),
        ("push", "push_factor", {0: 1, 9599: 1, 9600: 2, 19199: 2, 19200: 3.5, 28800: 5}),
    ],
)
def test_the_log_has_the_value_of_a_ramp(
    request: pytest.FixtureRequest, stage: str, name: str, steps: dict[int, float]
) -> None:
    env = request.getfixturevalue(stage)
    for step, expected in steps.items():
        env.common_step_counter = step
        env.curriculum_manager.compute(torch.tensor([0]))
        (found,) = (
            v for k, v in env.curriculum_manager.reset(torch.tensor([0])).items() if name in k
        )
        assert found == pytest.approx(expected)


def test_robots_start_in_the_easy_rows(base: Any, terrain: Any) -> None:
    assert set(base.scene.terrain.terrain_levels.tolist()) <= {0, 1, 2, 3}
    assert len(base.scene.terrain.terrain_levels.unique()) > 1
    assert base.curriculum_manager.active_terms == []
    assert terrain.scene.terrain.max_terrain_level == 10
    assert terrain.scene.terrain.cfg.max_init_terrain_level == 0


@pytest.fixture
def climbing(terrain: Any) -> Any:
    """Stage terrain after its first step, everyone in row 4."""
    terrain.common_step_counter = 1
    terrain.scene.terrain.terrain_levels[:] = 4
    none = torch.zeros(terrain.num_envs, dtype=torch.bool)
    terrain.scene.terrain.update_env_origins(torch.arange(terrain.num_envs), none, none)
    return terrain


def walk(env: Any, way: Any) -> None:
    """Put the robots some way [m] from their patch's origin."""
    at = env.scene.env_origins.clone()
    at[:, 0] += 0.6 * torch.as_tensor(way)
    at[:, 1] -= 0.8 * torch.as_tensor(way)
    place(env, at)


def climb(env: Any) -> torch.Tensor:
    """Rows after all worlds start anew."""
    curriculums.rows(env, torch.arange(env.num_envs), promotion=4.0, demotion=0.5)
    return env.scene.terrain.terrain_levels


def test_more_than_four_metres_lead_a_row_up(climbing: Any) -> None:
    ask(climbing, 0.0)
    walk(climbing, 4.01)
    assert (climb(climbing) == 5).all()
    walk(climbing, 3.99)
    assert (climb(climbing) == 5).all()


def test_less_than_half_of_the_commanded_distance_leads_a_row_down(climbing: Any) -> None:
    # 0.3 m/s for 20 sqrt(s) s: half of that is 3 sqrt(s) m.
    ask(climbing, 0.18, 0.24)
    walk(climbing, 3 * roots(climbing) - 0.01)
    rows = climb(climbing)
    # The giraffe's way of 4.9 m leads up, whatever was asked for.
    assert (rows == torch.where(3 * roots(climbing) - 0.01 > 4.0, 5, 3)).all()
    ask(climbing, 0.12, 0.16)
    climbing.scene.terrain.terrain_levels[:] = 4
    walk(climbing, 2 * roots(climbing) + 0.01)
    assert (climb(climbing) == 4).all()
    walk(climbing, 2 * roots(climbing) - 0.01)
    assert (climb(climbing) == 3).all()


def test_no_robot_moves_below_the_first_row_or_past_the_last(climbing: Any) -> None:
    ask(climbing, 1.0)
    climbing.scene.terrain.terrain_levels[:] = 0
    walk(climbing, 0.1)
    assert (climb(climbing) == 0).all()
    seen = set()
    for seed in range(20):
        torch.manual_seed(seed)
        climbing.scene.terrain.terrain_levels[:] = 9
        walk(climbing, 5.0)
        seen |= set(climb(climbing).tolist())
    assert seen == set(range(10))


def test_the_first_reset_moves_no_robot(climbing: Any) -> None:
    climbing.common_step_counter = 0
    ask(climbing, 1.0)
    for way in (0.0, 9.0):
        walk(climbing, way)
        assert (climb(climbing) == 4).all()


def test_worlds_that_restart_begin_on_the_patch_of_their_new_row(climbing: Any) -> None:
    walk(climbing, 5.0)
    curriculums.rows(climbing, torch.tensor([3, 8]), promotion=4.0, demotion=0.5)
    terrain = climbing.scene.terrain
    rows = terrain.terrain_levels
    assert rows.tolist() == [5 if i in (3, 8) else 4 for i in range(climbing.num_envs)]
    at = terrain.terrain_origins[rows, terrain.terrain_types]
    torch.testing.assert_close(climbing.scene.env_origins, at)


def test_the_log_has_the_mean_row(climbing: Any) -> None:
    terrain = climbing.scene.terrain
    terrain.terrain_levels[:] = terrain.terrain_types
    none = torch.tensor([], dtype=torch.long)
    found = curriculums.rows(climbing, none, promotion=4.0, demotion=0.5)
    assert float(found) == pytest.approx(float(terrain.terrain_types.float().mean()))


def test_the_log_has_the_hardest_row_of_a_robot_on_stairs(climbing: Any, flat: Any) -> None:
    patches = list(climbing.scene.terrain.cfg.terrain_generator.sub_terrains)
    kinds = [patches[i] for i in climbing.scene.terrain.terrain_types.tolist()]
    on_stairs = [i for i, kind in enumerate(kinds) if kind.startswith("stairs")]
    off = next(i for i, kind in enumerate(kinds) if not kind.startswith("stairs"))
    climbing.scene.terrain.terrain_levels[off] = 9
    climbing.scene.terrain.terrain_levels[on_stairs[0]] = 6
    assert Tally(climbing, ALONE)._hardest_row().tolist() == [6.0]
    assert Tally(flat, ALONE)._hardest_row().tolist() == []  # There are no stairs.
