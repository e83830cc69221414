"""Designs whose laws err: by hand, and by samples against the bands of closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import draft
from draft.design.actuators import size
from draft.design.error_samples import sample_errors
from draft.design.law_errors import LawErrors
from draft.values import scalar

QUADRUPED = draft.load("quadruped")
DESIGNS = [("quadruped", "cheetah"), ("quadruped", "bear"), ("hopper", None)]


def mass_of(kind: str, design: draft.Design) -> float:
    return sum(scalar(one.mass) * one.copies for one in design.segments if one.trend == kind)


def test_no_error_changes_nothing() -> None:
    plain, none = QUADRUPED.resolve("bear"), QUADRUPED.resolve("bear", errors=LawErrors())
    assert none.mass == plain.mass
    assert none.actuators["leg"].rotor_inertia == plain.actuators["leg"].rotor_inertia


def test_a_law_that_errs_by_a_tenth_changes_what_follows_from_it() -> None:
    plain = QUADRUPED.resolve("cheetah", {"actuators.leg.like": None})
    error = math.log(1.1)
    errors = LawErrors({"leg": {"mass": error}}, {"thigh": error}, -error)
    found = QUADRUPED.resolve("cheetah", {"actuators.leg.like": None}, errors=errors)
    assert found.actuators["leg"].mass == pytest.approx(1.1 * plain.actuators["leg"].mass)
    assert found.trunk.mass == pytest.approx(plain.trunk.mass / 1.1)
    assert mass_of("thigh", found) == pytest.approx(1.1 * mass_of("thigh", plain))
    assert mass_of("shank", found) == pytest.approx(mass_of("shank", plain))


def test_an_inverted_law_that_errs_is_the_inverse_of_the_one_that_does() -> None:
    error = math.log(1.2)
    stated = {"peak_torque": 80.0, "gear_ratio": 9.0}
    found = size("a", stated, None, errors={"gear_ratio": error})
    law = replace(found.laws.trends["gear_ratio"]).scaled(1.2)
    assert law(found.no_load_speed) == pytest.approx(9.0)


def test_stated_numbers_do_not_err() -> None:
    design = QUADRUPED.resolve("cheetah", {"actuators.leg.mass": 2.0})
    many = QUADRUPED.resolve(
        "cheetah", {"actuators.leg.mass": 2.0}, errors=sample_errors(design, 8)
    )
    assert np.all(np.asarray(many.actuators["leg"].mass) == 2.0)


@pytest.mark.parametrize(("robot", "label"), DESIGNS)
def test_masses_of_samples_are_within_the_band_of_the_total_as_often_as_it_claims(
    robot: str, label: str | None
) -> None:
    spec = draft.load(robot)
    design = spec.resolve(label) if label else spec.resolve()
    many = spec.resolve(label or {}, errors=sample_errors(design, 4000, seed=1))
    mass = np.asarray(many.mass)
    # The band is about the sum of the masses, that of samples about their median.
    low, high = design.mass_band(0.9)
    centred = mass * scalar(design.mass) / np.median(mass)
    assert np.mean((centred >= low) & (centred <= high)) == pytest.approx(0.9, abs=0.03)


def test_samples_of_one_seed_are_the_same_and_laws_of_a_module_err_together() -> None:
    design = QUADRUPED.resolve("cheetah", {"actuators.leg.like": None})
    first, again, other = (sample_errors(design, 4000, seed=seed) for seed in (0, 0, 1))
    mass, volume = (np.asarray(first.actuators["leg"][law]) for law in ("mass", "volume"))
    assert np.array_equal(mass, again.actuators["leg"]["mass"])
    assert not np.array_equal(mass, other.actuators["leg"]["mass"])
    known = design.actuators["leg"].laws.correlation["mass", "volume"]
    assert np.corrcoef(mass, volume)[0, 1] == pytest.approx(known, abs=0.05)
    assert first.count == 4000
    assert first.repeated(3).count == 12_000
