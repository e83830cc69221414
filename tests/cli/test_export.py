"""`draft export`: which files, of which design, and what is kept."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from draft.cli import main
from tests.written import files_below

ALWAYS = {"design.yaml", "report.json"}
URDF = {"robot.urdf", "meshes", "meshes/trunk.stl", "actuators.json"}
MJCF = {"robot.xml", "scene.xml"}


@pytest.mark.parametrize(
    ("chosen", "files"),
    [
        ([], URDF | MJCF | {"robot.glb"}),
        (["--format", "urdf"], URDF),
        (["--format", "glb", "mjcf"], MJCF | {"robot.glb"}),
    ],
)
def test_the_formats_asked_for_are_written(
    chosen: list[str], files: set[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "robot", "--out", "model", *chosen]) == 0
    assert files_below(Path("model")) == ALWAYS | files
    assert "model/report.json" in capsys.readouterr().out


def test_a_named_design_goes_to_a_folder_of_its_name() -> None:
    assert main(["export", "robot", "--design", "long", "--format", "glb"]) == 0
    assert files_below(Path("out/monoped-long")) == ALWAYS | {"robot.glb"}


def test_json_names_the_folder(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "robot", "--out", "model", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["out"] == "model"


def test_a_build_replaces_an_export_and_an_export_a_build() -> None:
    for command, files in (("build", MJCF), ("export", MJCF | URDF | {"robot.glb"})) * 2:
        assert main([command, "robot", "--out", "model"]) == 0
        assert files_below(Path("model")) == ALWAYS | files
    assert {path.name for path in Path().iterdir()} == {"robot", "model"}


def test_a_refused_design_writes_nothing() -> None:
    values = ["--set", "actuators.leg.peak_torque=90000"]
    assert main(["export", "robot", "--out", "model", *values]) == 1
    assert not Path("model").exists()


def test_a_format_that_does_not_exist_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["export", "robot", "--format", "step"])
    assert ended.value.code == 2
    assert "step" in capsys.readouterr().err
