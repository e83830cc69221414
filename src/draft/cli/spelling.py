"""Messages of the library, with the arguments that they name spelt as options of a command.

The library quotes the name of an argument with backquotes, alone or with a value, and calls of
`draft` likewise: `out`, `origin=RUN`, `draft.train("runs/bear", iterations=300)`. For a command,
these are --out, --from RUN, and 'draft train runs/bear --iterations 300'.
"""

from __future__ import annotations

import ast
import re
import shlex
from contextvars import ContextVar
from dataclasses import replace

from draft.cli import COMMANDS, Function, functions
from draft.cli.completion import spellings
from draft.errors import DraftError, Problem

_ARGUMENT = re.compile(r"`(\w+)(?:=([^`]+))?`")
_CALL = re.compile(r"`draft\.(\w+)(?:\.(\w+))?(?:\(([^`]*)\))?`")


# Function of the command that runs.
RUNNING: ContextVar[Function | None] = ContextVar("RUNNING", default=None)


def spelt(text: str) -> str:
    """Return a text of the library with the options of the command that runs.

    Names of arguments that it does not have stay as they are.
    """
    function = RUNNING.get()
    if "`" not in text or function is None:
        return text
    options = spellings(function)

    def option(found: re.Match[str]) -> str:
        name, value = found.groups()
        if name not in options:
            return found[0]
        return " ".join([options[name], *([] if value is None else [value.strip('"')])])

    return _ARGUMENT.sub(option, _CALL.sub(_command, text))


def spelt_error(error: DraftError) -> DraftError:
    """Return an error of the same kind, whose problems name the options of the command."""
    return type(error)([_problem(problem) for problem in error.problems])


def _problem(problem: Problem) -> Problem:
    where = problem.where and replace(problem.where, file=spelt(problem.where.file))
    return Problem(spelt(problem.cause), where, spelt(problem.remedy))


def _command(found: re.Match[str]) -> str:
    """Return the command of a call; what is no call of a command stays as it is."""
    command, subcommand, values = found.groups()
    main, subcommands = functions(command) if command in COMMANDS else (None, {})
    main = subcommands.get(subcommand) if subcommand else main
    try:
        call = ast.parse(f"_({values or ''})", mode="eval").body
    except SyntaxError:
        return found[0]
    if main is None or not isinstance(call, ast.Call):
        return found[0]
    words, options = ["draft", command, *[subcommand] * bool(subcommand)], spellings(main)
    words += map(_word, call.args)
    for one in call.keywords:
        words += [options.get(one.arg or "", ""), *_words(one.value)]
    return f"'{' '.join(words)}'"


def _words(value: ast.expr) -> list[str]:
    """Return a value as words of a command line: those of a list, and none for True, of a flag."""
    if isinstance(value, ast.List):
        return [*map(_word, value.elts)]
    return [] if ast.unparse(value) == "True" else [_word(value)]


def _word(value: ast.expr) -> str:
    """Return a value as a word of a command line."""
    return shlex.quote(str(value.value) if isinstance(value, ast.Constant) else ast.unparse(value))
