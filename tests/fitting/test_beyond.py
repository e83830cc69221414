"""Bands below the torques of the catalogue are as wide as the errors at gathered actuators."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from draft.design.actuators import size
from draft.design.bands import actuator_bands
from draft.fitting import beyond as fitting
from draft.fitting.limits import table
from draft.laws.actuators import laws
from draft.laws.beyond import beyond
from draft.laws.servos import EXCLUDED, small_actuators

DOCS = Path(__file__).parents[2] / "docs" / "twins.md"


def test_the_band_of_a_small_actuator_holds_nine_in_ten_of_the_gathered_ones() -> None:
    """Sized by their torque alone, as an import does; before, the bands held 4 of 101."""
    rows = [
        (float(row["stall_torque_Nm"]), float(row["mass_kg"]))
        for row in small_actuators()
        if row["stall_torque_Nm"] and row["mass_kg"] and EXCLUDED not in row["note"]
    ]
    small = [row for row in rows if row[0] < 4.1]
    inside, once = [], []
    for torque, mass in small:
        sized = size("leg", {"peak_torque": torque, "no_load_speed": 6.0}, None)
        low, high = actuator_bands(sized, 0.9)["mass"]
        inside.append(low <= mass <= high)
        once.append(abs(np.log(mass / sized.mass)) <= np.log(laws().trends["mass"].band(0.9)))
    assert len(small) == 101
    assert np.mean(inside) >= 0.9
    assert np.mean(once) < 0.1


def test_the_fit_finds_the_spread_of_made_up_errors() -> None:
    torques = np.geomspace(0.05, 4.0, 4000)
    draws = np.random.default_rng(3).standard_normal(len(torques))
    term = fitting.fit(torques, 0.8 * torques**-0.3 * draws)
    assert (term.factor, *term.exponents) == pytest.approx((0.8, -0.3), rel=0.05)


def test_the_docs_have_the_figures() -> None:
    text = " ".join(DOCS.read_text(encoding="utf-8").split())
    small, legless = beyond().mass, beyond().without_legs
    c, (e,) = small.terms[0].factor, small.terms[0].exponents
    assert f"{c:.2f} torque^{e:.2f}" in text
    assert f"{legless.sigma:.2f}, {legless.n} robots" in text
    for row in table(fitting.LEGLESS):
        ratio = float(row["predicted_kg"]) / float(row["mass_kg"])
        assert f"{row['robot']} {ratio:.2f}" in text
