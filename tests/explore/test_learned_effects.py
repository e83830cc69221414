"""Effects on learned metrics, by roll-outs of the policy that ships; slow."""

from __future__ import annotations

import re

import numpy as np
import pytest

pytest.importorskip("mjlab")
pytest.importorskip("torch")

import torch

import draft
from draft.errors import DraftError
from draft.explore.sensitivity import Sensitivity
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.paired_metrics import paired
from draft.learn.measuring.policies import open_source
from draft.learn.measuring.rollout.common_draws import CommonDraws
from draft.metrics import of_design, of_policy
from tests.commands import Command

QUADRUPED = draft.load("quadruped")
CHEETAH = QUADRUPED.resolve("cheetah")
SPEED, TORQUE = "learned.top_speed", "actuators.leg.peak_torque"


def effects(replicas: int, by: tuple[str, ...] = (TORQUE, "trunk_width")) -> Sensitivity:
    return draft.sensitivity(CHEETAH, [SPEED, "mass"], by, replicas=replicas)


@pytest.fixture(scope="module")
def found() -> Sensitivity:
    return effects(8)


def test_more_torque_is_faster_and_a_width_without_effect_is_not_ranked(found: Sensitivity) -> None:
    assert found.metrics == (SPEED, "mass")
    assert found.sizes[0, 0] > 0
    assert found.step_down[0, 0] < 0 < found.step_up[0, 0]
    assert found.down_high[0, 0] < 0
    assert found.sizes[1].tolist() == [0, 0]
    assert found.still.tolist() == [False, True]


def test_closed_metrics_beside_learned_ones_are_what_they_are_alone(found: Sensitivity) -> None:
    alone = draft.sensitivity(CHEETAH, ["mass"], found.names)
    for field in ("base", "up", "step_up", "low", "high"):
        assert np.array_equal(getattr(found, field)[..., 1], getattr(alone, field)[..., 0])
    assert np.isnan(found.up[:, 0]).all()
    assert found.base[1] == pytest.approx(of_design(CHEETAH, ["mass"])["mass"], rel=1e-12)


def test_equal_seeds_give_equal_effects(found: Sensitivity) -> None:
    again = effects(8)
    for field in ("base", "step_up", "step_down", "low", "high", "down_low", "down_high"):
        assert np.array_equal(getattr(found, field), getattr(again, field), equal_nan=True)


def test_the_interval_holds_what_more_rollouts_measure(found: Sensitivity) -> None:
    many = effects(32, (TORQUE,))
    halves = [(one.high[0, 0] - one.low[0, 0]) / 2 for one in (found, many)]
    assert abs(found.step_up[0, 0] - many.step_up[0, 0]) < np.hypot(*halves)  # Both err.
    assert halves[1] < halves[0]


def test_bodies_of_a_batch_have_the_same_draws_whatever_the_others_are() -> None:
    torques = np.array([72.0, 72.0, 60.0])
    many = QUADRUPED.resolve("cheetah", {TORQUE: torques})
    two = QUADRUPED.resolve("cheetah", {TORQUE: torques[:2]})
    rollouts, source = BodyRollOuts(replicas=2, seconds=2.0), open_source(None)
    first, other = (paired(source, one, [SPEED], rollouts) for one in (many, two))
    speeds = first.values[SPEED]
    # Sums of matrices are rounded by their shape, and walking amplifies it a little.
    assert speeds[0] == pytest.approx(speeds[1], abs=1e-3)
    assert speeds[0] == pytest.approx(other.values[SPEED][0], abs=1e-3)
    assert abs(speeds[0] - speeds[2]) > 1e-3


def test_draws_are_those_of_the_replica() -> None:
    def drawn(worlds: int) -> torch.Tensor:
        with CommonDraws(np.arange(worlds) % 2, seed=1):
            torch.rand(3)  # Some worlds: a robot that starts again.
            first = torch.rand(worlds, 3)
            torch.rand(worlds)
            return torch.cat((first, torch.randn_like(torch.zeros(worlds, 3))), dim=1)

    four, eight = drawn(4), drawn(8)
    assert torch.equal(four[0], four[2])
    assert not torch.equal(four[0], four[1])
    assert torch.equal(four, eight[:4])
    assert len(set(four[0].tolist())) == 6


def test_a_solution_is_confirmed_by_another_evaluation() -> None:
    conditions = [f"{SPEED} >= 4.25", "mass <= 36"]
    vary = {TORQUE: (60.0, 110.0), "trunk_length": (0.4, 0.6)}
    solved = draft.solve(CHEETAH, conditions, vary)
    assert solved.conflict is None
    assert solved.moved[0].name == TORQUE
    other = of_policy(solved.design, [SPEED], replicas=32, seed=7)
    assert float(np.asarray(other[SPEED])) >= 4.25
    assert float(solved.design.mass) <= 36


def test_the_command_says_what_chance_hides(command: Command) -> None:
    said = command(f"sensitivity cheetah --of {SPEED} --by {TORQUE} trunk_width --replicas 4").out
    up = r"\+0\.\d+ \(\+0\.\d+\.\.\+0\.\d+\)"
    assert re.search(rf"leg\.peak_torque +72 +\+10 N m +~0 \| {up}", said)
    assert "no effect beyond chance: trunk_width" in said
    assert "with the same noise, starts and kicks" in said


def test_a_robot_that_the_policy_does_not_drive_has_no_effects() -> None:
    with pytest.raises(DraftError, match="hopper cannot be trained: it has one leg"):
        draft.sensitivity(draft.load("hopper").resolve(), [SPEED])
