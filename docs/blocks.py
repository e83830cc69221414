"""Code blocks of a page, and what they do: tests run them, and pictures are drawn of the result.

A page is read from top to bottom as a newcomer reads it, in one empty folder:

- `sh`: commands. `draft ...`, with or without `uv run [options]` before it, runs in this process
  or in that of a Python that is given; `python FILE` in another. `<!-- arguments only -->` above a
  block checks the arguments, for what takes minutes or opens a window; `<!-- shown -->` above any
  block skips it.
- `yaml` or `csv` that begins with `# FILE`: the file is written. With `# FILE, below "LINE"` the
  block is inserted below that line, with `# FILE, instead of "LINE"` it replaces the line.
- `python`: is run; with `# FILE` as its first line it is written and run as a script.
- `text`: every line is in the output of the command above, up to spaces.
"""

from __future__ import annotations

import contextlib
import functools
import io
import itertools
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ARGUMENTS_ONLY, SHOWN = "arguments only", "shown"
# Python of an environment: called with its arguments, the current folder, environment variables.
Python = Callable[[Sequence[str], Path, dict[str, str]], subprocess.CompletedProcess[str]]
_BLOCK = re.compile(r"(?:^<!-- ([\w ]+) -->\n+)?^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r'# ([\w./-]+\.\w+)(?:, (below|instead of) "(.+)")?$')


class BlockError(Exception):
    """A block of a page does not do what the page says."""


@dataclass(frozen=True)
class Block:
    """A fenced block of a page.

    Attributes:
        language: such as "sh".
        text: its text, with the newline at its end.
        mark: comment above it; "" for none.
        line: line of its fence in the page, from 1.
    """

    language: str
    text: str
    mark: str
    line: int


def blocks(page: Path) -> Iterator[Block]:
    """Yield the fenced blocks of a page that name a language."""
    text = page.read_text(encoding="utf-8")
    for found in _BLOCK.finditer(text):
        line = text.count("\n", 0, found.start(2)) + 1
        yield Block(found[2], found[3], found[1] or "", line)


def commands(block: Block) -> Iterator[list[str]]:
    """Yield the commands of a block, split into words as a shell splits them."""
    for line in block.text.replace("\\\n", " ").splitlines():
        if words := shlex.split(line, comments=True):
            yield words


def follow(page: Path, folder: Path, python: Python | None = None) -> None:
    """Do what a page says in a folder, which becomes the current one meanwhile.

    Args:
        page: the page.
        folder: the folder.
        python: Python of the environment in which commands and code run; None for this one.

    Raises:
        BlockError: a command fails, prints something else, or a file does not have the line.
    """
    printed = ""
    with contextlib.chdir(folder):
        for block in blocks(page):
            try:
                printed = _do(block, printed, python)
            except (BlockError, OSError) as error:
                raise BlockError(f"{page.name}:{block.line}: {error}") from error


def _do(block: Block, printed: str, python: Python | None) -> str:
    """Do what a block says; return what it printed."""
    if block.mark == SHOWN:
        return printed
    if block.language == "sh":
        only = block.mark == ARGUMENTS_ONLY
        return "".join(run(words, only, python) for words in commands(block))
    if block.language in ("yaml", "csv"):
        write(block.text)
    elif block.language == "python":
        return run_python(block, python)
    elif block.language == "text":
        _compare(block.text, printed)
    return printed


def run(words: Sequence[str], arguments_only: bool = False, python: Python | None = None) -> str:
    """Run a command, or only check its arguments; return what it printed.

    Args:
        words: the command.
        arguments_only: check its arguments.
        python: Python of the environment to run it in; None for this one.

    Raises:
        BlockError: it is none that pages use, or it fails.
    """
    words = _without_uv(words)
    if words[0] == "python":
        return _script(words[1:], python) if not arguments_only else ""
    if words[0] != "draft":
        raise BlockError(f"'{shlex.join(words)}' is no command of Draft")
    if arguments_only:
        check_arguments(words[1:])
        return ""
    if python is not None:
        return _script(["-m", *words], python, codes=(0, 1))
    from draft.cli import main

    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = main(list(words[1:]))
    if code not in (0, 1):
        raise BlockError(f"'{shlex.join(words)}' ends with {code}:\n{error.getvalue()}")
    return out.getvalue() + error.getvalue()


def check_arguments(words: Sequence[str]) -> None:
    """Check the arguments of a command without running it.

    Raises:
        BlockError: they are wrong.
    """
    import tyro

    from draft.cli import functions
    from draft.cli.values import registry

    own, subcommands = functions(words[0])
    name, arguments = (
        (words[1], words[2:]) if words[1:2] and words[1] in subcommands else ("", words[1:])
    )
    chosen = subcommands.get(name) or own
    if chosen is None:
        raise BlockError(f"'draft {words[0]}' has no subcommand '{' '.join(words[1:2])}'")

    @functools.wraps(chosen)
    def stand_in(*given: object, **options: object) -> int:
        return 0

    error = io.StringIO()
    with contextlib.redirect_stderr(error):
        try:
            tyro.cli(
                stand_in,
                args=list(arguments),
                config=(tyro.conf.FlagCreatePairsOff,),
                registry=registry,
            )
        except SystemExit as ended:
            raise BlockError(f"'draft {shlex.join(words)}':\n{error.getvalue()}") from ended


def extras(words: Sequence[str]) -> tuple[str, ...]:
    """Extras that a command names after `uv run`."""
    return tuple(after for word, after in itertools.pairwise(words) if word == "--extra")


def _without_uv(words: Sequence[str]) -> list[str]:
    """Return a command without `uv run` and its options."""
    rest = list(words)
    if rest[:2] != ["uv", "run"]:
        return rest
    rest = rest[2:]
    while rest and rest[0].startswith("--"):
        rest = rest[2 if rest[0] in ("--extra", "--group") else 1 :]
    return rest


def write(text: str) -> None:
    """Write or change the file that the first line of a block names.

    Raises:
        BlockError: it names none, or the line to change is not in it once.
    """
    first, _, rest = text.partition("\n")
    found = _FILE.match(first)
    if found is None:
        raise BlockError(f"a file's name is missing: '{first}'")
    path, how, line = Path(found[1]), found[2], found[3]
    if how is None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(rest, encoding="utf-8")
        return
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    places = [row for row, one in enumerate(lines) if one.strip() == line]
    if len(places) != 1:
        raise BlockError(f"'{line}' is {len(places)} times in {path}")
    row = places[0]
    lines[row if how == "instead of" else row + 1 : row + 1] = [rest]
    path.write_text("".join(lines), encoding="utf-8")


def run_python(block: Block, python: Python | None = None) -> str:
    """Run a block of Python in the current folder, and return what it prints.

    A block whose first line names a file is written there and stays.
    """
    first, _, rest = block.text.partition("\n")
    named = _FILE.match(first)
    path = Path(named[1] if named else "block.py")
    path.write_text(rest if named else block.text, encoding="utf-8")
    try:
        return _script([str(path)], python)
    finally:
        if not named:
            path.unlink()


def _script(words: Sequence[str], python: Python | None, codes: Sequence[int] = (0,)) -> str:
    environment = os.environ | {"PYTHONWARNINGS": "ignore", "PYTHONIOENCODING": "utf-8"}
    done = (python or _here)(words, Path.cwd(), environment)
    if done.returncode not in codes:
        raise BlockError(
            f"'python {shlex.join(words)}' ends with {done.returncode}:\n{done.stderr}"
        )
    return done.stdout + (done.stderr if python else "")


def _here(
    words: Sequence[str], folder: Path, environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    """Run this Python with arguments."""
    # Scripts that call `draft` find the one of this environment.
    path = os.pathsep.join([os.path.dirname(sys.executable), os.environ.get("PATH", "")])
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        env=environment | {"PATH": path},
        check=False,
    )


def _compare(text: str, printed: str) -> None:
    """Find every line of a text in what was printed; raise BlockError for one that is not there."""
    shown = [" ".join(line.split()) for line in printed.splitlines()]
    for line in filter(str.strip, text.splitlines()):
        wanted = " ".join(line.split())
        if not any(wanted in one for one in shown):
            raise BlockError(f"'{line.strip()}' is not printed; there is:\n{printed}")


def copy_examples(folder: Path) -> None:
    """Copy the folder `examples` of the checkout, which pages use, without its results."""
    source = DOCS.parent / "examples"
    ignored = shutil.ignore_patterns("results", "__pycache__")
    shutil.copytree(source, folder / "examples", ignore=ignored)
