"""What a twin's report says of a large error of M(q), and of the knees' motors."""

from __future__ import annotations

from pathlib import Path

import pytest

from draft.cli import main
from draft.imports.options import Options
from draft.imports.stated import Stated
from draft.twins.compare import compare_twin
from tests.imports.biped import biped
from tests.imports.written import link, quadruped

BOX = '<collision><origin xyz="{}"/><geometry><box size="{}"/></geometry></collision>'


def written(folder: Path, text: str) -> Path:
    path = folder / "walker.urdf"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("group", ["calf", "thigh"])
def test_a_large_error_is_blamed_on_the_group_that_causes_it(group: str, tmp_path: Path) -> None:
    text = quadruped()
    for leg in ("FL", "FR", "RL", "RR"):
        text = text.replace(link(f"{leg}_{group}", 1.0), link(f"{leg}_{group}", 25.0))
    found = compare_twin(written(tmp_path, text), poses=20)
    assert found.inertia.median > 40
    worst = found.causes[0]
    assert worst.group == {"calf": "shank", "thigh": "thigh"}[group]
    assert set(worst.links) == {f"{leg}_{group}" for leg in ("FL", "FR", "RL", "RR")}


def test_the_causes_of_a_robot_hung_on_its_torso_are_its_own_bodies(tmp_path: Path) -> None:
    heavy = biped().replace(link("left_elbow_link"), link("left_elbow_link", 40.0))
    found = compare_twin(written(tmp_path, heavy), poses=20)
    assert "left_elbow_link" in found.causes[0].links


def knee_boxes(size: str) -> str:
    text = quadruped()
    for leg in ("FL", "FR", "RL", "RR"):
        plain = link(f"{leg}_thigh")
        box = BOX.format("0 0 -0.22", size)
        text = text.replace(plain, plain.replace("</link>", f"{box}</link>"))
    return text


def test_a_knee_wide_enough_for_a_motor_has_one(tmp_path: Path) -> None:
    path = written(tmp_path, knee_boxes("0.12 0.08 0.12"))
    found = compare_twin(path, poses=20)
    assert found.files.knees.place == "knee"
    assert found.other_knees is not None
    assert found.other_knees.place == "hip"
    assert found.other_knees.change > 10


def test_a_slim_knee_is_driven_from_the_hip(tmp_path: Path) -> None:
    found = compare_twin(written(tmp_path, knee_boxes("0.03 0.03 0.03")), poses=20)
    assert found.files.knees.place == "hip"


def test_a_knee_beside_its_hip_is_no_sign_of_a_motor_there(tmp_path: Path) -> None:
    """Seventy millimetres beside, without shapes: most surveyed robots drive it from the hip."""
    text = quadruped().replace('xyz="0 0 -0.22"', 'xyz="0 0.07 -0.22"')
    found = compare_twin(written(tmp_path, text), poses=20)
    assert found.files.knees.place == "hip"
    assert "70 mm beside its hip" in found.files.knees.why


def test_the_knees_motors_may_be_stated(tmp_path: Path) -> None:
    path = written(tmp_path, quadruped())
    for place in ("hip", "knee"):
        found = compare_twin(path, options=Options(knee_drive=place, torque=Stated()), poses=20)
        assert found.files.knees.place == place
        assert found.other_knees is not None
        assert found.other_knees.place != place


def test_the_report_shows_both_places(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, quadruped())
    assert main(["twin", str(path), "--poses", "20"]) == 0
    out = capsys.readouterr().out
    assert "knees driven at the hip" in out
    assert "--knee-drive knee, M(q) moves by" in out


def test_the_report_names_the_group_behind_a_large_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = quadruped()
    for leg in ("FL", "FR", "RL", "RR"):
        text = text.replace(link(f"{leg}_calf", 1.0), link(f"{leg}_calf", 25.0))
    assert main(["twin", str(written(tmp_path, text)), "--poses", "20"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "M(q) is off by more than 40 %, mostly by the group 'shank' (FL_calf" in out
