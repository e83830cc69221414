"""Counted samples of an evaluation, read from its Parquet files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from draft.extras import need
from draft.learn.bodies.legged import CLASSES
from draft.learn.measuring.results import OCCUPANCY, UTILISATION
from draft.learn.measuring.utilisation import BINS, CELLS, QUANTITIES
from draft.study.report.records import Samples
from draft.values import Array

COLUMNS = {
    UTILISATION: ("test", "level", "joint", "quantity", "bin", "count"),
    OCCUPANCY: ("test", "level", "joint", "torque", "speed", "count"),
}
WORDS = ("test", "joint", "quantity")
BEFORE = {"test": "battery"}  # Names of columns that an older Draft wrote.
Columns = dict[str, Any]


def read(folder: Path, levels: Mapping[str, float]) -> tuple[dict[str, Samples], list[str]]:
    """Read the counted samples of an evaluation.

    Args:
        folder: folder of the evaluation.
        levels: level to read, by test.

    Returns:
        Samples by test, and warnings about files that cannot be read.

    Raises:
        DraftError: the extra that reads Parquet is not installed.
    """
    warnings: list[str] = []
    tables = {name: _table(folder / name, warnings) for name in COLUMNS}
    found = {}
    for test, level in levels.items():
        counts = dict(_counts(tables[UTILISATION], test, level))
        found[test] = Samples(counts, dict(_cells(tables[OCCUPANCY], test, level)))
    return found, warnings


def _table(path: Path, warnings: list[str]) -> Columns | None:
    """Return the columns of a file of counts; None if it cannot be read."""
    parquet = need("pyarrow.parquet")
    try:
        there = parquet.read_schema(path).names
        stored = {n: n if n in there else BEFORE.get(n, n) for n in COLUMNS[path.name]}
        table = parquet.read_table(path, columns=list(stored.values()))
        return {name: _column(name, table.column(own)) for name, own in stored.items()}
    except (OSError, ValueError, KeyError) as error:  # pyarrow's errors derive from these.
        words = " ".join(str(error).split())[:120]
        where = "/".join(path.parts[-4:])
        warnings.append(f"{where} cannot be read ({words}); its counts are omitted")
        return None


def _column(name: str, column: Any) -> Any:
    """Return the values of a column as numbers or text.

    Raises:
        ValueError: they are of another type, or missing.
    """
    if column.null_count:
        raise ValueError(f"column {name} has missing values")
    kind = "string" if name in WORDS else "double" if name == "level" else "int64"
    return column.cast(kind).to_numpy(zero_copy_only=False)


def _counts(
    table: Columns | None, test: str, level: float
) -> Iterator[tuple[tuple[str, str], Array]]:
    """Yield the samples by bin of each joint class and quantity."""
    if table is not None:
        at = _at(table, test, level)
        for joint, quantity in product(CLASSES, QUANTITIES):
            rows = at & (table["joint"] == joint) & (table["quantity"] == quantity)
            if rows.any():
                yield (joint, quantity), _total(table, rows, {"bin": BINS})


def _cells(table: Columns | None, test: str, level: float) -> Iterator[tuple[str, Array]]:
    """Yield the samples by torque and speed of each joint class, shape (cells, cells)."""
    if table is not None:
        at = _at(table, test, level)
        for joint in CLASSES:
            rows = at & (table["joint"] == joint)
            if rows.any():
                yield joint, _total(table, rows, {"torque": CELLS, "speed": CELLS})


def _total(table: Columns, rows: Array, axes: Mapping[str, int]) -> Array:
    """Return the counts of rows by bins; those out of range are in the first or last."""
    places = tuple(np.clip(table[name][rows].astype(int), 0, n - 1) for name, n in axes.items())
    total = np.zeros(tuple(axes.values()))
    np.add.at(total, places, table["count"][rows])
    return total


def _at(table: Columns, test: str, level: float) -> Array:
    """Return the mask of the rows of a test's level."""
    return (table["test"] == test) & (np.abs(table["level"] - level) < 1e-6)
