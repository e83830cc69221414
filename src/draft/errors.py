"""Errors: a common base class, and problems with their place in a file."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Location:
    """Place in a file; lines and columns count from 1. In a mapping, the keys that lead to it."""

    file: str
    line: int | None = None
    column: int | None = None
    keys: tuple[str | int, ...] = ()

    def __str__(self) -> str:
        file = self.file + "".join(f"[{key}]" for key in self.keys)
        return ":".join(str(part) for part in (file, self.line, self.column) if part)


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem: its cause, its place in a file, and what to do about it.

    Attributes:
        cause: what is wrong.
        where: its place; None if no file is involved.
        remedy: what is available, and what to do, as an imperative; "" without a remedy.
    """

    cause: str
    where: Location | None = None
    remedy: str = ""

    def __str__(self) -> str:
        head = f"{self.where}: {self.cause}" if self.where else self.cause
        return f"{head}\n  {self.remedy}" if self.remedy else head


class DraftError(Exception):
    """Base of every error that the user can correct.

    Attributes:
        problems: every problem found, in the order of the files.
    """

    def __init__(self, problems: str | Problem | Sequence[Problem], remedy: str = "") -> None:
        """Make the error.

        Args:
            problems: what is wrong; as text where no file is involved.
            remedy: what to do about it, with a text.
        """
        if isinstance(problems, str):
            problems = Problem(problems, None, remedy)
        self.problems = (problems,) if isinstance(problems, Problem) else tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    def __reduce__(self) -> tuple[type[DraftError], tuple[tuple[Problem, ...]]]:
        """Pickle the problems; by default only their text would reach another process."""
        return type(self), (self.problems,)


class SpecError(DraftError):
    """A file of a spec is unreadable, misspelt or contradictory."""


class ResolveError(DraftError):
    """The spec is valid, but these parameter values give no design."""


class RefusedError(DraftError):
    """The design filter found errors, so the design is not compiled."""


class ModelError(DraftError):
    """MuJoCo rejects the model, or its masses differ from those of the design."""


def suggest(name: str, available: Iterable[str], what: str = "available") -> str:
    """Remedy for an unknown name: the nearest name, then the available ones.

    Args:
        name: the unknown name.
        available: the known names; of more than 40 only the nearest few are listed.
        what: plural noun for the names, such as "parameters".
    """
    names = sorted(set(available))
    # Comparing with every name is slow where there are thousands.
    cutoff = 0.0 if len(names) <= 200 else 0.6
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    shown = names if len(names) <= 40 else difflib.get_close_matches(name, names, 6, cutoff)
    rest = f" and {len(names) - len(shown)} more" if len(shown) < len(names) else ""
    listed = f"{what}: {', '.join(shown) or 'none'}{rest}"
    if names and not shown:
        listed = f"{what}: {len(names)}, none of them like it"
    return f"did you mean '{near[0]}'? {listed}" if near else listed


def listed(items: Iterable[str], most: int = 3) -> str:
    """The first of some items: "a, b, c and 2 more".

    Args:
        items: the items, with quotes where they are names.
        most: the largest number that is shown.
    """
    items = list(items)
    rest = f" and {len(items) - most} more" if len(items) > most else ""
    return ", ".join(items[:most]) + rest


def quoted(names: Iterable[str], most: int = 3) -> str:
    """The first of some names, each in quotes."""
    return listed([f"'{name}'" for name in names], most)


def counted(count: int, noun: str, form: str = "") -> str:
    """Count and noun: "1 design", "2 designs", "1000 classes".

    Args:
        count: the number.
        noun: its noun in the singular.
        form: format of the number, such as "," for separated thousands.
    """
    if count == 1:
        return f"1 {noun}"
    ending = "es" if noun.endswith(("s", "sh", "x")) else "s"
    return f"{count:{form}} {f'{noun[:-1]}ies' if noun.endswith('dy') else noun + ending}"
