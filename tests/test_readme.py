"""The commands of the README run as written, in order, in one folder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from docs import blocks
from tests.environments import warm

README = Path(__file__).resolve().parents[1] / "README.md"
# Commands that open a window, learn for minutes or render videos: only arguments are checked.
ARGUMENTS_ONLY = {"studio", "view", "play", "train", "evaluate", "study", "learn", "surface"}
# Installing, and this suite itself, which continuous integration runs as the README says.
OTHERS = ("pip install uv", "uv sync", "uv run --all-extras pytest")


def _commands() -> list[list[str]]:
    """Return the commands of the README's `sh` blocks in order, split at `&&`."""
    found = []
    for block in blocks.blocks(README):
        if block.language != "sh":
            continue
        for words in blocks.commands(block):
            text = "\0".join(words)
            found += [part.strip("\0").split("\0") for part in text.split("&&")]
    return [words for words in found if not " ".join(words).startswith(OTHERS)]


def _of_draft(words: list[str]) -> list[str]:
    return words[words.index("draft") + 1 :] if "draft" in words else []


def test_the_arguments_of_every_command_are_right() -> None:
    commands = [words for words in _commands() if _of_draft(words)]
    assert len(commands) > 12
    for words in commands:
        blocks.check_arguments(_of_draft(words))


@pytest.mark.slow
def test_the_commands_run_in_order_with_the_extras_that_each_names(
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "folder").mkdir()
    blocks.copy_examples(tmp_path / "folder")
    monkeypatch.chdir(tmp_path / "folder")
    for words in _commands():
        command = _of_draft(words)
        if command and command[0] in ARGUMENTS_ONLY:
            continue
        blocks.run(words, python=warm(tmp_path_factory, blocks.extras(words)))


def test_the_python_code_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = [block for block in blocks.blocks(README) if block.language == "python"]
    assert found
    for block in found:
        assert blocks.run_python(block).strip()


def test_the_top_speeds_are_those_of_the_table_of_physics() -> None:
    file = README.parent / "examples/results/physics.json"
    rows = json.loads(file.read_text(encoding="utf-8"))
    speeds = {row["robot"]: row["top_speed"] for row in rows if row["setting"] == "as trained"}
    words = ", ".join(f"{speeds[name]:.1f}" for name in ("cheetah", "bear", "giraffe"))
    assert f"| top speed of cheetah, bear, giraffe | {words} m/s;" in README.read_text("utf-8")
