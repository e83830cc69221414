"""A run's progress.csv: one row of numbers per iteration."""

from __future__ import annotations

import csv
import io
from pathlib import Path

Row = dict[str, float]


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
