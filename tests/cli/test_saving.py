"""What is on the disk already: a model is replaced whole or not at all, all else is kept."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from draft import files
from draft.cli import main
from tests.written import files_below

MODEL = {"robot.xml", "scene.xml", "design.yaml", "report.json"}


def test_a_model_of_draft_is_replaced() -> None:
    assert main(["build", "robot", "--out", "model"]) == 0
    before = Path("model/robot.xml").read_text()
    assert main(["build", "robot", "--out", "model", "--set", "thigh_length=0.2"]) == 0
    assert Path("model/robot.xml").read_text() != before
    assert files_below(Path("model")) == MODEL
    assert {path.name for path in Path().iterdir()} == {"robot", "model"}


def test_a_folder_that_draft_did_not_write_is_kept(capsys: pytest.CaptureFixture[str]) -> None:
    Path("thesis").mkdir()
    Path("thesis/chapter.tex").write_text("precious")
    before = files_below(Path())
    assert main(["build", "robot", "--out", "thesis"]) == 2
    assert "is not a folder of a Draft model (it holds chapter.tex)" in capsys.readouterr().err
    assert files_below(Path()) == before


def test_a_model_with_notes_beside_it_is_kept() -> None:
    assert main(["build", "robot", "--out", "model"]) == 0
    Path("model/notes.txt").write_text("precious")
    before = Path("model/robot.xml").read_text()
    assert main(["build", "robot", "--out", "model", "--set", "thigh_length=0.2"]) == 2
    assert Path("model/notes.txt").read_text() == "precious"
    assert Path("model/robot.xml").read_text() == before


def test_an_empty_folder_is_filled() -> None:
    Path("model").mkdir()
    assert main(["build", "robot", "--out", "model"]) == 0
    assert files_below(Path("model")) == MODEL


def interrupted(*_: object) -> None:
    raise KeyboardInterrupt


def failed(*_: object) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize(("fault", "code"), [(interrupted, 130), (failed, 2)])
@pytest.mark.parametrize("step", ["_flush", "_move_folder"])
def test_a_save_that_does_not_finish_leaves_the_old_model(
    step: str, fault: Any, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["build", "robot", "--out", "model"]) == 0
    before = {name: Path("model", name).read_bytes() for name in MODEL}
    monkeypatch.setattr(files, step, fault)
    assert main(["build", "robot", "--out", "model", "--set", "thigh_length=0.2"]) == code
    assert {name: Path("model", name).read_bytes() for name in MODEL} == before
    assert {path.name for path in Path().iterdir()} == {"robot", "model"}


@pytest.mark.parametrize(("fault", "code"), [(interrupted, 130), (failed, 2)])
@pytest.mark.parametrize("fails_at", [1, 2])
def test_where_folders_cannot_be_exchanged_the_old_model_is_put_back(
    fails_at: int, fault: Any, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["build", "robot", "--out", "model"]) == 0
    before = {name: Path("model", name).read_bytes() for name in MODEL}
    rename, calls = os.rename, []

    def rename_until(source: Path, target: Path) -> None:
        calls.append(source)
        if len(calls) == fails_at:
            fault()
        rename(source, target)

    monkeypatch.setattr(files, "_exchange", lambda a, b: False)
    monkeypatch.setattr(files.os, "rename", rename_until)
    assert main(["build", "robot", "--out", "model", "--set", "thigh_length=0.2"]) == code
    assert len(calls) >= fails_at
    assert {name: Path("model", name).read_bytes() for name in MODEL} == before
    assert {path.name for path in Path().iterdir()} == {"robot", "model"}


def test_where_folders_cannot_be_exchanged_a_model_is_still_replaced(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(files, "_exchange", lambda a, b: False)
    assert main(["build", "robot", "--out", "model"]) == 0
    before = Path("model/robot.xml").read_text()
    assert main(["build", "robot", "--out", "model", "--set", "thigh_length=0.2"]) == 0
    assert Path("model/robot.xml").read_text() != before
    assert {path.name for path in Path().iterdir()} == {"robot", "model"}


def test_a_first_save_that_does_not_finish_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_move_folder", failed)
    assert main(["build", "robot", "--out", "model"]) == 2
    assert {path.name for path in Path().iterdir()} == {"robot"}
