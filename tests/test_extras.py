"""Optional extras: the message about a missing library is the command that installs it here."""

from __future__ import annotations

import ast
import importlib.util
import sys
import tomllib
from collections.abc import Iterator
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest

from draft import extras
from draft.errors import DraftError

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder that Draft seems to be installed in, as in a checkout."""
    monkeypatch.setattr(extras, "__file__", str(tmp_path / "my draft" / "src" / "draft" / "x.py"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my draft").mkdir()
    return tmp_path / "my draft"


def _with_pip(monkeypatch: pytest.MonkeyPatch, found: bool) -> None:
    spec = ModuleSpec("pip", None) if found else None
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: spec)


def test_in_the_environment_of_a_checkout_uv_adds_the_extra_and_keeps_the_others(
    module: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (module / "uv.lock").touch()
    monkeypatch.setattr(sys, "prefix", str(module / ".venv"))
    assert extras.remedy("view") == f"uv sync --project '{module}' --inexact --extra view"
    monkeypatch.chdir(module)
    assert extras.remedy("view") == "uv sync --inexact --extra view"
    # Those who have left out the developers' tools do not want them with an extra.
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    assert extras.remedy("view") == "uv sync --no-dev --inexact --extra view"


@pytest.mark.parametrize(("pip", "words"), [(True, "pip"), (False, "uv pip")])
def test_elsewhere_pip_adds_it_to_the_draft_that_is_installed(
    module: Path, monkeypatch: pytest.MonkeyPatch, pip: bool, words: str
) -> None:
    _with_pip(monkeypatch, pip)
    assert extras.remedy("view") == f"{words} install 'draft-robotics[view]'"
    # The checkout is installed into another environment.
    (module / "uv.lock").touch()
    assert extras.remedy("view") == f"{words} install 'draft-robotics[view]'"


def _named() -> Iterator[str]:
    """Extras that the calls of the package name."""
    wanted = {"need": 1, "check": 1, "need_installed": 1, "missing": 1, "remedy": 0}
    for path in (ROOT / "src").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "draft.extras" in text else ():
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
                continue
            for argument in node.args[wanted.get(node.func.id, len(node.args)) :]:
                if isinstance(argument, ast.Constant):
                    yield str(argument.value)


def test_every_extra_that_a_message_names_exists() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["name"] == extras.DISTRIBUTION
    named = set(_named())
    assert {"view", "learn", "report", "survey", "figures"} <= named
    assert named <= set(project["optional-dependencies"])


def test_a_library_that_is_not_there_is_named_with_its_package(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "optuna", None)
    monkeypatch.delitem(sys.modules, "optuna.samplers", raising=False)
    with pytest.raises(DraftError, match=r"^optuna is not installed"):
        extras.need("optuna.samplers")
    with pytest.raises(DraftError, match=r"^optuna is not installed"):
        extras.check("optuna", "explore")


def test_what_windows_lacks_is_told_with_the_way_around(monkeypatch: pytest.MonkeyPatch) -> None:
    extras.need_posix("a study", "use WSL")
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(DraftError, match="a study needs Linux or macOS\n  use WSL"):
        extras.need_posix("a study", "use WSL")


def test_a_tree_that_is_not_installed_has_no_version(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "DISTRIBUTION", "draft-of-nobody")
    assert extras.own_version.__wrapped__() == "unknown"
    monkeypatch.undo()
    assert extras.own_version().count(".") == 2
