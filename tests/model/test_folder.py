"""A saved model is a folder that stands on its own, written whole or not at all."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import mujoco
import pytest
import yaml

import draft
from draft import files as saving
from tests.helpers import robot

FILES = {"robot.xml", "scene.xml", "design.yaml", "report.json"}


@pytest.fixture(scope="module")
def model() -> draft.Model:
    return draft.load("quadruped").resolve("cheetah").build()


def _names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_saved_folder_holds_the_four_files_and_loads_anywhere(
    model: draft.Model, tmp_path: Path
) -> None:
    folder = model.save(tmp_path / "deep" / "cheetah")
    assert _names(folder) == FILES
    moved = shutil.move(folder, tmp_path / "elsewhere")
    scene = mujoco.MjModel.from_xml_path(str(Path(moved) / "scene.xml"))
    alone = mujoco.MjModel.from_xml_path(str(Path(moved) / "robot.xml"))
    assert (scene.nu, alone.nu) == (12, 0)
    assert alone.body_subtreemass[0] == pytest.approx(model.design.mass, rel=1e-6)


def test_the_saved_text_is_the_checked_text(model: draft.Model, tmp_path: Path) -> None:
    folder = model.save(tmp_path / "cheetah")
    assert (folder / "robot.xml").read_text(encoding="utf-8") == model.xml
    assert (folder / "scene.xml").read_text(encoding="utf-8") == model.scene_xml


def test_a_saved_design_file_gives_the_same_model_again(model: draft.Model, tmp_path: Path) -> None:
    folder = model.save(tmp_path / "cheetah")
    again = draft.load("quadruped").resolve(folder / "design.yaml").build()
    assert again.xml == model.xml
    assert again.scene_xml == model.scene_xml


def test_a_design_of_stated_and_released_quantities_comes_back_from_its_file(
    tmp_path: Path,
) -> None:
    spec = draft.load("quadruped")
    values: dict[str, Any] = {
        "thigh_length": 0.31,
        "foot_radius": "0.02 + shank_radius / 4",
        "actuators.leg.gear_ratio": None,
        "actuators.leg.mass": 1.3,
    }
    model = spec.resolve(values).build()
    folder = model.save(tmp_path / "custom")
    again = spec.resolve(folder / "design.yaml")
    assert again.body_masses() == model.design.body_masses()
    assert again.build().xml == model.xml


def test_the_report_and_the_design_file_hold_the_designs_numbers(
    model: draft.Model, tmp_path: Path
) -> None:
    folder = model.save(tmp_path / "cheetah")
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    resolved = yaml.safe_load((folder / "design.yaml").read_text(encoding="utf-8"))["resolved"]
    for found in (report["mass_kg"], resolved["mass_kg"], sum(report["bodies"].values())):
        assert found == pytest.approx(model.design.mass, rel=1e-12)
    leg = model.design.actuators["leg"]
    assert report["actuators"]["leg"]["armature"]["value"] == leg.armature
    assert report["actuators"]["leg"]["mass"]["origin"] == "catalogue"
    assert resolved["actuators"]["leg"]["radius"] == leg.radius
    assert report["accepted"] is True


def test_every_derived_number_of_a_report_names_what_it_rests_on(tmp_path: Path) -> None:
    folder = draft.load("quadruped").resolve().build().save(tmp_path / "out")
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    for quantity, entry in report["actuators"]["leg"].items():
        if isinstance(entry, dict) and entry["origin"] == "trend":
            assert {"fit", "n", "held_out_error", "source", "inputs"} <= set(entry), quantity
            assert entry["held_out_error"] > 1
        elif isinstance(entry, dict) and entry["origin"] == "derived":
            assert {"from", "inputs"} <= set(entry), quantity
    for segment in report["segments"]:
        assert {"fit", "n", "in_sample_error", "source", "length_m"} <= set(segment)
    assert report["trunk"]["density_kg_m3"]["origin"] == "trend"


def test_a_second_save_replaces_the_first_and_leaves_nothing_beside_it(tmp_path: Path) -> None:
    spec = draft.load("quadruped")
    spec.resolve("bear").build().save(tmp_path / "out")
    second = spec.resolve("cheetah").build()
    second.save(tmp_path / "out")
    assert _names(tmp_path) == {"out"}
    assert (tmp_path / "out" / "robot.xml").read_text(encoding="utf-8") == second.xml


@pytest.mark.parametrize("exchange", [True, False])
def test_a_save_that_fails_halfway_leaves_the_old_model_as_it_was(
    model: draft.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exchange: bool
) -> None:
    folder = model.save(tmp_path / "out")
    before = {name: (folder / name).read_bytes() for name in FILES}
    if not exchange:
        monkeypatch.setattr(saving, "_exchange", lambda a, b: False)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    # Either while the files are written, or just as the new folder moves into place.
    for name in ("fsync", "rename"):
        with monkeypatch.context() as patched:
            if name == "rename" and exchange:
                patched.setattr(saving, "_exchange", full)
            else:
                patched.setattr(saving.os, name, full)
            with pytest.raises(draft.DraftError, match="cannot write"):
                draft.load("quadruped").resolve("bear").build().save(folder)
        assert {n: (folder / n).read_bytes() for n in FILES} == before
        assert _names(tmp_path) == {"out"}


def test_a_folder_of_someone_elses_is_kept(model: draft.Model, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").write_text("mine")
    with pytest.raises(
        draft.DraftError, match=r"is not a folder of a Draft model \(it holds thesis\.txt\)"
    ):
        model.save(tmp_path / "out")
    assert (tmp_path / "out" / "thesis.txt").read_text() == "mine"
    with pytest.raises(draft.DraftError, match="is not a folder"):
        model.save(tmp_path / "out" / "thesis.txt")


def test_an_allowed_finding_is_in_the_report_with_what_allowed_it(tmp_path: Path) -> None:
    strong = {"peak_torque": 5000, "gear_ratio": 15, "radius": 0.03, "length": 0.06, "mass": 90}
    model = robot(actuators={"leg": strong}, allow=["torque"]).resolve().build()
    report = json.loads((model.save(tmp_path / "out") / "report.json").read_text())
    allowed = {f["id"]: (f["severity"], f["allowed_by"]) for f in report["findings"]}
    assert allowed["torque"] == ("warning", "torque")
