"""Targets of learned metrics: the search, with roll-outs replaced by a formula and noise."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

import draft
import draft.explore.learned_solve as module
from draft.design import Design
from draft.errors import DraftError
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.learned_metrics import walkers
from draft.learn.measuring.paired_metrics import RESAMPLES, Paired
from draft.learn.measuring.policies import Source
from draft.values import Array

QUADRUPED = draft.load("quadruped")
CHEETAH = QUADRUPED.resolve("cheetah")
NOISE, COMMON = 0.056, 0.16  # Of one roll-out, own and common to all bodies [m/s].
SPEED = "learned.top_speed"


def speed(design: Design) -> Array:
    """Top speed by a formula, which levels off at 4 m/s."""
    leg = design.actuators["leg"]
    torque, ratio = np.asarray(leg.peak_torque) / 72.0, np.asarray(leg.gear_ratio) / 6.0
    heavy = np.asarray(design.parameters["trunk_length"]) / 0.52
    ahead = 1.0 * (torque - 1) + 0.3 * (ratio - 1) - 0.5 * (heavy - 1)
    return np.atleast_1d(3.8 + 0.3 * np.tanh(ahead / 0.3))


def rolled_out(
    source: Source,
    design: Design,
    names: Sequence[str],
    rollouts: BodyRollOuts,
    report: object = None,
    rows: NDArray[np.intp] | None = None,
) -> Paired:
    members, reasons = walkers(source, design, rows)
    count = design.count or 1
    rng = np.random.default_rng([rollouts.seed, rollouts.replicas, count])
    common = np.random.default_rng([rollouts.seed, rollouts.replicas])
    size = np.sqrt(rollouts.replicas)
    value = speed(design) + common.normal(0, COMMON / size)
    value = value + rng.normal(0, NOISE / size, count)
    again = common.normal(0, COMMON / size, (RESAMPLES, 1))
    again = value + again + rng.normal(0, NOISE / size, (RESAMPLES, count))
    inside = np.ones(count)
    return Paired(
        {SPEED: value, "learned.inside": inside},
        {SPEED: again, "learned.inside": np.tile(inside, (RESAMPLES, 1))},
        members,
        reasons,
        len(members) * rollouts.replicas,
    )


@pytest.fixture(autouse=True)
def by_formula(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "paired", rolled_out)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_solution_meets_all_at_little_more_than_the_least_change(seed: int) -> None:
    found = draft.solve(CHEETAH, [f"{SPEED} >= 3.9", "mass <= 36"], seed=seed)
    assert found.conflict is None
    assert speed(found.design)[0] >= 3.9 - 0.02
    assert float(found.design.mass) <= 36
    alone = draft.solve(CHEETAH, ["leg.peak_torque >= 80"])
    assert 0.5 * alone.change < found.change < 2.5 * alone.change
    why = {one.name: one.why for one in found.moved}["actuators.leg.peak_torque"]
    assert re.match(rf"{re.escape(SPEED)} >= 3.9, and it is 3\.\d+ ± 0\.\d+", why[0])
    assert 500 < found.rollouts < 2500


def test_equal_seeds_give_equal_solutions() -> None:
    first, second = (draft.solve(CHEETAH, [f"{SPEED} >= 3.9"], seed=3) for _ in range(2))
    assert first.moved == second.moved


def test_conditions_that_are_met_change_nothing() -> None:
    found = draft.solve(CHEETAH, [f"{SPEED} >= 3.5", "mass <= 40"])
    assert found.design is CHEETAH
    assert not found.moved


def test_a_speed_beyond_reach_says_what_was_reached() -> None:
    found = draft.solve(CHEETAH, [f"{SPEED} >= 4.3", "mass <= 40"])
    assert found.conflict is not None
    assert found.conflict.conditions == (f"{SPEED} >= 4.3",)
    assert re.match(rf"{re.escape(SPEED)} >= 4.3, and it is [34]\.\d+", found.conflict.misses[0])
    (note,) = found.notes
    assert re.match(r"the policy was commanded up to \d\.\d\d m/s at this size", note)


def test_conditions_in_closed_form_that_conflict_need_no_rollout() -> None:
    found = draft.solve(CHEETAH, [f"{SPEED} >= 3.9", "mass <= 5"])
    assert found.conflict is not None
    assert found.conflict.conditions == ("mass <= 5",)
    assert found.rollouts == 0


def test_a_design_that_falls_is_no_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.explore.test_learned_solve.speed", lambda _: np.array([np.nan]))
    with pytest.raises(DraftError, match=r"quadruped:cheetah has no learned\.top_speed: it falls"):
        draft.solve(CHEETAH, [f"{SPEED} >= 3.9"])


@pytest.mark.parametrize(
    ("conditions", "message"),
    [
        (["learned.topspeed > 1"], "there is no metric 'learned.topspeed'"),
        ([f"{SPEED} > 1", "impact_mitigation > 0"], "`impact_mitigation > 0` needs a compiled"),
        ([f"q10({SPEED}) > 1"], f"a quantile of '{SPEED}' would need models or roll-outs"),
        ([f"{SPEED} > 5", f"{SPEED} < 4"], "exclude each other"),
    ],
)
def test_conditions_that_make_no_sense_are_refused(conditions: list[str], message: str) -> None:
    with pytest.raises(DraftError, match=re.escape(message)):
        draft.solve(CHEETAH, conditions)


def test_a_robot_that_the_policy_does_not_drive_is_refused() -> None:
    with pytest.raises(DraftError, match="hopper cannot be trained: it has one leg"):
        draft.solve(draft.load("hopper").resolve(), [f"{SPEED} >= 3.9"])


def test_a_design_that_the_filter_refuses_is_no_start() -> None:
    refused = QUADRUPED.resolve("bear", {"actuators.leg.peak_torque": 500.0})
    assert not refused.accepted
    with pytest.raises(DraftError, match="is refused, and learned metrics are of accepted"):
        draft.solve(refused, [f"{SPEED} >= 3.9"])
