"""Fetching copies what the optional package gives, and says so when it cannot. No network here."""

from __future__ import annotations

import sys
import types
from pathlib import Path

import pytest

from draft.extras import remedy
from tests.commands import printed, refusal
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
    printed("survey", "fetch", "h1", "--out", tmp_path / "out", progress=True)
    assert (tmp_path / "out" / "h1.urdf").read_text() == written.leg()


def test_without_the_package_the_message_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    assert refusal("survey", "fetch", "h1") == (
        "the package robot_descriptions is not installed\n"
        f"  {remedy('survey')}; the shipped table needs no download\n"
    )


def test_what_cannot_be_fetched_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "did you mean 'h1'?" in refusal("survey", "fetch", "h11")
    _package(monkeypatch)
    error = refusal("survey", "fetch", "h1")
    assert error.startswith("cannot fetch 'h1': No module named")
    assert "check the network" in error
    _package(monkeypatch, XACRO_PATH="robot.xacro")
    assert "no plain URDF or MJCF file of 'h1'" in refusal("survey", "fetch", "h1")
