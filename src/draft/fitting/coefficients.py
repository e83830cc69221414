"""Coefficient files: laws and scores as JSON with ten digits, written atomically."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from draft import files


def rounded(table: Mapping[str, object]) -> dict[str, object]:
    """Round the numbers of plain data to ten digits; the last bits differ between libraries."""
    return {key: _rounded(item) for key, item in table.items()}


def _rounded(value: object) -> object:
    if isinstance(value, float):
        return float(f"{value:.10g}")
    if isinstance(value, Mapping):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(item) for item in value]
    return value


def write(path: Path, table: Mapping[str, object]) -> None:
    """Write a coefficient file; errors as `draft.files.write`."""
    files.write(path, json.dumps(table, indent=1) + "\n")
