"""The help of every command and subcommand, and how a command is added."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import draft.cli
from draft.cli import COMMANDS, functions, main
from draft.cli.completion import entries
from draft.errors import counted

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


@pytest.mark.parametrize(
    ("words", "near"),
    [
        (("build", "bear", "--output", "x"), "--out"),
        (("screen", "bear", "--output=x.parquet"), "--out"),
        (("import", "a.urdf", "--out_folder", "x"), "--out"),
        (("train", "bear", "--minuts", "8"), "--minutes"),
        (("trends", "fit", "--outfile", "x"), "--out"),
        (("surface", "bear", "--replica", "3"), "--replicas"),
    ],
)
def test_an_unknown_option_is_refused_with_the_nearest_one(
    words: tuple[str, ...], near: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    err = capsys.readouterr().err
    assert (
        f"has no option '{words[-2 if '=' not in words[-1] else -1].split('=')[0]}'".replace(
            "_", "-"
        )
        in err
    )
    assert f"\n  did you mean '{near}'? " in err


@pytest.mark.parametrize("path", PATHS, ids=" ".join)
def test_every_option_is_known(path: tuple[str, ...]) -> None:
    main_, subcommands = functions(path[0])
    function = subcommands[path[1]] if len(path) > 1 else main_
    if function is not None:
        draft.cli._check_options(function, " ".join(path), OPTIONS[" ".join(path)])


def test_counts_have_nouns_in_the_singular_and_in_the_plural() -> None:
    said = [counted(n, "design") for n in (0, 1, 2, 1000)]
    assert said == ["0 designs", "1 design", "2 designs", "1000 designs"]
    assert counted(1000, "design", ",") == "1,000 designs"
    assert [counted(2, noun) for noun in ("actuator class", "body")] == [
        "2 actuator classes",
        "2 bodies",
    ]


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


@pytest.mark.parametrize(
    ("words", "called", "kept"),
    [
        ("optimise bear --vary thigh_length=0.2:0.3 --minimise mass --out s", "optimise", "trials"),
        ("screen bear --vary thigh_length=0.2:0.3 --out s.parquet", "screen", "the parts done"),
        ("sweep bear --vary thigh_length=0.2:0.3 --out s", "sweep", "the parts done"),
    ],
)
def test_ctrl_c_says_what_is_kept_and_how_to_go_on(
    words: str,
    called: str,
    kept: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(f"draft.explore.{called}.{called}", interrupt)
    assert main(words.split()) == 130
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("interrupted: ")
    assert kept in line
    assert line.endswith("; the same command resumes")


def test_ctrl_c_in_a_report_says_that_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("draft.reporting.report.write_report", interrupt)
    assert main(["report", "bear"]) == 130
    assert capsys.readouterr().err == (
        "interrupted: nothing is written, and what was there is kept; "
        "the same command starts again\n"
    )
    assert not Path("report.html").exists()
