"""The end of an import: what a person is told, and the band of the expected mass."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import draft
from draft.cli import main
from draft.design.widened import imported_mass
from draft.imports.expected import ExpectedMass, expected_mass
from draft.imports.importer import import_robot
from draft.imports.options import Options
from draft.imports.stated import Stated
from tests.imports.biped import TORQUES, biped
from tests.imports.written import quadruped


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def said(text: str, capsys: pytest.CaptureFixture[str], *options: str) -> str:
    Path("walker.urdf").write_text(text, encoding="utf-8")
    assert main(["import", "walker.urdf", "--out", "mine", *options]) == 0
    return " ".join(capsys.readouterr().out.split())


def expected(text: str, name: str, population: str | None = None) -> ExpectedMass:
    Path("walker.urdf").write_text(text, encoding="utf-8")
    found = import_robot("walker.urdf", name, population=population)
    return expected_mass(found.spec.resolve(), found.files)


def width(mass: ExpectedMass) -> float:
    return mass.high / mass.low


def test_the_summary_of_a_sound_file(capsys: pytest.CaptureFixture[str]) -> None:
    out = said(biped(), capsys)
    assert "population: humanoid: two limbs reach the ground" in out
    assert "joints: 16 driven hinges" in out
    assert "left and right: equal" in out
    assert "torques: 16 declared" in out
    assert "trunk: from the box with its inertia" in out
    assert "expected mass: " in out
    assert "wider than" not in out


def test_the_summary_says_what_was_guessed(capsys: pytest.CaptureFixture[str]) -> None:
    out = said(biped({"ankle": 1000.0, "elbow": None}, right_thigh=0.2529), capsys)
    assert "torques: 12 declared, 2 replaced (implausible), 2 assumed (none in the file)" in out
    assert "1 dimensions differ by millimetres" in out
    assert "4 of 16 torques are not the maker's" in out


def test_the_summary_tells_where_knees_are_driven(capsys: pytest.CaptureFixture[str]) -> None:
    assert "knees: driven at the knee: as stated by --knee-drive" in said(
        quadruped(), capsys, "--knee-drive", "knee"
    )


def test_the_band_is_wider_where_torques_are_assumed() -> None:
    declared = expected(biped(), "a")
    assumed = expected(biped(dict.fromkeys(TORQUES, None)), "b")
    assert width(assumed) > 1.05 * width(declared)
    assert declared.wider == ()
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
    text = biped(dict.fromkeys(TORQUES, None))
    Path("walker.urdf").write_text(text, encoding="utf-8")
    options = Options(torque=Stated(named=TORQUES))
    found = import_robot("walker.urdf", "a", options=options)
    assert expected_mass(found.spec.resolve(), found.files).wider == ()


def test_draft_show_has_the_band_of_the_import(capsys: pytest.CaptureFixture[str]) -> None:
    text = biped(dict.fromkeys(TORQUES, None))
    mass = expected(text, "mine")
    assert main(["show", "mine"]) == 0
    out = capsys.readouterr().out
    assert f"{mass.low:.1f} .. {mass.high:.1f}" in out
    assert "wider: 16 of 16 torques are not the maker's" in " ".join(out.split())


def test_the_band_of_an_import_follows_its_parameters() -> None:
    expected(biped(dict.fromkeys(TORQUES, None)), "mine")
    longer = draft.load("mine").resolve({"thigh_length": 0.3})
    own = imported_mass(longer)
    assert own is not None
    assert own.mass == pytest.approx(float(longer.mass))
    low, high = longer.mass_band()
    assert own.low < float(low) < float(high) < own.high


@pytest.mark.parametrize("text", ["", "[]", '{"wider_band": 3}', "{", '{"wider_band": {}}'])
def test_a_damaged_report_widens_nothing(text: str) -> None:
    expected(biped(dict.fromkeys(TORQUES, None)), "mine")
    Path("mine/import.json").write_text(text, encoding="utf-8")
    design = draft.load("mine").resolve()
    found = imported_mass(design)
    low, high = design.mass_band()
    assert found is None or (found.low, found.high) == pytest.approx((float(low), float(high)))


def test_a_spec_of_ones_own_has_the_band_of_the_trends() -> None:
    assert imported_mass(draft.load("quadruped").resolve()) is None


def test_the_report_of_the_import_has_the_band() -> None:
    mass = expected(biped({"ankle": 1000.0}), "mine")
    table = json.loads(Path("mine/import.json").read_text("utf-8"))
    assert table["expected_mass_kg"]["band_90"] == pytest.approx([mass.low, mass.high])
    assert table["expected_mass_kg"]["wider_because"] == ["2 of 16 torques are not the maker's"]
    assert table["wider_band"]["guessed_actuators"] == ["ankle_drive"]


def test_a_twins_report_has_the_band_of_the_import(capsys: pytest.CaptureFixture[str]) -> None:
    mass = expected(biped({"ankle": 1000.0}), "mine")
    assert main(["twin", "walker.urdf", "--poses", "2"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert f"mass: {mass.low:.1f} to {mass.high:.1f} kg" in out
    assert "2 of 16 torques are not the maker's" in out


def test_the_json_has_the_summary(capsys: pytest.CaptureFixture[str]) -> None:
    Path("walker.urdf").write_text(biped(), encoding="utf-8")
    assert main(["import", "walker.urdf", "--out", "mine", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)["summary"]
    assert summary["torques"] == {"declared": 16}
    low, high = summary["expected_mass_kg"]["band_90"]
    assert low < summary["expected_mass_kg"]["mass"] < high
