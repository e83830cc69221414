"""Slips of units and copies are found; the shipped rows have only the doubts that they name."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from draft.fitting.actuators.check import check
from draft.laws.catalogue import Part, catalogue

RPM = 2 * math.pi / 60
ALL = list(catalogue().values())
GEARED = [part for part in ALL if part.gear_ratio]
ROTORS = [part for part in GEARED if part.rotor_inertia]


def _n(part: Part) -> float:
    return part.gear_ratio or math.nan


def _rotor(part: Part) -> float:
    return part.rotor_inertia or math.nan


Slip = tuple[list[Part], Callable[[Part], dict[str, float]], str, float]
# Modules, what a slip changes of one, words that name it, least share of modules where it is found.
SLIPS: dict[str, Slip] = {
    "grams": (ALL, lambda p: {"mass": p.mass * 1e3}, "grams", 1.0),
    "rpm": (GEARED, lambda p: {"no_load_speed": p.no_load_speed / RPM}, "rpm", 1.0),
    "motor side": (
        GEARED,
        lambda p: {"no_load_speed": p.no_load_speed * _n(p)},
        "the motor's speed",
        0.95,
    ),
    "motor side in rpm": (
        GEARED,
        lambda p: {"no_load_speed": p.no_load_speed * _n(p) / RPM},
        "the motor's speed in rpm",
        1.0,
    ),
    "output side": (
        ROTORS,
        lambda p: {"rotor_inertia": _rotor(p) * _n(p) ** 2},
        "the inertia at the output",
        1.0,
    ),
    "g cm2": (ROTORS, lambda p: {"rotor_inertia": _rotor(p) * 1e7}, "g cm2", 1.0),
    "radius": (GEARED, lambda p: {"radius": p.radius / 2}, "a radius", 0.8),
    "centimetres": (GEARED, lambda p: {"length": p.length / 10}, "centimetres", 1.0),
}


def test_the_shipped_rows_are_doubted_only_where_a_source_contradicts_them() -> None:
    doubts = {doubt.name: doubt for doubt in check(ALL)}
    assert set(doubts) == {"CyberGear MS01", "AKE90-8", "AK80-64", "RS02"}
    assert {doubt.kind for doubt in doubts.values()} == {"contradicted"}
    assert "170 N m and 1.4 kg" in doubts["AKE90-8"].text


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_of_units_is_found_and_named(slip: str) -> None:
    modules, spoil, words, share = SLIPS[slip]
    found = 0
    for part in modules:
        doubts = check([replace(part, **spoil(part))])
        found += any(d.kind == "unit_slip" and words in d.remedy for d in doubts)
    assert found >= share * len(modules)


def test_a_row_that_no_slip_explains_is_implausible() -> None:
    part = replace(catalogue()["AK80-9"] if "AK80-9" in catalogue() else ALL[0], mass=4.0)
    (doubt,) = check([part])
    assert doubt.kind == "implausible"
    assert doubt.where == part.where
    assert "mass 4 kg, where such modules have about" in doubt.text


def test_a_rated_torque_above_the_peak_is_implausible() -> None:
    (doubt,) = check([replace(ALL[0], rated_torque=2 * ALL[0].peak_torque)])
    assert doubt.kind == "implausible"
    assert "above the peak" in doubt.text


def test_a_copy_under_another_name_is_found() -> None:
    first = ALL[0]
    (doubt,) = check([first, replace(first, name="copy")])
    assert (doubt.kind, doubt.name) == ("duplicate", "copy")
    assert first.name in doubt.text
