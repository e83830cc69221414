"""Effects of numbers on metrics, against designs resolved one by one and MuJoCo's models."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.errors import DraftError
from draft.explore.sensitivity import Sensitivity, sensitivity, stated_numbers, step_of
from draft.metrics import of_design
from draft.metrics.measure import of_model
from draft.model.model import preview
from draft.values import scalar
from tests.commands import Command

QUADRUPED = draft.load("quadruped")
BEAR = QUADRUPED.resolve("bear")
TORQUE = "actuators.leg.peak_torque"
FOUND = sensitivity(BEAR)


def effect(found: Sensitivity, field: str, name: str, metric: str) -> float:
    return float(getattr(found, field)[found.names.index(name), found.metrics.index(metric)])


@given(
    name=st.sampled_from(FOUND.names),
    metric=st.sampled_from(FOUND.metrics),
    kind=st.sampled_from(["up", "down", "step_up", "step_down"]),
)
def test_an_effect_is_the_difference_of_two_designs(name: str, metric: str, kind: str) -> None:
    value = FOUND.values[FOUND.names.index(name)]
    step = FOUND.steps[FOUND.names.index(name)] if kind.startswith("step") else 0.01 * value
    step = -step if kind.endswith("down") else step
    moved = QUADRUPED.resolve("bear", {name: value + step})
    before, after = (float(of_design(one, [metric])[metric]) for one in (BEAR, moved))
    wanted = after - before if kind.startswith("step") else (after - before) / abs(before)
    if not math.isfinite(wanted):
        return
    assert effect(FOUND, kind, name, metric) == pytest.approx(wanted, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", ["thigh_length", "trunk_length", TORQUE])
def test_the_effect_on_the_mass_is_that_of_mujocos_models(name: str) -> None:
    value, step = (float(of[FOUND.names.index(name)]) for of in (FOUND.values, FOUND.steps))
    masses = [
        float(preview(QUADRUPED.resolve("bear", {name: x})).mujoco.body_mass.sum())
        for x in (value, value + step)
    ]
    assert effect(FOUND, "step_up", name, "mass") == pytest.approx(masses[1] - masses[0], rel=1e-6)


@pytest.mark.parametrize("metric", ["impact_mitigation", "foot_inertia", "reflected_share"])
def test_the_effect_on_a_metric_of_models_is_that_of_models_built_one_by_one(metric: str) -> None:
    found = sensitivity(BEAR, [metric, "mass"], ["thigh_length", TORQUE], samples=8)
    moved = QUADRUPED.resolve("bear", {"thigh_length": found.values[0] + found.steps[0]})
    before, after = (of_model(one.build(), [metric])[metric] for one in (BEAR, moved))
    assert found.base[0] == pytest.approx(before, rel=1e-9)
    assert found.step_up[0, 0] == pytest.approx(after - before, rel=1e-6)
    assert found.low[0, 0] < found.step_up[0, 0] < found.high[0, 0]
    # The filter refuses more torque, so that there is no model.
    assert math.isnan(found.step_up[1, 0])
    assert not math.isnan(found.step_up[1, 1])


def test_the_band_of_an_effect_is_narrower_than_that_of_the_metric() -> None:
    low, high = (effect(FOUND, end, TORQUE, "mass") for end in ("low", "high"))
    ends = BEAR.mass_band(0.9)
    change = effect(FOUND, "step_up", TORQUE, "mass")
    assert low < change < high
    assert (high - low) / change < (ends.high - ends.low) / scalar(BEAR.mass)


def test_numbers_without_effect_and_flips_of_the_verdict_are_told() -> None:
    still = dict(zip(FOUND.names, FOUND.still, strict=True))
    assert still["trunk_width"]  # The housings of the hips are wider.
    assert not still[TORQUE]
    accepted = FOUND.accepted[FOUND.names.index(TORQUE)]
    assert accepted.tolist() == [True, True, False]


def test_a_number_at_the_end_of_its_range_has_one_side() -> None:
    design = QUADRUPED.resolve("bear", {"thigh_length": 0.9})
    found = sensitivity(design, ["mass"], ["thigh_length"])
    assert math.isnan(found.up[0, 0])
    assert math.isnan(found.step_up[0, 0])
    assert found.down[0, 0] < 0


def test_numbers_are_those_that_the_design_states() -> None:
    assert "abduction_length" not in stated_numbers(BEAR)  # An expression of the spec.
    given_ = QUADRUPED.resolve("bear", {"thigh_length": "1.1 * shank_length"})
    assert "thigh_length" not in stated_numbers(given_)
    assert "actuators.leg.mass" not in stated_numbers(BEAR)
    assert "actuators.leg.mass" in stated_numbers(
        QUADRUPED.resolve("bear", {"actuators.leg.mass": 5})
    )


@given(st.floats(1e-4, 1e4))
def test_a_step_is_about_a_tenth_and_has_one_digit(value: float) -> None:
    step = step_of(BEAR, "unknown", value)
    assert 0.05 < step / value < 0.2
    assert f"{step:.0e}"[0] in "125"


@pytest.mark.parametrize(
    ("of", "by", "message"),
    [
        (["mas"], [], "there is no metric 'mas'"),
        (["learned.topspeed"], [], "there is no metric 'learned.topspeed'"),
        (["mass"], ["thigh"], "'thigh' is not a parameter"),
        (["mass"], ["abduction_length"], "'abduction_length' follows from 'leg.length + 1.1 *"),
        (["mass"], ["actuators.leg.mass"], "does not state 'actuators.leg.mass'"),
    ],
)
def test_names_that_make_no_sense_are_refused(of: list[str], by: list[str], message: str) -> None:
    with pytest.raises(DraftError, match=re.escape(message)):
        sensitivity(BEAR, of, by)


def test_several_designs_are_refused() -> None:
    many = QUADRUPED.resolve({"thigh_length": np.array([0.2, 0.3])})
    with pytest.raises(DraftError, match="sensitivities are of one design"):
        draft.sensitivity(many)


def test_the_command_prints_what_matters_and_json_all(command: Command, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    said = command("sensitivity bear --figure", tmp_path / "bars.png").out
    assert "without effect: trunk_width, crouch" in said
    assert "actuators.leg.peak_torque: 50 N m more, and the filter refuses it" in said
    assert (tmp_path / "bars.png").is_file()
    record = command.json("sensitivity bear --by thigh_length")
    assert record["metrics"]["mass"] == pytest.approx(scalar(BEAR.mass))
    assert set(record["numbers"]) == {"thigh_length"}
    assert json.dumps(record)
    assert "end its name with" in command.refuses(
        "sensitivity bear --figure", tmp_path / "bars.txt"
    )
