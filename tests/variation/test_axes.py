"""What is varied, and how designs are drawn."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.variation import axes, sampling

pytest.importorskip("scipy")  # Sobol samples are scipy's.

SPEC = draft.load("quadruped")
TWO = axes.parse(SPEC, ["thigh_length=0.2:0.7", "actuators.leg.peak_torque=40:500:log"])
LISTED = axes.parse(SPEC, ["thigh_length=0.2:0.7", "shank_length=0.2,0.3,0.5"])


@pytest.mark.parametrize("kind", ["sobol", "grid", "random"])
@given(start=st.integers(0, 900), count=st.integers(1, 300), seed=st.integers(0, 9))
def test_a_block_alone_is_what_it_is_among_all(
    kind: sampling.Sampler, start: int, count: int, seed: int
) -> None:
    for varied in (TWO, LISTED):
        n = sampling.rounded(varied, kind, 1200)
        whole = sampling.draw(varied, kind, n, seed, 0, n)
        count = min(count, n - start)
        block = sampling.draw(varied, kind, n, seed, start, count)
        for name, values in whole.items():
            np.testing.assert_array_equal(block[name], values[start : start + count])


@pytest.mark.parametrize("kind", ["sobol", "random"])
def test_seeds_differ_and_repeat(kind: sampling.Sampler) -> None:
    draws = [sampling.draw(TWO, kind, 64, seed, 0, 64)["thigh_length"] for seed in (1, 1, 2)]
    np.testing.assert_array_equal(draws[0], draws[1])
    assert not np.array_equal(draws[0], draws[2])


@given(
    low=st.floats(0.1, 0.5),
    width=st.floats(1e-6, 0.39),
    log=st.sampled_from(["", ":log"]),
    kind=st.sampled_from(["sobol", "grid", "random"]),
)
def test_no_value_leaves_its_range(
    low: float, width: float, log: str, kind: sampling.Sampler
) -> None:
    varied = axes.parse(SPEC, [f"thigh_length={low!r}:{low + width!r}{log}"])
    drawn = sampling.draw(varied, kind, 300, 0, 0, 300)["thigh_length"]
    assert drawn.min() >= low
    assert drawn.max() <= low + width


def test_a_logarithmic_range_has_half_its_rows_below_its_geometric_mean() -> None:
    torque = sampling.draw(TWO, "sobol", 1024, 0, 0, 1024)["actuators.leg.peak_torque"]
    assert np.mean(torque < np.sqrt(40 * 500)) == pytest.approx(0.5, abs=0.01)


def test_a_grid_has_as_many_points_along_every_range_and_its_ends() -> None:
    assert sampling.rounded(TWO, "grid", 1000) == 31 * 31
    assert sampling.rounded(LISTED, "grid", 1000) == 333 * 3
    assert sampling.rounded(TWO, "grid", 1) == 4
    grid = sampling.draw(LISTED, "grid", 12, 0, 0, 12)
    assert sorted(set(grid["thigh_length"])) == pytest.approx(
        [0.2, 0.2 + 0.5 / 3, 0.7 - 0.5 / 3, 0.7]
    )
    assert list(grid["shank_length"]) == [0.2, 0.3, 0.5] * 4


def test_listed_values_all_come_as_often() -> None:
    drawn = sampling.draw(LISTED, "sobol", 3 * 512, 0, 0, 3 * 512)["shank_length"]
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
        axes.parse(SPEC, words, {"trunk_width": 0.2})
    assert message in str(raised.value)
