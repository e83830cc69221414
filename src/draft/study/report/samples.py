"""Counted samples of an evaluation, read from its Parquet files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from draft.extras import need
from draft.learn.bodies.legged import CLASSES
from draft.learn.measuring.results import OCCUPANCY, UTILISATION
from draft.learn.measuring.utilisation import BINS, CELLS, QUANTITIES
from draft.study.report.records import Samples

COLUMNS = {
    UTILISATION: ("test", "level", "joint", "quantity", "bin", "count"),
    OCCUPANCY: ("test", "level", "joint", "torque", "speed", "count"),
}
WORDS = ("test", "joint", "quantity")
BEFORE = {"test": "battery"}  # Names of columns that an older Draft wrote.
Columns = dict[str, Any]


def read(folder: Path, levels: Mapping[str, float], warnings: list[str]) -> dict[str, Samples]:
    """Read the counted samples of an evaluation by test; those of a test without any are omitted.

    Args:
        folder: folder of the evaluation.
        levels: level to read, by test.
        warnings: gets what is said of files that cannot be read.

    Raises:
        DraftError: the extra that reads Parquet is not installed.
    """
    tables = {name: _table(folder / name, warnings) for name in COLUMNS if levels}
    found = {}
    for test, level in levels.items():
        bins: dict[Any, Any] = {}
        for joint in CLASSES:
            for quantity in QUANTITIES:
                at = {"joint": joint, "quantity": quantity, "test": test, "level": level}
                if counts := _total(tables[UTILISATION], at, {"bin": BINS}):
                    bins.setdefault(joint, {})[quantity] = counts
        axes = {"torque": CELLS, "speed": CELLS}
        cells = {
            joint: _total(tables[OCCUPANCY], {"joint": joint, "test": test, "level": level}, axes)
            for joint in CLASSES
        }
        plane = {joint: counts for joint, counts in cells.items() if counts}
        if bins or plane:
            found[test] = Samples.model_validate({"bins": bins, "plane": plane})
    return found


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


def _total(table: Columns | None, at: Mapping[str, Any], axes: Mapping[str, int]) -> list[Any]:
    """Return the counts of rows by bins, none without a row; those out of range are at the ends.

    Args:
        table: columns of a file of counts.
        at: values of the rows by column.
        axes: number of bins by column.
    """
    if table is None:
        return []
    masks = [abs(table[n] - x) < 1e-6 if n == "level" else table[n] == x for n, x in at.items()]
    rows = np.logical_and.reduce(masks)
    if not rows.any():
        return []
    places = tuple(np.clip(table[name][rows], 0, n - 1) for name, n in axes.items())
    total = np.zeros(tuple(axes.values()), dtype=np.int64)
    np.add.at(total, places, table["count"][rows])
    return total.tolist()
