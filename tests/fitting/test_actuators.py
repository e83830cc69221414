"""The shipped actuator laws are the catalogue's, and print the published digits."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.fitting.actuators import catalogue_refit as refit
from draft.fitting.least_squares import fit, leave_group_out
from draft.fitting.scores import fold_error
from draft.laws.actuators import FILE, SETS, laws, radius
from draft.laws.catalogue import Part, catalogue

PAPER = laws("paper").trends
positive = st.floats(0.1, 1e3)


def _geared() -> list[Part]:
    return [part for part in catalogue().values() if part.gear_ratio is not None]


def _leaves(record: Any) -> list[Any]:
    """Numbers and words of nested data, in order."""
    if isinstance(record, dict):
        return [x for key, value in record.items() for x in (key, *_leaves(value))]
    if isinstance(record, list):
        return [x for value in record for x in _leaves(value)]
    return [record]


@pytest.mark.slow
def test_the_coefficients_file_is_what_a_fit_to_the_catalogue_gives() -> None:
    shipped = _leaves(json.loads(FILE.read_text(encoding="utf-8")))
    fresh = _leaves(refit.actuator_trends())
    # Linear algebra differs in the last digits from one machine to the next.
    assert [x for x in shipped if not isinstance(x, float)] == [
        x for x in fresh if not isinstance(x, float)
    ]
    assert [x for x in shipped if isinstance(x, float)] == pytest.approx(
        [x for x in fresh if isinstance(x, float)], rel=1e-7, abs=1e-9
    )


@pytest.mark.parametrize(
    ("quantity", "n", "coefficient", "exponents"),
    [
        ("gear_ratio", 103, "327", {"no_load_speed": "-1.066"}),
        ("mass", 103, "0.0653", {"peak_torque": "0.666"}),
        ("volume", 103, None, {"peak_torque": "0.700", "gear_ratio": "-0.167"}),
        ("aspect_ratio", 103, "0.401", {"peak_torque": "-0.098", "gear_ratio": "0.316"}),
        ("rotor_inertia", 88, "27.2", {"radius": "4.000"}),
    ],
)
def test_a_law_has_its_published_coefficients(
    quantity: str, n: int, coefficient: str | None, exponents: dict[str, str]
) -> None:
    trend = PAPER[quantity]
    assert trend.n == n
    assert coefficient is None or f"{trend.coefficient:.3g}" == coefficient
    assert {name: f"{e:.3f}" for name, e in trend.exponents.items()} == exponents


def test_the_volume_law_has_the_published_divisor() -> None:
    assert f"{1 / PAPER['volume'].coefficient:.0f}" == "23948"


@pytest.mark.parametrize(
    ("quantity", "printed"),
    [("gear_ratio", "0.89"), ("mass", "0.90"), ("volume", "0.87"), ("aspect_ratio", "0.64")],
)
def test_a_law_explains_its_published_share_of_the_variance(quantity: str, printed: str) -> None:
    assert f"{PAPER[quantity].r_squared:.2f}" == printed


def test_the_rotor_law_explains_84_to_87_percent() -> None:
    assert 0.84 <= round(PAPER["rotor_inertia"].r_squared or 0.0, 2) <= 0.87


@pytest.mark.parametrize(
    ("quantity", "printed"),
    [
        ("mass", "1.28"),
        ("volume", "1.30"),
        ("radius", "1.12"),
        ("length", "1.14"),
        ("rotor_inertia", "1.56"),
        ("aspect_ratio", "1.19"),
        ("gear_ratio", "1.33"),
    ],
)
def test_a_law_has_its_published_held_out_error(quantity: str, printed: str) -> None:
    assert f"{PAPER[quantity].held_out['row']:.2f}" == printed


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


def test_mass_with_a_vendor_held_out_is_off_by_1_31() -> None:
    parts, geared = list(catalogue().values()), _geared()
    torque = np.array([p.peak_torque for p in parts])[:, None]
    mass = np.array([p.mass for p in parts])
    predicted = leave_group_out(torque, mass, [p.vendor for p in parts])
    scored = np.array([p.gear_ratio is not None for p in parts])
    assert scored.sum() == len(geared) == 103
    assert f"{fold_error(np.log(predicted[scored] / mass[scored])):.2f}" == "1.31"


def test_the_speed_of_a_reduction_has_the_published_law() -> None:
    parts = _geared()
    ratio = np.array([p.gear_ratio or math.nan for p in parts])
    speed = np.array([p.no_load_speed for p in parts])
    intercept, exponent = fit(ratio[:, None], speed)
    assert (f"{math.exp(intercept):.1f}", f"{exponent:.3f}") == ("228.5", "-0.938")
    assert PAPER["gear_ratio"].inverse(17.0) == pytest.approx(
        math.exp(intercept) * 17.0**exponent, rel=1e-8
    )


def test_density_of_gear_stress_is_the_volume_law_in_other_words() -> None:
    parts = _geared()
    inputs = np.array([[p.peak_torque, p.gear_ratio or math.nan] for p in parts])
    volume = np.array([p.volume for p in parts])
    stress = inputs[:, 0] / (2 * inputs[:, 1] * volume)
    logc, tau, ratio = fit(inputs, stress)
    printed = (f"{math.exp(logc):.0f}", f"{tau:.3f}", f"{ratio:.3f}")
    assert printed == ("11974", "0.300", "-0.833")


def test_rotor_inertia_grows_with_the_fourth_power_where_the_exponent_is_free() -> None:
    parts = [p for p in _geared() if p.rotor_inertia is not None and not p.small_geared_inrunner]
    radius = np.array([p.radius for p in parts])
    inertia = np.array([p.rotor_inertia or math.nan for p in parts])
    assert f"{fit(radius[:, None], inertia)[1]:.2f}" == "4.02"
    logs = np.log(inertia / radius**4)
    k = np.exp((logs.sum() - logs) / (len(logs) - 1))
    assert f"{fold_error(np.log(k * radius**4 / inertia)):.2f}" == "1.44"


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
