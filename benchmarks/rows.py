"""Rows of a benchmark's table: measured, held against a bar, printed and written as JSON."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
from rich.console import Console
from rich.table import Table

RESULTS = Path(__file__).parent / "results"


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds that some work takes, and what it gives."""
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result


def measured(
    what: str, value: float, unit: str, bar: float | None = None, at_least: bool = False
) -> dict[str, Any]:
    """A row of the table, held against its bar."""
    met = None if bar is None else (value >= bar if at_least else value <= bar)
    return {"what": what, "value": value, "unit": unit, "bar": bar, "met": met}


def publish(name: str, rows: list[dict[str, Any]], **machine: str) -> None:
    """Print the table and write it as `benchmarks/results/NAME.json`.

    Args:
        name: of the benchmark.
        rows: of the table.
        machine: what else to say of what it ran on.
    """
    versions = {"mujoco": mujoco.__version__, "python": platform.python_version()} | machine
    table = Table(box=None, title=", ".join(f"{k} {v}" for k, v in versions.items()))
    for heading in ("what", "measured", "bar", ""):
        table.add_column(heading, justify="left" if heading in ("what", "") else "right")
    for row in rows:
        word = {True: "met", False: "missed", None: ""}[row["met"]]
        value, bar = (
            f"{row[key]:.4g} {row['unit']}" if row[key] is not None else ""
            for key in ("value", "bar")
        )
        table.add_row(row["what"], value, bar, word)
    Console().print(table)
    RESULTS.mkdir(exist_ok=True)
    document = {"machine": versions | {"cores": os.cpu_count()}, "rows": rows}
    (RESULTS / f"{name}.json").write_text(json.dumps(document, indent=1) + "\n")
