"""Structural mass follows m = c L^e inside the surveyed lengths, and mass per metre outside."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.laws.law import Law
from draft.laws.structure import population

PEOPLE = ("humanoid", "quadruped")
TRENDS = [
    pytest.param(law, id=f"{people}-{name}")
    for people in PEOPLE
    for name, law in population(people).segments.items()
]
trends = st.sampled_from([case.values[0] for case in TRENDS])
anywhere = st.floats(1e-3, 5.0)


@given(trends, st.floats(0.0, 1.0))
def test_inside_its_lengths_a_class_weighs_c_times_length_to_the_e(
    trend: Law, share: float
) -> None:
    low, high = trend.range
    length = low + share * (high - low)
    assert trend(length) == pytest.approx(trend.coefficient * length**trend.exponent)
    assert not trend.outside(length)


@given(trends, st.floats(1.01, 10))
def test_outside_its_lengths_a_class_keeps_the_mass_per_metre_of_the_edge(
    trend: Law, factor: float
) -> None:
    for edge, length in (
        (trend.range[0], trend.range[0] / factor),
        (trend.range[1], trend.range[1] * factor),
    ):
        assert trend(length) / length == pytest.approx(trend(edge) / edge)


@pytest.mark.parametrize("trend", TRENDS)
def test_mass_does_not_jump_at_the_edges_and_they_are_known_to_half_a_millimetre(
    trend: Law,
) -> None:
    low, high = trend.range
    for edge in (low, high):
        below, above = trend(edge * (1 - 1e-9)), trend(edge * (1 + 1e-9))
        assert below == pytest.approx(above, rel=1e-7)
    assert all(map(trend.outside, (low - 6e-4, high + 6e-4)))
    assert not any(map(trend.outside, (low - 4e-4, high + 4e-4)))


@given(trends, anywhere, st.floats(1.001, 3))
def test_a_longer_segment_outside_the_fit_is_never_lighter(
    trend: Law, length: float, factor: float
) -> None:
    # A flat fit (exponent 0) holds its mass; every other class gains with length.
    assert trend(length * factor) >= trend(length) * (1 - 1e-12)


@given(trends, st.lists(anywhere, min_size=1, max_size=6))
def test_arrays_weigh_what_floats_weigh(trend: Law, lengths: list[float]) -> None:
    array = np.array(lengths)
    assert trend(array) == pytest.approx([trend(x) for x in lengths], rel=1e-13)
    assert list(trend.outside(array)) == [trend.outside(x) for x in lengths]  # type: ignore[arg-type]


def test_the_shipped_trends_are_the_printed_ones_where_the_files_allow() -> None:
    # tests/fitting pins every digit; here: the loader reads what the file says.
    quadruped, humanoid = population("quadruped"), population("humanoid")
    thigh = quadruped.segments["thigh"]
    assert (thigh.n, round(thigh.coefficient, 1), round(thigh.exponent, 2)) == (60, 28.3, 2.69)
    assert list(humanoid.segments)[:3] == ["thigh", "shank", "hip_link"]
    assert (round(humanoid.trunk_density), humanoid.trunk.n) == (715, 13)
    assert (round(quadruped.trunk_density), quadruped.trunk.n) == (654, 20)
    assert (humanoid.allometry.coefficient, humanoid.allometry.exponent) == (37.1, 1.33)
    assert (quadruped.allometry.coefficient, quadruped.allometry.exponent) == (136, 2.47)


@pytest.mark.parametrize("people", PEOPLE)
def test_whole_robots_with_longer_legs_have_more_structure(people: str) -> None:
    law = population(people).whole
    low, high = law.range
    assert 0 < law(low) < law(high)
    assert law(np.array([low, high])) == pytest.approx([law(low), law(high)])


@pytest.mark.parametrize("people", PEOPLE)
def test_leg_length_predicts_held_out_robots_better_than_the_sum_over_classes(
    people: str,
) -> None:
    score = population(people).held_out
    assert score.draft < score.paper < score.median_alone
    assert score.draft_maker_out < score.paper_maker_out
