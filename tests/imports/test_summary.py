"""The end of an import: what a person is told, and the band of the expected mass."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import draft
from draft.design.widened import mass_with_band
from draft.imports.expected import ExpectedMass, expected_mass, overload
from draft.imports.importer import import_robot
from draft.imports.options import Options
from draft.imports.stated import Stated
from draft.laws.beyond import beyond
from tests.commands import line, printed
from tests.imports.biped import TORQUES, biped
from tests.imports.written import imported, joint, link, quadruped, written
from tests.twins.test_vendors import ROBOTS

NONE = dict.fromkeys(TORQUES, None)
# An arm of three hinges that reaches up.
ARM = "\n".join(
    [
        '<robot name="arm">',
        *(link(name) for name in ("base", "shoulder", "upper", "fore")),
        joint("pan", "base", "shoulder", (0, 0, 0.1), "0 0 1"),
        joint("lift", "shoulder", "upper", (0, 0, 0.1)),
        joint("elbow", "upper", "fore", (0, 0, 0.4)),
        "</robot>",
    ]
)


def said(text: str, *options: str) -> str:
    written(text)
    return line(printed("import", "beast.urdf", "--out", "mine", *options))


def expected(text: str, name: str = "mine", population: str | None = None) -> ExpectedMass:
    found = import_robot(written(text), name, population=population)
    return expected_mass(found.spec.resolve(), found.files)


def width(mass: ExpectedMass) -> float:
    return mass.high / mass.low


SUMMARY = {
    "a sound file": (
        biped(),
        (),
        "population: humanoid: two limbs reach the ground",
        "joints: 16 driven hinges",
        "left and right: equal",
        "torques: 16 declared",
        "trunk: from the box with its inertia",
        "expected mass: ",
    ),
    "guesses": (
        biped({"ankle": 1000.0, "elbow": None}, right_thigh=0.2529),
        (),
        "torques: 12 declared, 2 replaced (implausible), 2 assumed (none in the file)",
        "1 dimensions differ by millimetres",
        "wider than the trends' own: 4 of 16 torques are not the maker's",
    ),
    "knees as stated": (
        quadruped(),
        ("--knee-drive", "knee"),
        "knees: driven at the knee: as stated by --knee-drive",
    ),
}


@pytest.mark.parametrize("name", SUMMARY)
def test_the_summary_says_what_was_read_and_what_was_guessed(name: str) -> None:
    text, options, *words = SUMMARY[name]
    out = said(text, *options)
    assert [one for one in words if one not in out] == []
    assert ("wider than" in out) == (name == "guesses")


def test_the_band_is_wider_where_torques_are_assumed() -> None:
    declared, assumed = expected(biped(), "a"), expected(biped(NONE), "b")
    assert width(assumed) > 1.05 * width(declared)
    assert declared.wider == ()
    assert (declared.low, declared.high) == tuple(draft.load("a").resolve().mass_band())
    assert assumed.wider == ("16 of 16 torques are not the maker's",)


def test_one_guessed_torque_makes_the_whole_robot_less_certain() -> None:
    """Files with unusable torques describe robots unlike the surveyed ones (docs/twins.md)."""
    one = expected(biped({"ankle": 1000.0}), "one")
    low, high = draft.load("one").resolve().mass_band()
    for wide, own in ((one.high, float(high)), (one.low, float(low))):
        grown = math.log(wide / one.mass) ** 2 - math.log(own / one.mass) ** 2
        assert grown > (1.645 * 0.16) ** 2 - 1e-9


def test_the_band_is_wider_by_the_trends_of_another_population() -> None:
    own, other = expected(quadruped(), "a"), expected(quadruped(), "b", "humanoid")
    assert width(other) > 1.5 * width(own)
    assert other.wider == ("surveyed humanoids have 2 legs, not 4",)


def test_stated_torques_do_not_widen_the_band() -> None:
    found = imported(biped(NONE), options=Options(torque=Stated(named=TORQUES)))
    assert expected_mass(found.spec.resolve(), found.files).wider == ()


def test_the_band_of_an_import_follows_its_parameters() -> None:
    expected(biped(NONE))
    longer = draft.load("mine").resolve({"thigh_length": 0.3})
    own = mass_with_band(longer)
    assert own.mass == pytest.approx(float(longer.mass))
    low, high = longer.mass_band()
    assert own.low < float(low) < float(high) < own.high


@pytest.mark.parametrize("text", ["", "[]", '{"wider_band": 3}', "{", '{"wider_band": {}}'])
def test_a_damaged_report_widens_nothing(text: str) -> None:
    expected(biped(NONE))
    Path("mine/import.json").write_text(text, encoding="utf-8")
    design = draft.load("mine").resolve()
    found = mass_with_band(design)
    low, high = design.mass_band()
    assert (found.low, found.high) == pytest.approx((float(low), float(high)))


def test_a_spec_of_ones_own_has_the_band_of_the_trends() -> None:
    design = draft.load("quadruped").resolve()
    own = mass_with_band(design)
    assert ((own.low, own.high), own.wider) == (tuple(design.mass_band()), ())


def test_the_band_of_the_import_is_in_its_report_in_draft_show_and_in_that_of_its_twin() -> None:
    mass = expected(biped({"ankle": 1000.0}))
    why = "2 of 16 torques are not the maker's"
    table = json.loads(Path("mine/import.json").read_text("utf-8"))
    assert table["expected_mass_kg"]["band_90"] == pytest.approx([mass.low, mass.high])
    assert table["expected_mass_kg"]["wider_because"] == [why]
    assert table["wider_band"]["guessed_actuators"] == ["ankle_drive"]
    out = line(printed("show", "mine"))
    assert f"{mass.low:.1f} .. {mass.high:.1f}" in out
    assert f"wider: {why}" in out
    out = line(printed("twin", "beast.urdf", "--poses", "2"))
    assert f"mass: {mass.low:.1f} to {mass.high:.1f} kg" in out
    assert why in out


def test_the_json_has_the_summary() -> None:
    summary = json.loads(said(biped(), "--json"))["summary"]
    assert summary["torques"] == {"declared": 16}
    low, high = summary["expected_mass_kg"]["band_90"]
    assert low < summary["expected_mass_kg"]["mass"] < high


def test_a_robot_that_cannot_stand_weighs_at_most_what_its_torques_hold() -> None:
    found = imported(biped(), options=Options(torque=Stated(named={"knee": 4.5})))
    design = found.spec.resolve()
    low, high = design.mass_band()
    mass = expected_mass(design, found.files)
    times = overload(design)
    assert times > 2
    assert (mass.low, mass.high) == pytest.approx((float(low) / times, float(high)))
    assert mass.wider == (f"standing takes {times:.2g} times its peak torques at that mass",)
    # The maker's robot stands, whatever torques a design is given later.
    stronger = found.spec.resolve({"actuators.knee_drive.peak_torque": 70})
    assert mass_with_band(stronger).wider == mass.wider
    assert json.loads(Path("mine/import.json").read_text())["wider_band"]["overload"] == times


def test_the_band_of_a_robot_without_legs_is_that_of_such_robots() -> None:
    record = beyond().without_legs
    mass = expected(ARM, "limb")
    low, _ = draft.load("limb").resolve().mass_band()
    grown = math.log(mass.low / mass.mass) ** 2 - math.log(float(low) / mass.mass) ** 2
    assert math.sqrt(grown) == pytest.approx(1.6449 * record.sigma, rel=1e-3)
    assert mass.wider == ("few arms and hands are known by their links",)


@pytest.mark.skipif(not ROBOTS.is_dir(), reason="the robots are not beside this folder")
def test_the_band_of_a_robot_of_servos_holds_its_mass() -> None:
    """ToddlerBot: 3.36 kg, predicted 13.1 from 1 N m a joint; its band ended at 9.2 kg."""
    found = import_robot(ROBOTS / "survey" / "toddlerbot.urdf", "toddlerbot")
    mass = mass_with_band(found.spec.resolve())
    assert mass.low < 3.36 < mass.high < 25
    assert mass.wider == (
        "100 % of its actuators, by mass, are below 4.1 N m, where servos are lighter than the "
        "trends say",
    )
