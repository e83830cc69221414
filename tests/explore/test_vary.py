"""What is varied, how designs are drawn, and which are kept."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.explore import sample, vary, where
from tests.explore.small import metric

SPEC = draft.load("quadruped")
TWO = vary.parse(SPEC, ["thigh_length=0.2:0.7", "actuators.leg.peak_torque=40:500:log"])
LISTED = vary.parse(SPEC, ["thigh_length=0.2:0.7", "shank_length=0.2,0.3,0.5"])


@pytest.mark.parametrize("kind", ["sobol", "grid", "random"])
@given(start=st.integers(0, 900), count=st.integers(1, 300), seed=st.integers(0, 9))
def test_a_block_alone_is_what_it_is_among_all(
    kind: sample.Kind, start: int, count: int, seed: int
) -> None:
    for axes in (TWO, LISTED):
        n = sample.rounded(axes, kind, 1200)
        whole = sample.draw(axes, kind, n, seed, 0, n)
        count = min(count, n - start)
        block = sample.draw(axes, kind, n, seed, start, count)
        for name, values in whole.items():
            np.testing.assert_array_equal(block[name], values[start : start + count])


@pytest.mark.parametrize("kind", ["sobol", "random"])
def test_seeds_differ_and_repeat(kind: sample.Kind) -> None:
    draws = [sample.draw(TWO, kind, 64, seed, 0, 64)["thigh_length"] for seed in (1, 1, 2)]
    np.testing.assert_array_equal(draws[0], draws[1])
    assert not np.array_equal(draws[0], draws[2])


@given(
    low=st.floats(0.1, 0.5),
    width=st.floats(1e-6, 0.39),
    log=st.sampled_from(["", ":log"]),
    kind=st.sampled_from(["sobol", "grid", "random"]),
)
def test_no_value_leaves_its_range(low: float, width: float, log: str, kind: sample.Kind) -> None:
    axes = vary.parse(SPEC, [f"thigh_length={low!r}:{low + width!r}{log}"])
    drawn = sample.draw(axes, kind, 300, 0, 0, 300)["thigh_length"]
    assert drawn.min() >= low
    assert drawn.max() <= low + width


def test_a_logarithmic_range_has_half_its_rows_below_its_geometric_mean() -> None:
    torque = sample.draw(TWO, "sobol", 1024, 0, 0, 1024)["actuators.leg.peak_torque"]
    assert np.mean(torque < np.sqrt(40 * 500)) == pytest.approx(0.5, abs=0.01)


def test_a_grid_has_as_many_points_along_every_range_and_its_ends() -> None:
    assert sample.rounded(TWO, "grid", 1000) == 31 * 31
    assert sample.rounded(LISTED, "grid", 1000) == 333 * 3
    assert sample.rounded(TWO, "grid", 1) == 4
    grid = sample.draw(LISTED, "grid", 12, 0, 0, 12)
    assert sorted(set(grid["thigh_length"])) == pytest.approx(
        [0.2, 0.2 + 0.5 / 3, 0.7 - 0.5 / 3, 0.7]
    )
    assert list(grid["shank_length"]) == [0.2, 0.3, 0.5] * 4


def test_listed_values_all_come_as_often() -> None:
    drawn = sample.draw(LISTED, "sobol", 3 * 512, 0, 0, 3 * 512)["shank_length"]
    values, counts = np.unique(drawn, return_counts=True)
    assert list(values) == [0.2, 0.3, 0.5]
    assert counts == pytest.approx([512] * 3, abs=6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "nothing is varied"),
        (("thigh_length",), "`vary` 'thigh_length' gives no range"),
        (("thigh_length=",), "`vary` 'thigh_length=' gives no range"),
        (("thigh_lenght=0.2:0.7",), "did you mean 'thigh_length'?"),
        (("leg.peak_torque=40:50",), "write 'actuators.leg.peak_torque'"),
        (("actuators.lg.peak_torque=40:50",), "did you mean 'leg'?"),
        (("actuators.leg.peak_torq=40:50",), "did you mean 'peak_torque'?"),
        (("actuators.leg.colour=1:2",), "an actuator class has no 'colour' to state"),
        (("actuators.leg.like=1:2",), "is a catalogue part, not a number"),
        (
            ("thigh_length=0.05:0.7",),
            "'thigh_length=0.05:0.7' leaves the range [0.1, 0.9] m of 'thigh_length'",
        ),
        (("payload=-1:5",), "the range [0, 10000] kg of 'payload'"),
        (("thigh_length=0.2,0.95",), "'thigh_length=0.2,0.95' leaves the range [0.1, 0.9] m"),
        (("thigh_length=0.7:0.2",), "the range 0.7:0.2 is empty\n  write the lower end first"),
        (("thigh_length=0.2:0.2",), "the range 0.2:0.2 is empty"),
        (("thigh_length=2*shank_length:0.7",), "'2*shank_length' is not a number"),
        (("thigh_length=nan:0.7",), "'nan' is not a number"),
        (("thigh_length=0.2:inf",), "'inf' is not a number"),
        (("thigh_length=0.2,",), "'' is not a number"),
        (("thigh_length=0.2:0.7:lin",), "'lin' is not 'log'"),
        (("thigh_length=0.2:0.7:log:2",), "'log:2' is not 'log'"),
        (("crouch=0:1:log",), "a logarithmic range cannot start at 0"),
        (("actuators.leg.peak_torque=0:5",), "it must be above zero"),
        (("actuators.leg.friction_loss=-1:5",), "it must be zero or more"),
        (("crouch=0:1", "crouch=0:2"), "`vary` gives 'crouch' twice"),
        (("trunk_width=0.2:0.3",), "'trunk_width' is given by `values` and by `vary`"),
    ],
)
def test_what_cannot_be_varied_is_said(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(draft.DraftError) as raised:
        vary.parse(SPEC, words, {"trunk_width": 0.2})
    assert message in str(raised.value)


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
        ("[1]", "'[1]' is not allowed in an expression"),
    ],
)
def test_what_is_no_condition_is_said_with_its_column(text: str, message: str) -> None:
    with pytest.raises(draft.DraftError) as raised:
        where.condition(SPEC, text)
    assert message in str(raised.value)


def test_a_condition_reads_parameters_actuators_metrics_and_the_verdict(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    metric(monkeypatch)
    condition = where.condition(
        SPEC, "accepted and not leg.mass > 1 or thigh_length > 0.65 and weight"
    )
    assert condition.metrics == ("weight",)
    drawn = sample.draw(TWO, "sobol", 256, 0, 0, 256)
    design = SPEC.resolve(drawn)
    holds = condition.holds(design, {"weight": np.where(drawn["thigh_length"] > 0.68, np.nan, 1.0)})
    light = design.accepted & (design.actuators["leg"].mass <= 1)
    long = drawn["thigh_length"] > 0.65
    np.testing.assert_array_equal(holds, light | long & (drawn["thigh_length"] <= 0.68))


def test_a_condition_on_what_is_the_same_for_all_keeps_all_or_none() -> None:
    design = SPEC.resolve({"thigh_length": np.array([0.2, 0.3])})
    assert where.condition(SPEC, "shank_length > 0.1").holds(design, {}).tolist() == [True, True]
    assert where.condition(SPEC, "shank_length > 1").holds(design, {}).tolist() == [False, False]
