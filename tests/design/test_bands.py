"""A design's numbers carry bands, and these hold as many real modules as they say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design.actuators import size
from draft.design.bands import (
    Spread,
    actuator_bands,
    half_widths,
    mass_band,
    mass_spreads,
    sensitivities,
    sum_band,
)
from draft.design.report import report
from draft.fitting.structure import fits
from draft.fitting.structure import survey_holdout as holdout
from draft.fitting.structure.attribution import Machine, machines
from draft.laws.actuators import SETS, laws
from draft.laws.catalogue import catalogue
from draft.laws.law import quantile, sigma_of_fold
from draft.laws.survey import FILE as SEGMENTS
from draft.laws.survey import read

GEARED = [part for part in catalogue().values() if part.gear_ratio is not None]
QUADRUPED = draft.load("quadruped")
# Without the catalogue part that the default starts from: all by the trends.
UNANCHORED = {"actuators.leg.like": None}
DESIGNS = [None, "cheetah", "bear", "giraffe"]


def _inside(quantity: str, name: str, share: float) -> float:
    """Share of the catalogue's modules inside the bands of what is sized from their ratings."""
    inside = []
    for part in GEARED:
        ratio = part.gear_ratio or math.nan
        published = getattr(part, "rotor_inertia" if quantity == "armature" else quantity)
        if published is None or part.small_geared_inrunner:
            continue
        published *= ratio**2 if quantity == "armature" else 1.0
        stated = {"peak_torque": part.peak_torque, "no_load_speed": part.no_load_speed}
        sized = size("leg", {**stated, "gear_ratio": ratio}, None, laws=laws(name))
        low, high = actuator_bands(sized, share)[quantity]
        inside.append(low <= published <= high)
    return float(np.mean(inside))


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("quantity", ["mass", "radius", "length", "armature"])
def test_the_90_percent_band_of_a_sized_actuator_holds_about_nine_modules_in_ten(
    quantity: str, name: str
) -> None:
    # The laws have seen these modules, the bands are for others: they may hold some more.
    assert 0.85 <= _inside(quantity, name, 0.9) <= 0.97
    assert 0.40 <= _inside(quantity, name, 0.5) <= 0.67


def test_the_band_of_a_mass_is_that_of_its_law() -> None:
    a = size("leg", {"peak_torque": 50.0, "gear_ratio": 9.0}, None)
    low, high = actuator_bands(a, 0.9)["mass"]
    fold = laws().trends["mass"].band(0.9)
    assert (low, high) == (pytest.approx(a.mass / fold), pytest.approx(a.mass * fold))


def test_a_module_of_ones_own_has_the_bands_of_a_shipped_one() -> None:
    part = catalogue()["MIT U12"]
    stated = {"gear_ratio": 9.0}
    own, shipped = (size("leg", stated, one) for one in (replace(part, name="S-40"), part))
    assert own.like == "S-40"
    assert actuator_bands(own) == actuator_bands(shipped)


def test_what_is_stated_or_measured_has_no_band() -> None:
    stated = {"peak_torque": 50.0, "gear_ratio": 9.0, "mass": 1.0, "radius": 0.05, "length": 0.05}
    assert set(actuator_bands(size("leg", stated, None))) == {
        "rated_torque",
        "no_load_speed",
        "peak_power",
        "rotor_inertia",
        "armature",
    }
    assert actuator_bands(size("leg", {}, catalogue()["RMD-X15-P20-450-E"])) == {}


def test_a_reduction_from_the_trend_widens_the_band_of_the_armature() -> None:
    known = {"peak_torque": 50.0, "no_load_speed": 30.0}
    guessed = size("leg", known, None)
    stated = size("leg", {**known, "gear_ratio": guessed.gear_ratio}, None)
    assert half_widths(guessed)["armature"] > half_widths(stated)["armature"]


@given(st.floats(0.001, 3.0))
def test_a_deviation_from_a_part_errs_in_full_only_beyond_a_tenth(deviation: float) -> None:
    part = catalogue()["MIT U12"]
    a = size("leg", {"peak_torque": part.peak_torque * math.exp(deviation)}, part)
    charged = abs(math.log(a.mass / part.mass))
    full = math.log(laws().trends["mass"].band(0.9))
    assert half_widths(a)["mass"] == pytest.approx(full * min(1.0, charged / 0.1), rel=1e-6)


def test_sensitivities_are_those_of_the_laws() -> None:
    slopes = sensitivities(size("leg", {"peak_torque": 50.0, "gear_ratio": 9.0}, None))
    assert slopes["volume"]["radius"] == pytest.approx(1 / 3)
    assert slopes["aspect_ratio"]["length"] == pytest.approx(2 / 3)
    assert slopes["rotor_inertia"]["armature"] == pytest.approx(1.0)
    assert slopes["mass"] == {
        "mass": pytest.approx(1.0),
        "rotor_inertia": pytest.approx(1.0),
        "armature": pytest.approx(1.0),
    }


@pytest.mark.parametrize("share", [0.5, 0.9])
@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("structure", ["paper", "calibrated"])
def test_the_band_of_the_total_mass_agrees_with_a_large_monte_carlo(
    structure: str, name: str | None, share: float
) -> None:
    design = replace(QUADRUPED, structure=structure).resolve(name)
    known, spreads = mass_spreads(design)
    draws = np.random.default_rng(0).standard_normal((len(spreads), 100_000))
    total = known + sum(s.mass * np.exp(s.sigma * z) for s, z in zip(spreads, draws, strict=True))
    low, high = (
        design.mass * np.quantile(total, q) / np.median(total)
        for q in ((1 - share) / 2, (1 + share) / 2)
    )
    assert mass_band(design, share) == pytest.approx((low, high), rel=0.02)


