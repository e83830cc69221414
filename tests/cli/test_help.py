"""The help of every command and subcommand, and how a command is added."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import pytest

import draft.cli
from draft.cli import COMMANDS, functions
from draft.cli.completion import entries
from draft.errors import counted
from tests.commands import Command

PATHS = [
    (command, *more)
    for command in COMMANDS
    for more in [(), *((name,) for name in functions(command)[1])]
]
OPTIONS = {entry.command: entry.options for entry in entries()}


def help_of(path: Sequence[str], command: Command) -> str:
    """Help of a command or subcommand."""
    return command(" ".join(path), "--help").out


@pytest.mark.parametrize("path", PATHS, ids=" ".join)
def test_help_shows_real_defaults_and_completion_knows_the_options(
    path: tuple[str, ...], command: Command
) -> None:
    said = help_of(path, command)
    told = " ".join(said.split())
    assert told.startswith(f"usage: draft {' '.join(path)} ")
    assert "None" not in told
    assert not re.search(r"\(default: *\)|\{\}|=>|STR\b|INT\b|FLOAT\b|PATH\b", told)
    # Every option says whether it must be given, or what it is otherwise.
    options = OPTIONS[" ".join(path)]
    stated = re.findall(r"\((?:default: [^)]+|required[^)]*)\)", told)
    assert len(stated) >= len(options)
    listed = set(re.findall(r"^ +(?:-h, )?(--[a-z][a-z0-9-]*)", said, re.MULTILINE))
    assert {*options, "--help"} == (listed or {"--help"})


def test_completion_knows_every_command() -> None:
    assert {" ".join(path) for path in PATHS} == set(OPTIONS)


def test_a_command_without_its_subcommand_names_them(command: Command) -> None:
    for word in ("learn", "trends", "survey"):
        names = ", ".join(sorted(functions(word)[1]))
        err = f"error: 'draft {word}' needs a subcommand\n  subcommands: {names}\n"
        assert command.refuses(word) == err
    err = command.refuses("survey tabel")
    assert "'draft survey' has no subcommand 'tabel'\n  did you mean 'table'?" in err


@pytest.mark.parametrize(
    ("words", "option", "near"),
    [
        ("build bear --output x", "--output", "--out"),
        ("screen bear --output=x.parquet", "--output", "--out"),
        ("import a.urdf --out_folder x", "--out-folder", "--out"),
        ("train bear --minuts 8", "--minuts", "--minutes"),
        ("trends fit --outfile x", "--outfile", "--out"),
        ("surface bear --replica 3", "--replica", "--replicas"),
    ],
)
def test_an_unknown_option_is_refused_with_the_nearest_one(
    words: str, option: str, near: str, command: Command
) -> None:
    err = command.refuses(words)
    assert f"has no option '{option}'" in err
    assert f"\n  did you mean '{near}'? " in err


def test_counts_have_nouns_in_the_singular_and_in_the_plural() -> None:
    said = [counted(n, "design") for n in (0, 1, 2, 1000)]
    assert said == ["0 designs", "1 design", "2 designs", "1000 designs"]
    assert counted(1000, "design", ",") == "1,000 designs"
    plurals = [counted(2, noun) for noun in ("actuator class", "body")]
    assert plurals == ["2 actuator classes", "2 bodies"]


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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    (tmp_path / "weigh.py").write_text(COMMAND)
    monkeypatch.setattr(draft.cli, "__path__", [*draft.cli.__path__, str(tmp_path)])
    monkeypatch.setitem(COMMANDS, "weigh", "Print the mass of a robot.")
    mass = float(draft.load("quadruped").resolve("bear").mass)
    assert command("weigh bear").out == f"{mass:.1f}\n"
    assert command("weigh quadruped --design bear --grams").out == f"{mass * 1e3:.1f}\n"
    assert "did you mean 'bear'?" in command.refuses("weigh baer")
    assert re.search(r"weigh +Print the mass of a robot\.", command("--help").out)
    assert "--grams Print grams. (default: False)" in " ".join(help_of(["weigh"], command).split())
    completion = {entry.command: entry for entry in entries()}["weigh"]
    assert completion.options == ("--design", "--set", "--grams")
    assert "bear" in completion.values[""].words


RANGE = "bear --vary thigh_length=0.2:0.3"
RESUMES = r"interrupted: .*{}.*; the same command resumes\n"


@pytest.mark.parametrize(
    ("words", "called", "said"),
    [
        (
            f"optimise {RANGE} --minimise mass --out s",
            "explore.optimise.optimise",
            RESUMES.format("trials"),
        ),
        (f"screen {RANGE} --out s", "explore.screen.screen", RESUMES.format("the parts done")),
        (f"sweep {RANGE} --out s", "explore.sweep.sweep", RESUMES.format("the parts done")),
        (
            "report bear",
            "reporting.report.write_report",
            "interrupted: nothing is written, and what was there is kept; "
            "the same command starts again\n",
        ),
    ],
)
def test_ctrl_c_says_what_is_kept_and_how_to_go_on(
    words: str, called: str, said: str, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(f"draft.{called}", interrupt)
    assert re.fullmatch(said, command(words, code=130).err)
    assert [path.name for path in Path().iterdir()] == ["robot"]
