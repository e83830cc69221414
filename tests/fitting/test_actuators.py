"""The shipped actuator laws are the catalogue's, and print the published digits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.fitting.least_squares import fit, leave_group_out
from draft.fitting.scores import fold_error
from draft.laws.actuators import SETS, laws, radius
from draft.laws.catalogue import Part, catalogue

PAPER = laws("paper").trends
positive = st.floats(0.1, 1e3)


def _geared() -> list[Part]:
    return [part for part in catalogue().values() if part.gear_ratio is not None]


# The published digits are in test_published.py.
def test_the_speed_of_a_reduction_is_the_fit_of_the_other_way() -> None:
    parts = _geared()
    ratio = np.array([p.gear_ratio or math.nan for p in parts])
    intercept, exponent = fit(ratio[:, None], np.array([p.no_load_speed for p in parts]))
    speed = math.exp(intercept) * 17.0**exponent
    assert PAPER["gear_ratio"].inverse(17.0) == pytest.approx(speed, rel=1e-8)
    assert PAPER["rotor_inertia"].exponents == {"radius": 4.0}


def test_with_a_parts_own_shape_its_sizes_have_a_third_of_the_volumes_error() -> None:
    parts = _geared()
    inputs = np.array([[p.peak_torque, p.gear_ratio or math.nan] for p in parts])
    volume = leave_group_out(inputs, np.array([p.volume for p in parts]), range(len(parts)))
    aspect = np.array([p.aspect_ratio for p in parts])
    r = np.cbrt(volume / (2 * np.pi * aspect))
    for predicted, published in (
        (r, [p.radius for p in parts]),
        (2 * aspect * r, [p.length for p in parts]),
    ):
        error = fold_error(np.log(predicted / np.array(published)))
        assert error == pytest.approx(PAPER["volume"].held_out["row"] ** (1 / 3), rel=1e-8)
        assert f"{error:.2f}" == "1.09"


@given(positive, positive)
def test_reduction_and_speed_are_inverses(ratio: float, speed: float) -> None:
    for which in SETS:
        law = laws(which).trends["gear_ratio"]
        assert law(law.inverse(ratio)) == pytest.approx(ratio)
        assert law.inverse(law(speed)) == pytest.approx(speed)


@given(positive, positive)
def test_a_radius_encloses_its_volume(volume: float, aspect: float) -> None:
    r = radius(volume, aspect)
    assert math.pi * r**2 * (2 * aspect * r) == pytest.approx(volume)


@given(st.lists(st.tuples(*[positive] * 3), min_size=1, max_size=5), st.sampled_from(SETS))
def test_laws_give_arrays_what_they_give_floats(
    rows: list[tuple[float, float, float]], which: str
) -> None:
    for law in laws(which).trends.values():
        k = len(law.inputs)
        if not law.terms:
            continue
        single = [law(*row[:k]) for row in rows]
        assert law(*np.array(rows).T[:k]) == pytest.approx(single, rel=1e-12)


@given(st.floats(0.05, 0.99), st.sampled_from(sorted(PAPER)))
def test_a_wider_band_holds_more_modules(share: float, quantity: str) -> None:
    trend = PAPER[quantity]
    assert 1.0 < trend.band(share) < trend.band(share + 0.005)


def test_about_nine_in_ten_modules_lie_in_the_90_percent_band_of_reductions() -> None:
    band = PAPER["gear_ratio"].band(0.9)
    folds = [abs(math.log(p.gear_ratio / PAPER["gear_ratio"](p.no_load_speed))) for p in _geared()]  # type: ignore[operator]
    assert 0.85 <= np.mean(np.array(folds) < math.log(band)) <= 0.97
