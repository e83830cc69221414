"""Conditions on the rows to keep."""

from __future__ import annotations

import numpy as np
import pytest

import draft
from draft.explore import where
from draft.variation import axes, sampling
from tests.explore.small import metric

SPEC = draft.load("quadruped")
TWO = axes.parse(SPEC, ["thigh_length=0.2:0.7", "actuators.leg.peak_torque=40:500:log"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (" ", "`where` is empty"),
        ("leg.mass <", "`where`:1:11: 'leg.mass <' is not an expression: invalid syntax"),
        ("accepted and masss < 4", "`where`:1:14: unknown name 'masss'"),
        ("acepted", "did you mean 'accepted'?"),
        ("thigh_lenght > 1", "did you mean 'thigh_length'?"),
        ("leg < 1", "'leg' is an actuator class, not a number"),
        ("lg.mass < 1", "`where`:1:1: unknown actuator class 'lg'\n  did you mean 'leg'?"),
        ("1 < leg.mas", "`where`:1:5: an actuator has no 'mas' to read\n  did you mean 'mass'?"),
        ("print(1)", "unknown function 'print'"),
        ("accepted; 1", "`where`:1:9: 'accepted; 1' is not an expression"),
        ("mass < 30 kg", "write 30 without 'kg': all numbers are in SI units"),
        ("mass = 30", "write == to compare"),
        ("[1]", "'[1]' is not allowed in an expression"),
    ],
)
def test_what_is_no_condition_is_said_with_its_column(text: str, message: str) -> None:
    with pytest.raises(draft.DraftError) as raised:
        where.condition(SPEC, text)
    assert message in str(raised.value)


@pytest.mark.parametrize("text", ["mass", "accepted and leg.mass", "thigh_length"])
def test_a_number_is_no_condition(text: str) -> None:
    name = text.rpartition(" ")[2]
    with pytest.raises(draft.DraftError, match=f"'{name}' is a number, not a condition"):
        where.parts(SPEC, text)
    assert where.parts(SPEC, f"{text} > 1 and accepted and not accepted")


def test_a_condition_reads_parameters_actuators_metrics_and_the_verdict(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    metric(monkeypatch)
    condition = where.condition(
        SPEC, "accepted and not leg.mass > 1 or thigh_length > 0.65 and weight"
    )
    assert condition.metrics == ("weight",)
    drawn = sampling.draw(TWO, "sobol", 256, 0, 0, 256)
    design = SPEC.resolve(drawn)
    holds = condition.holds(design, {"weight": np.where(drawn["thigh_length"] > 0.68, np.nan, 1.0)})
    light = design.accepted & (design.actuators["leg"].mass <= 1)
    long = drawn["thigh_length"] > 0.65
    np.testing.assert_array_equal(holds, light | long & (drawn["thigh_length"] <= 0.68))


def test_a_condition_on_what_is_the_same_for_all_keeps_all_or_none() -> None:
    design = SPEC.resolve({"thigh_length": np.array([0.2, 0.3])})
    assert where.condition(SPEC, "shank_length > 0.1").holds(design, {}).tolist() == [True, True]
    assert where.condition(SPEC, "shank_length > 1").holds(design, {}).tolist() == [False, False]
