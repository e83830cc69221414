"""A command that runs in this process, and what it prints."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from draft.cli import main


def _run(words: tuple[str | Path, ...]) -> tuple[int, str, str]:
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main([*map(str, words)])
    return code, out.getvalue(), err.getvalue()


def printed(*words: str | Path, code: int = 0, progress: bool = False) -> str:
    """What a command prints that ends with a code and, but for its progress, without an error."""
    found, out, err = _run(words)
    assert found == code, err
    assert progress or not err
    return out


def refusal(*words: str | Path, first: str = "") -> str:
    """The error that a command ends with, having printed nothing but, perhaps, some words first."""
    found, out, err = _run(words)
    assert (found, out) == (2, "")
    assert err.startswith(f"{first}error: ")
    return err.removeprefix(f"{first}error: ")


def line(text: str) -> str:
    """A text whose lines were broken to the width of a terminal, as one line."""
    return " ".join(text.split())
