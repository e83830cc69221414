"""Commands, called in this process as a shell would call them."""

from __future__ import annotations

import json
import shlex
from typing import Any, NamedTuple

import pytest

from draft.cli import main


class Said(NamedTuple):
    """What a command prints."""

    out: str
    err: str


class Command:
    """Runs commands of `draft`, and reads what they print."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, line: str, *words: str, code: int = 0) -> Said:
        """Run a command, which must end with this exit code and without a traceback.

        Args:
            line: its first words, as in a shell.
            words: its other words.
            code: exit code.
        """
        self._capsys.readouterr()
        try:
            ended: object = main([*shlex.split(line), *words])
        except SystemExit as error:
            ended = error.code
        printed = self._capsys.readouterr()
        said = Said(printed.out, printed.err)
        assert ended == code, said
        assert "Traceback" not in said.err, said.err
        return said

    def json(self, line: str, *words: str, code: int = 0) -> Any:
        """Run a command with --json, and read the one object that it prints."""
        # Slow machines report progress beside it.
        return json.loads(self(line, *words, "--json", code=code).out)

    def refuses(self, line: str, *words: str) -> str:
        """Run a command that ends with a message about bad input alone: the message."""
        said = self(line, *words, code=2)
        assert said.out == "", said.out
        return said.err