@pytest.mark.parametrize("population", ["humanoid", "quadruped"])
def test_the_90_percent_band_of_total_mass_holds_about_nine_in_ten_robots_held_out(
    population: str,
) -> None:
    robots = [r for r in machines(read(SEGMENTS)) if r.population == population]
    inside = []
    for robot in robots:
        others = [r for r in robots if r is not robot]
        low, high = sum_band(0.0, _spreads(robot, others), 0.9)
        inside.append(low <= robot.mass <= high)
    assert 0.85 <= np.mean(inside) <= 0.95


def _spreads(robot: Machine, others: list[Machine]) -> list[Spread]:
    """What others say of a robot's segments, and its actuators, in three classes."""
    model = fits.structure(others)
    said = holdout.structure_of(robot, model)
    masses: dict[str, float] = {}
    for piece in robot.pieces:
        masses[piece.kind] = masses.get(piece.kind, 0.0) + said.get(piece.row.segment, 0.0)
    folds = {kind: law.fold for kind, law in model.fits.items()}
    for kind in fits.TRUNKS:
        rows = fits.usable_rows(others).get(kind, ())
        density = np.array([piece.structure / piece.row.box_volume for piece in rows])
        if not len(density):
            continue
        folds[kind] = math.exp(np.mean(np.abs(np.log(density / np.median(density)))))
    sigma = math.log(laws("paper").trends["mass"].band(0.9)) / quantile(0.9)
    return [
        *(Spread(m, sigma_of_fold(folds.get(k) or 2.0)) for k, m in masses.items() if m > 0),
        *[Spread(robot.actuators / 3, sigma)] * 3,
    ]


def test_joints_of_one_actuator_class_err_together() -> None:
    design = QUADRUPED.resolve(UNANCHORED)
    (actuators,) = [
        s for s in mass_spreads(design)[1] if s.mass == pytest.approx(design.actuator_mass)
    ]
    fold = laws().trends["mass"].band(0.9)
    # One unit in all twelve joints: their sum errs as one of them does, not by 1 / sqrt(12) of it.
    assert math.exp(1.6448536 * actuators.sigma) == pytest.approx(fold)


def test_measured_actuators_are_known_and_only_the_structure_errs() -> None:
    design = QUADRUPED.resolve("cheetah")
    known, spreads = mass_spreads(design)
    assert known == pytest.approx(design.actuator_mass)
    assert known + sum(s.mass for s in spreads) == pytest.approx(design.mass)


def test_a_report_carries_the_bands() -> None:
    design = QUADRUPED.resolve(UNANCHORED)
    made = report(design)
    assert made["mass_band_kg"]["90"] == list(design.mass_band(0.9))
    assert made["mass_band_kg"]["90"][0] < made["mass_band_kg"]["50"][0] < design.mass
    leg = made["actuators"]["leg"]
    assert leg["trends"] == "draft"
    for quantity in ("mass", "radius", "armature"):
        for share, (low, high) in leg[quantity]["band"].items():
            assert low < leg[quantity]["value"] < high, (quantity, share)
    assert "band" not in leg["peak_torque"]


@pytest.mark.parametrize(("name", "printed"), [("cheetah", 33), ("bear", 110), ("giraffe", 91)])
@pytest.mark.parametrize("which", SETS)
def test_the_published_designs_keep_their_masses_by_both_sets(
    name: str, printed: float, which: str
) -> None:
    design = replace(QUADRUPED, trends=which).resolve(name)
    assert design.actuators["leg"].laws.name == which
    assert design.mass == pytest.approx(printed, rel=0.06)
    low, high = design.mass_band()
    assert low < printed < high


def test_a_band_is_wider_below_the_torques_of_the_law_and_the_same_from_there_on() -> None:
    fold = laws().trends["mass"].band(0.9)
    for torque in (4.1, 4.2, 50.0):
        a = size("leg", {"peak_torque": torque, "no_load_speed": 10.0}, None)
        assert actuator_bands(a)["mass"] == pytest.approx((a.mass / fold, a.mass * fold))
    previous = math.inf
    for torque in (0.1, 1.0, 4.0):
        a = size("leg", {"peak_torque": torque, "no_load_speed": 10.0}, None)
        low, high = actuator_bands(a)["mass"]
        # Servos are lighter than the law says, hardly ever heavier.
        assert high == pytest.approx(a.mass * fold)
        assert fold**2 < a.mass / low < previous
        previous = float(a.mass / low)
        radius = actuator_bands(a)["radius"]
        assert radius.high / radius.low > 1.3


def test_the_band_of_a_robot_of_small_actuators_is_wider_downwards() -> None:
    weak = {"actuators.leg.peak_torque": 3.0, "actuators.leg.like": None}
    design = QUADRUPED.resolve(weak)
    own = sum_band(*mass_spreads(design), 0.9)
    low, high = design.mass_band()
    sigma = 1.2707 * 3.0**-0.2118
    wide = math.log(design.mass / own.low) ** 2 + (quantile(0.9) * sigma) ** 2
    assert low == pytest.approx(design.mass * math.exp(-math.sqrt(wide)), rel=1e-3)
    assert high == own.high
    (finding,) = [f for f in design.findings if "peak_torque" in f.message]
    assert "servos are lighter than these trends say" in finding.message


def test_a_stated_mass_of_a_small_actuator_widens_nothing() -> None:
    weak = {"actuators.leg.peak_torque": 3.0, "actuators.leg.like": None}
    design = QUADRUPED.resolve(weak | {"actuators.leg.mass": 0.08})
    assert design.mass_band() == sum_band(*mass_spreads(design), 0.9)
