"""Fetching copies what the optional package gives, and says so when it cannot. No network here."""

from __future__ import annotations

import sys
import types
from pathlib import Path

import pytest

from draft.cli import main
from draft.extras import remedy
from tests.description import written


def _package(monkeypatch: pytest.MonkeyPatch, **module: str) -> None:
    package = types.ModuleType("robot_descriptions")
    package.__path__ = []
    monkeypatch.setitem(sys.modules, "robot_descriptions", package)
    if module:
        one = types.ModuleType("robot_descriptions.h1_description")
        one.__dict__.update(module)
        monkeypatch.setitem(sys.modules, one.__name__, one)


def test_a_description_is_copied_under_its_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "robot.urdf"
    source.write_text(written.leg())
    _package(monkeypatch, URDF_PATH=str(source))
    assert main(["survey", "fetch", "h1", "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "h1.urdf").read_text() == written.leg()


def test_without_the_package_the_message_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    assert main(["survey", "fetch", "h1", "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == (
        "error: the package robot_descriptions is not installed\n"
        f"  {remedy('survey')}; the shipped table needs no download\n"
    )


def test_what_goes_wrong_inside_the_package_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _package(monkeypatch)
    assert main(["survey", "fetch", "h1", "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: cannot fetch 'h1': No module named")
    assert "check the network" in error


def test_a_robot_without_a_plain_file_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _package(monkeypatch, XACRO_PATH="robot.xacro")
    assert main(["survey", "fetch", "h1", "--out", str(tmp_path / "out")]) == 2
    assert "no plain URDF or MJCF file of 'h1'" in capsys.readouterr().err
