"""The best designs of a search: those that none other beats in everything, as files."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from draft import files
from draft.errors import DraftError, Problem
from draft.explore.optimise import VIOLATION, Search
from draft.values import Array

NAME = re.compile(r"front_\d{3,}")


def best(values: Array) -> NDArray[np.intp]:
    """Rows that no other row beats, of values that should be small, shape (N, goals).

    Of equal rows only the first is among them; they come in order of the first goal.
    """
    order = np.lexsort(values.T[::-1])
    kept: list[int] = []
    for row in order:
        # Sorted as they are, only rows before this one can beat it.
        if not kept or not np.any(np.all(values[kept] <= values[row], axis=1)):
            kept.append(int(row))
    return np.asarray(kept, dtype=np.intp)


def sound(trials: Any) -> list[Any]:
    """The trials that have values and meet all constraints."""
    return [t for t in trials if t.values and all(v <= 0 for v in t.user_attrs.get(VIOLATION, []))]


def front(search: Search, trials: Any) -> list[dict[str, Any]]:
    """The best of the trials that meet all constraints: number, values and goals of each."""
    found = sound(trials)
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


def save(search: Search, found: list[dict[str, Any]], out: Path) -> None:
    """Write front.csv, front.json, and each design as `designs/NAME.yaml`.

    Designs of an earlier front go once the new ones are there; no other file is touched.

    Raises:
        DraftError: a file cannot be written, or a design of another making has a name of these.
    """
    old = _earlier(out)
    for one in found:
        path = out / "designs" / f"{one['design']}.yaml"
        if path.exists() and one["design"] not in old:
            cause = f"'{path}' is not of this search: it is kept"
            raise DraftError(Problem(cause, None, "give another --out"))
    fixed = dict(search.job.values)
    for one in found:
        words = ", ".join(f"{name} = {value:.6g}" for name, value in one["goals"].items())
        document = {"doc": f"Found by draft optimise: {words}.", "values": fixed | one["values"]}
        text = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=1000)
        files.write(out / "designs" / f"{one['design']}.yaml", text)
    files.write(out / "front.csv", _csv(found))
    record = {"manifest": search.manifest(), "front": found}
    files.write(out / "front.json", json.dumps(record, indent=1) + "\n")
    for name in old - {one["design"] for one in found}:
        with contextlib.suppress(OSError):  # another process on the same study was first
            (out / "designs" / f"{name}.yaml").unlink()


def _earlier(out: Path) -> set[str]:
    """Names of the designs that an earlier front in this folder has written."""
    try:
        front = json.loads((out / "front.json").read_text(encoding="utf-8"))["front"]
        names = {str(one["design"]) for one in front}
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    return {name for name in names if NAME.fullmatch(name)}


def _csv(found: list[dict[str, Any]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    if found:
        writer.writerow(["design", "trial", *found[0]["goals"], *found[0]["values"]])
    for one in found:
        writer.writerow(
            [one["design"], one["trial"], *one["goals"].values(), *one["values"].values()]
        )
    return stream.getvalue()
