"""The help of every command and subcommand, and how a command is added."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import draft.cli
from draft.cli import COMMANDS, functions, main
from draft.cli.completion import entries

PATHS = [
    (command, *more)
    for command in COMMANDS
    for more in [(), *((name,) for name in functions(command)[1])]
]
OPTIONS = {entry.command: entry.options for entry in entries()}


def help_of(*path: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Help of a command or subcommand, on one line."""
    if len(path) == 1 and functions(path[0])[0] is None:
        assert main([*path, "--help"]) == 0
    else:
        with pytest.raises(SystemExit) as ended:
            main([*path, "--help"])
        assert ended.value.code == 0
    return " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("path", PATHS, ids=" ".join)
def test_help_shows_real_defaults(
    path: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    told = help_of(*path, capsys=capsys)
    assert told.startswith(f"usage: draft {' '.join(path)} ")
    assert "None" not in told
    assert not re.search(r"\(default: *\)|\{\}|=>|STR\b|INT\b|FLOAT\b|PATH\b", told)
    # Every option says whether it must be given, or what it is otherwise.
    options = OPTIONS[" ".join(path)]
    stated = re.findall(r"\((?:default: [^)]+|required[^)]*)\)", told)
    assert len(stated) >= len(options)


def test_a_command_without_its_subcommand_names_them(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("learn", "trends", "survey"):
        names = ", ".join(sorted(functions(command)[1]))
        assert main([command]) == 2
        err = capsys.readouterr().err
        assert err == (f"error: 'draft {command}' needs a subcommand\n  subcommands: {names}\n")
    assert main(["survey", "tabel"]) == 2
    err = capsys.readouterr().err
    assert "'draft survey' has no subcommand 'tabel'\n  did you mean 'table'?" in err


COMMAND = '''
"""`draft weigh`: print the mass of a robot."""

from typing import Annotated

import tyro

from draft.cli.options import DesignArgument, DesignName, Values, open_design


def main(
    reference: DesignArgument,
    /,
    design: DesignName = None,
    values: Values = (),
    grams: Annotated[bool, tyro.conf.arg(help="Print grams.")] = False,
) -> int:
    """Print the mass of a robot."""
    resolved, _ = open_design(reference, design, values)
    print(f"{float(resolved.mass) * (1e3 if grams else 1):.1f}")
    return 0
'''


def test_a_command_is_added_by_one_file_and_its_line_in_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "weigh.py").write_text(COMMAND)
    monkeypatch.setattr(draft.cli, "__path__", [*draft.cli.__path__, str(tmp_path)])
    monkeypatch.setitem(COMMANDS, "weigh", "Print the mass of a robot.")
    mass = float(draft.load("quadruped").resolve("bear").mass)
    assert main(["weigh", "bear"]) == 0
    assert capsys.readouterr().out == f"{mass:.1f}\n"
    assert main(["weigh", "quadruped", "--design", "bear", "--grams"]) == 0
    assert capsys.readouterr().out == f"{mass * 1e3:.1f}\n"
    assert main(["weigh", "baer"]) == 2
    assert "did you mean 'bear'?" in capsys.readouterr().err
    assert main(["--help"]) == 0
    assert re.search(r"weigh +Print the mass of a robot\.", capsys.readouterr().out)
    assert "--grams Print grams. (default: False)" in help_of("weigh", capsys=capsys)
    completion = {entry.command: entry for entry in entries()}["weigh"]
    assert completion.options == ("--design", "--set", "--grams")
    assert "bear" in completion.values[""].words
