"""A run's progress.csv: one row of numbers per iteration."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

Row = dict[str, float]
STAIRS = "stairs/hardest_row"


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


def hardest_row(path: Path, iteration: int) -> float | None:
    """Hardest row of stairs that a robot was on up to an iteration; None where none was noted."""
    noted = [row.get(STAIRS, math.nan) for row in read(path) if row["iteration"] <= iteration]
    return max((row for row in noted if math.isfinite(row)), default=None)
