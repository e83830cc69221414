"""Commands, called in this process as a shell would call them."""

from __future__ import annotations

import io
import json
import shlex
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

from draft.cli import main


class Said(NamedTuple):
    """What a command prints."""

    out: str
    err: str


class Command:
    """Runs commands of `draft`, and reads what they print."""

    def __call__(self, line: str, *words: str | Path, code: int = 0) -> Said:
        """Run a command, which must end with this exit code and without a traceback.

        Args:
            line: its first words, as in a shell.
            words: its other words.
            code: exit code.
        """
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            try:
                ended: object = main([*shlex.split(line), *map(str, words)])
            except SystemExit as error:
                ended = error.code
        said = Said(out.getvalue(), err.getvalue())
        assert ended == code, said
        assert "Traceback" not in said.err, said.err
        return said

    def json(self, line: str, *words: str | Path, code: int = 0) -> Any:
        """Run a command with --json, and read the one object that it prints."""
        # Slow machines report progress beside it.
        return json.loads(self(line, *words, "--json", code=code).out)

    def refuses(self, line: str, *words: str | Path) -> str:
        """Run a command that ends with a message about bad input alone: the message."""
        said = self(line, *words, code=2)
        assert said.out == "", said.out
        return said.err


def printed(*words: str | Path, code: int = 0, progress: bool = False) -> str:
    """What a command prints that ends with a code and, but for its progress, without an error."""
    said = Command()("", *words, code=code)
    assert progress or not said.err
    return said.out


def refusal(*words: str | Path, first: str = "") -> str:
    """The error that a command ends with, having printed nothing but, perhaps, some words first."""
    err = Command().refuses("", *words)
    assert err.startswith(f"{first}error: ")
    return err.removeprefix(f"{first}error: ")


def line(text: str) -> str:
    """A text whose lines were broken to the width of a terminal, as one line."""
    return " ".join(text.split())
