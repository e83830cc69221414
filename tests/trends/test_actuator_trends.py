"""The shipped actuator laws are the catalogue's, and print the published digits."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.trends import actuators as law
from draft.trends import fitting, refit
from draft.trends.catalogue import Part, catalogue

positive = st.floats(0.1, 1e3)


def _geared() -> list[Part]:
    return [part for part in catalogue().values() if part.gear_ratio is not None]


def _parts(record: dict[str, Any]) -> tuple[dict[str, Any], list[float]]:
    """What of a law's record is words and whole numbers, and what was computed."""
    words = {key: x for key, x in record.items() if isinstance(x, (str, int))}
    words |= {"names": [*record["exponents"], *record["ranges"]]}
    numbers = [x for x in record.values() if isinstance(x, float)]
    ranges = [x for pair in record["ranges"].values() for x in pair]
    return words, [*numbers, *record["exponents"].values(), *ranges]


def test_the_coefficients_file_is_what_a_fit_to_the_catalogue_gives() -> None:
    shipped = json.loads(law.FILE.read_text(encoding="utf-8"))
    fresh = refit.actuator_trends()
    assert list(shipped) == list(fresh)
    for quantity, record in fresh.items():
        words, numbers = _parts(record)
        shipped_words, shipped_numbers = _parts(shipped[quantity])
        assert shipped_words == words
        # Linear algebra differs in the last digits from one machine to the next.
        assert shipped_numbers == pytest.approx(numbers, rel=1e-8)


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
    trend = law.trends()[quantity]
    assert trend.n == n
    assert coefficient is None or f"{trend.coefficient:.3g}" == coefficient
    assert {name: f"{e:.3f}" for name, e in trend.exponents.items()} == exponents


def test_the_volume_law_has_the_published_divisor() -> None:
    assert f"{1 / law.trends()['volume'].coefficient:.0f}" == "23948"


@pytest.mark.parametrize(
    ("quantity", "printed"),
    [("gear_ratio", "0.89"), ("mass", "0.90"), ("volume", "0.87"), ("aspect_ratio", "0.64")],
)
def test_a_law_explains_its_published_share_of_the_variance(quantity: str, printed: str) -> None:
    assert f"{law.trends()[quantity].r_squared:.2f}" == printed


def test_the_rotor_law_explains_84_to_87_percent() -> None:
    assert 0.84 <= round(law.trends()["rotor_inertia"].r_squared, 2) <= 0.87


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
    assert f"{law.trends()[quantity].leave_one_out:.2f}" == printed


def test_with_a_parts_own_shape_its_sizes_have_a_third_of_the_volumes_error() -> None:
    parts = _geared()
    inputs = np.array([[p.peak_torque, p.gear_ratio or math.nan] for p in parts])
    volume = fitting.leave_one_out(inputs, np.array([p.volume for p in parts]))
    aspect = np.array([p.aspect_ratio for p in parts])
    radius = np.cbrt(volume / (2 * np.pi * aspect))
    for predicted, published in (
        (radius, [p.radius for p in parts]),
        (2 * aspect * radius, [p.length for p in parts]),
    ):
        error = fitting.gmfe(predicted, np.array(published))
        assert error == pytest.approx(law.trends()["volume"].leave_one_out ** (1 / 3), rel=1e-8)
        assert f"{error:.2f}" == "1.09"


def test_mass_with_a_vendor_held_out_is_off_by_1_31() -> None:
    parts, geared = list(catalogue().values()), _geared()
    torque = np.array([p.peak_torque for p in parts])[:, None]
    mass = np.array([p.mass for p in parts])
    predicted = fitting.leave_group_out(torque, mass, [p.vendor for p in parts])
    scored = np.array([p.gear_ratio is not None for p in parts])
    assert scored.sum() == len(geared) == 103
    assert f"{fitting.gmfe(predicted[scored], mass[scored]):.2f}" == "1.31"


def test_the_speed_of_a_reduction_has_the_published_law() -> None:
    parts = _geared()
    ratio = np.array([p.gear_ratio or math.nan for p in parts])
    speed = np.array([p.no_load_speed for p in parts])
    intercept, exponent = fitting.fit(ratio[:, None], speed)
    assert (f"{math.exp(intercept):.1f}", f"{exponent:.3f}") == ("228.5", "-0.938")
    assert law.no_load_speed(17.0) == pytest.approx(math.exp(intercept) * 17.0**exponent, rel=1e-8)


def test_density_of_gear_stress_is_the_volume_law_in_other_words() -> None:
    parts = _geared()
    inputs = np.array([[p.peak_torque, p.gear_ratio or math.nan] for p in parts])
    volume = np.array([p.volume for p in parts])
    stress = inputs[:, 0] / (2 * inputs[:, 1] * volume)
    logc, tau, ratio = fitting.fit(inputs, stress)
    printed = (f"{math.exp(logc):.0f}", f"{tau:.3f}", f"{ratio:.3f}")
    assert printed == ("11974", "0.300", "-0.833")


def test_rotor_inertia_grows_with_the_fourth_power_where_the_exponent_is_free() -> None:
    parts = [p for p in _geared() if p.rotor_inertia is not None and not p.small_geared_inrunner]
    radius = np.array([p.radius for p in parts])
    inertia = np.array([p.rotor_inertia or math.nan for p in parts])
    assert f"{fitting.fit(radius[:, None], inertia)[1]:.2f}" == "4.02"
    logs = np.log(inertia / radius**4)
    k = np.exp((logs.sum() - logs) / (len(logs) - 1))
    assert f"{fitting.gmfe(k * radius**4, inertia):.2f}" == "1.44"


@given(positive, positive)
def test_reduction_and_speed_are_inverses(ratio: float, speed: float) -> None:
    assert law.gear_ratio(law.no_load_speed(ratio)) == pytest.approx(ratio)
    assert law.no_load_speed(law.gear_ratio(speed)) == pytest.approx(speed)


@given(positive, positive)
def test_a_radius_encloses_its_volume(volume: float, aspect: float) -> None:
    radius = law.radius(volume, aspect)
    assert math.pi * radius**2 * (2 * aspect * radius) == pytest.approx(volume)


@given(st.lists(st.tuples(positive, positive), min_size=1, max_size=5))
def test_laws_give_arrays_what_they_give_floats(pairs: list[tuple[float, float]]) -> None:
    a, b = np.array(pairs).T
    for function in (law.volume, law.aspect_ratio, law.peak_torque, law.radius):
        single = [function(x, y) for x, y in pairs]
        assert function(a, b) == pytest.approx(single, rel=1e-13)
    for function in (law.mass, law.rotor_inertia, law.gear_ratio, law.no_load_speed):
        assert function(a) == pytest.approx([function(x) for x, _ in pairs], rel=1e-13)


@given(st.floats(0.05, 0.99), st.sampled_from(sorted(law.trends())))
def test_a_wider_band_holds_more_modules(share: float, quantity: str) -> None:
    trend = law.trends()[quantity]
    assert 1.0 < trend.band(share) < trend.band(share + 0.005)


def test_about_nine_in_ten_modules_lie_in_the_90_percent_band_of_reductions() -> None:
    band = law.trends()["gear_ratio"].band(0.9)
    folds = [abs(math.log(p.gear_ratio / law.gear_ratio(p.no_load_speed))) for p in _geared()]  # type: ignore[operator]
    assert 0.85 <= np.mean(np.array(folds) < math.log(band)) <= 0.97
