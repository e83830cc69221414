"""Options of screen, sweep and optimise: fields of their settings, in Python and in the command."""

from __future__ import annotations

import inspect
from typing import Annotated

import pytest
from pydantic import Field

import draft
from draft.cli import COMMANDS, _call, functions
from draft.cli.completion import arguments
from draft.cli.explore_options import options
from draft.cli.options import DesignArgument, JsonOutput
from draft.explore.settings import ScreenSettings, SearchSettings, SweepSettings
from draft.settings import Shown, takes

RECORDS = {"screen": ScreenSettings, "sweep": SweepSettings, "optimise": SearchSettings}


class Thinned(ScreenSettings):
    """Settings of a screen, with one more."""

    every: Annotated[int | None, Field(ge=1), Shown("N", "all")] = None
    """Keep one row of so many."""


@takes(Thinned)
def screen(robot: str, settings: Thinned) -> Thinned:
    """Screen.

    Args:
        robot: a robot.
        settings: fields of `Thinned`, by keyword.
    """
    return settings


@options(Thinned)
def command(reference: DesignArgument, /, *, settings: Thinned, json: JsonOutput = False) -> int:
    """Screen."""
    print(settings.every, settings.n, settings.vary, settings.metrics)
    return 0


def test_an_option_is_added_by_its_field(capsys: pytest.CaptureFixture[str]) -> None:
    vary = {"thigh_length": (0.2, 0.3)}
    assert screen("bear", vary=vary, out="s.parquet", every=3).every == 3
    assert "\n    every: keep one row of so many; by default all." in (inspect.getdoc(screen) or "")
    with pytest.raises(draft.DraftError, match=r"^`every` 0 is not a whole number of at least 1"):
        screen("bear", vary=vary, out="s.parquet", every=0)
    words = ["bear", "--vary", "thigh_length=0.2:0.3", "--out", "s.parquet", "--every"]
    assert _call(command, "screen", None, [*words, "3", "--n", "1e6"]) == 0
    assert capsys.readouterr().out == f"3 1000000 {vary} None\n"
    with pytest.raises(draft.DraftError, match=r"^--every 0 is not a whole number of at least 1"):
        _call(command, "screen", None, [*words, "0"])
    with pytest.raises(SystemExit):
        _call(command, "screen", None, ["--help"])
    assert "--every N Keep one row of so many. (default: all)" in " ".join(
        capsys.readouterr().out.replace("│", " ").split()
    )
    assert "--every" in arguments(command)


@pytest.mark.parametrize("name", RECORDS)
def test_python_and_the_command_have_the_fields_of_the_settings(name: str) -> None:
    fields = set(RECORDS[name].model_fields)
    assert set(inspect.signature(getattr(draft, name)).parameters) == {"robot", *fields}
    assert name in COMMANDS
    main, _ = functions(name)
    assert main is not None
    shown = {option.removeprefix("--").replace("-", "_") for option in arguments(main)}
    own = {"", "design", "set", "payload", "json"}
    assert shown == (fields - {"values", "progress"}) | own
