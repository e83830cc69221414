"""How far a run is: an iteration at a time, and progress.csv with one row for each."""

from __future__ import annotations

import csv
import io
import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

Row = dict[str, float]
STAIRS = "stairs/hardest_row"
FASTEST = "curriculum/fastest"
# Of a thinned curve: columns, and the most windows.
OF_CURVE = ("reward", "episode_s", "falls", "tracking_error", STAIRS, FASTEST)
POINTS = 50


@dataclass(frozen=True)
class Progress:
    """How far a run is, after an iteration.

    Attributes:
        iteration: iterations done.
        total: iterations asked for.
        steps_per_second: of all worlds together.
        left: seconds of training left at this speed.
        row: what the iteration was like; see `draft.learn.lab.log`.
    """

    iteration: int
    total: int
    steps_per_second: float
    left: float
    row: Row


def read(path: Path) -> list[Row]:
    """Rows of a progress.csv, none where there is none; one cut short is left out."""
    try:
        lines = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))
    except OSError:
        return []
    rows = []
    for line in lines[1:]:
        try:
            rows.append({n: float(v) for n, v in zip(lines[0], line, strict=True)})
        except ValueError:
            continue
    return rows


def thin(rows: Sequence[Row]) -> list[Row]:
    """Curve of a training: means over at most `POINTS` windows of its iterations.

    Args:
        rows: of each iteration.

    Returns:
        One row a window, with the iteration and what of `OF_CURVE` was noted in it, to six digits.
    """
    width = max(1, math.ceil(len(rows) / POINTS))
    windows = [rows[start : start + width] for start in range(0, len(rows), width)]
    return [_mean(window) for window in windows]


def _mean(window: Sequence[Row]) -> Row:
    found = {}
    for name in ("iteration", *OF_CURVE):
        values = [row[name] for row in window if math.isfinite(row.get(name, math.nan))]
        if values:
            found[name] = float(f"{statistics.fmean(values):.6g}")
    return found


def hardest_row(path: Path, iteration: int) -> float | None:
    """Hardest row of stairs that a robot was on up to an iteration; None where none was noted."""
    return max(_noted(path, STAIRS, iteration), default=None)


def fastest(path: Path, iteration: float = math.inf) -> float | None:
    """Fastest |vx| that was asked for at an iteration [m/s]; None where none was noted."""
    return next(reversed(_noted(path, FASTEST, iteration)), None)


def _noted(path: Path, name: str, iteration: float) -> list[float]:
    """Values of a column up to an iteration, without gaps."""
    values = (row.get(name, math.nan) for row in read(path) if row["iteration"] <= iteration)
    return [value for value in values if math.isfinite(value)]
