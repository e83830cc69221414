"""`draft doctor`: describe the installation and the machine in a table for an issue."""

from __future__ import annotations

import json as json_
from typing import Annotated, Any

import tyro

from draft.cli.options import JsonOutput
from draft.cli.spelling import spelt
from draft.doctor import Row, examine


def main(
    torch: Annotated[
        bool, tyro.conf.arg(help="Import PyTorch to ask it for GPUs, which takes seconds.")
    ] = False,
    json: JsonOutput = False,
) -> int:
    """Describe the installation and the machine in a table for an issue."""
    rows = examine(torch)
    print(_json(rows) if json else _table(rows))
    return 0


def _json(rows: list[Row]) -> str:
    table: dict[str, Any] = {}
    for row in rows:
        group, _, name = row.item.partition(" ")
        value = row.text if row.record is None else row.record
        if name:
            table.setdefault(f"{group}s", {})[name] = value
        elif group:
            table[group] = value
    return json_.dumps(table, indent=2)


def _table(rows: list[Row]) -> str:
    """Return a table in Markdown whose columns line up in a terminal too."""
    cells = [(row.item, " ".join(spelt(row.text).split()).replace("|", "\\|")) for row in rows]
    width = max(len(item) for item, _ in cells)
    lines = [f"| {item:<{width}} | {text} |" for item, text in (("item", "found"), *cells)]
    return "\n".join([lines[0], f"|{'-' * (width + 2)}|---|", *lines[1:]])
