"""Coefficient files: laws and scores as JSON, to ten digits, whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from draft import files


def rounded(value: Any) -> Any:
    """Plain data to ten digits, so that a file does not depend on the last bit of a library."""
    if isinstance(value, float):
        return float(f"{value:.10g}")
    if isinstance(value, Mapping):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(item) for item in value]
    return value


def write(path: Path, table: Mapping[str, Any]) -> None:
    """Write a coefficient file; errors as `draft.files.write`."""
    files.write(path, json.dumps(table, indent=1) + "\n")
