"""What Draft says when something is wrong: one base error, and where in a file it happened."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Location:
    """A place in a file that a person wrote. Lines and columns count from 1."""

    file: str
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        return ":".join(str(part) for part in (self.file, self.line, self.column) if part)


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong: where, what, and what to do about it."""

    cause: str
    where: Location | None = None
    remedy: str = ""

    def __str__(self) -> str:
        head = f"{self.where}: {self.cause}" if self.where else self.cause
        return f"{head}\n  {self.remedy}" if self.remedy else head


class DraftError(Exception):
    """Base of every error that Draft raises for something the user can mend.

    Attributes:
        problems: what is wrong, in the order of the files.
    """

    def __init__(self, problems: Problem | Sequence[Problem]) -> None:
        self.problems = (problems,) if isinstance(problems, Problem) else tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    def __reduce__(self) -> tuple[type[DraftError], tuple[tuple[Problem, ...]]]:
        """Travel between processes with the problems, not only with their words."""
        return type(self), (self.problems,)


class SpecError(DraftError):
    """The files of a spec are not a spec: unreadable, misspelt, contradictory."""


class ResolveError(DraftError):
    """The spec is sound, but these parameter values give no design."""


class RefusedError(DraftError):
    """The design filter found errors, so no model is made of this design."""


class ModelError(DraftError):
    """MuJoCo does not accept the model, or the model does not weigh what the design says."""


def suggest(name: str, available: Iterable[str], what: str = "available") -> str:
    """Words that help with a name that does not exist: the nearest one, then what there is.

    Of many names only the nearest few are listed.
    """
    names = sorted(set(available))
    # Weighing every name against this one takes long where there are thousands.
    cutoff = 0.0 if len(names) <= 200 else 0.6
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    shown = names if len(names) <= 24 else difflib.get_close_matches(name, names, 6, cutoff)
    rest = f" and {len(names) - len(shown)} more" if len(shown) < len(names) else ""
    listed = f"{what}: {', '.join(shown) or 'none'}{rest}"
    if names and not shown:
        listed = f"{what}: {len(names)}, none of them like it"
    return f"did you mean '{near[0]}'? {listed}" if near else listed
