"""Pareto front of a search: the designs that no other beats in every goal, as files."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, overload

import numpy as np
import yaml
from numpy.typing import NDArray

from draft import files
from draft.errors import DraftError, counted
from draft.explore.search import VIOLATION, Search
from draft.values import Array

if TYPE_CHECKING:
    from optuna.trial import FrozenTrial

UNDEFINED = "a goal is undefined"
NAME = re.compile(r"front_\d{3,}")


class Entry(TypedDict):
    """A design of the front: its file's name, the trial, the varied values, and the goals."""

    design: str
    trial: int
    values: dict[str, float]
    goals: dict[str, float]


@dataclass(frozen=True)
class Front(Sequence[Entry]):
    """The designs of a search that no other trial beats in every goal.

    It is a sequence: each entry has `design` (name of its file in `out/designs`), `trial`, `values`
    (what was varied) and `goals`, by name.

    Attributes:
        out: folder of the study and the front.
        trials: trials of the study, those of earlier calls included.
        best: the entries, in order of the first goal.
        failed: number of trials that fail a condition, by condition; `a goal is undefined` counts
            those without numbers.
    """

    out: Path
    trials: int
    best: tuple[Entry, ...]
    failed: Mapping[str, int]

    @overload
    def __getitem__(self, index: int) -> Entry: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Entry, ...]: ...
    def __getitem__(self, index: int | slice) -> Entry | tuple[Entry, ...]:
        return self.best[index]

    def __len__(self) -> int:
        return len(self.best)

    def __repr__(self) -> str:
        best = counted(len(self), "best design")
        return f"Front('{self.out}', {counted(self.trials, 'trial')}, {best})"


def best(values: Array) -> NDArray[np.intp]:
    """Indices of the rows that no other row dominates, in order of the first goal.

    Args:
        values: values to minimise, shape (N, goals). Of equal rows only the first is returned.
    """
    order = np.lexsort(values.T[::-1])
    kept: list[int] = []
    for row in order:
        # The rows are sorted, so that only an earlier row can dominate this one.
        if not kept or not np.any(np.all(values[kept] <= values[row], axis=1)):
            kept.append(int(row))
    return np.asarray(kept, dtype=np.intp)


def feasible(trials: Iterable[FrozenTrial]) -> list[FrozenTrial]:
    """Return the trials that have values and meet all constraints."""
    return [t for t in trials if t.values and all(v <= 0 for v in t.user_attrs.get(VIOLATION, []))]


def front(search: Search, trials: Iterable[FrozenTrial]) -> list[Entry]:
    """Return the Pareto front of the trials that meet all constraints."""
    found = feasible(trials)
    if not found:
        return []
    signs = np.array([1.0 if goal.less else -1.0 for goal in search.goals])
    rows = best(np.array([t.values for t in found]) * signs)
    names = [goal.text for goal in search.goals]
    return [
        {
            "design": f"front_{k + 1:03d}",
            "trial": found[row].number,
            "values": dict(found[row].params),
            "goals": dict(zip(names, found[row].values, strict=True)),
        }
        for k, row in enumerate(rows)
    ]


def failed(search: Search, trials: Sequence[FrozenTrial]) -> dict[str, int]:
    """Return the number of trials that fail each condition, and with a goal that is undefined."""
    missed = [trial.user_attrs.get(VIOLATION, []) for trial in trials]
    found = {
        one.text: sum(k < len(row) and not row[k] <= 0 for row in missed)
        for k, one in enumerate(search.constraints)
    }
    undefined = sum(not trial.values for trial in trials)
    return found | ({UNDEFINED: undefined} if undefined else {})


def save(search: Search, entries: list[Entry], out: Path) -> None:
    """Write front.csv, front.json, and each design as `designs/NAME.yaml`.

    Designs of an earlier front are removed after the new ones are written; other files are kept.

    Raises:
        DraftError: a file cannot be written, or another design has the name of one of these.
    """
    old = _earlier(out)
    for entry in entries:
        path = out / "designs" / f"{entry['design']}.yaml"
        if path.exists() and entry["design"] not in old:
            cause = f"'{path}' is not a design of this search; it is kept"
            raise DraftError(cause, "give another `out`")
    fixed = dict(search.job.values)
    for entry in entries:
        goals = ", ".join(f"{name} = {value:.6g}" for name, value in entry["goals"].items())
        document = {"doc": f"Found by draft optimise: {goals}.", "values": fixed | entry["values"]}
        text = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=1000)
        files.write(out / "designs" / f"{entry['design']}.yaml", text)
    files.write(out / "front.csv", _csv(entries))
    record = {"manifest": search.manifest(), "front": entries}
    files.write(out / "front.json", json.dumps(record, indent=1) + "\n")
    for name in old - {entry["design"] for entry in entries}:
        with contextlib.suppress(OSError):  # another process of the same study removed it
            (out / "designs" / f"{name}.yaml").unlink()


def _earlier(out: Path) -> set[str]:
    """Names of the designs of the earlier front in this folder."""
    try:
        front = json.loads((out / "front.json").read_text(encoding="utf-8"))["front"]
        names = {str(one["design"]) for one in front}
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    return {name for name in names if NAME.fullmatch(name)}


def _csv(entries: list[Entry]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    if entries:
        writer.writerow(["design", "trial", *entries[0]["goals"], *entries[0]["values"]])
    for entry in entries:
        numbers = (*entry["goals"].values(), *entry["values"].values())
        writer.writerow([entry["design"], entry["trial"], *numbers])
    return stream.getvalue()
