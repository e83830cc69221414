"""Published figures of the structure trends, beside those of the fits.

Source: arXiv 2609.38405, structure trends.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from draft.fitting.printed import RELEASED, Figure
from draft.laws.law import Law
from draft.laws.structure import FILE as TRENDS

FILE = Path(__file__).resolve().parent / "data" / "published.csv"
_ENDS = ("low", "high")
NOT_CLASSES = ("trunk", "torso", "robots", "allometry")


@lru_cache(maxsize=1)
def _rows() -> tuple[dict[str, str], ...]:
    with FILE.open(newline="", encoding="utf-8") as file:
        return tuple(csv.DictReader(file))


def classes(population: str) -> list[str]:
    """Classes of the printed table, in its order."""
    items = [row["item"] for row in _rows() if row["population"] == population]
    return [item for item in dict.fromkeys(items) if item not in NOT_CLASSES]


def printed(population: str, item: str) -> dict[str, str]:
    """Printed figures of one item, by name."""
    return {
        row["figure"]: row["printed"]
        for row in _rows()
        if (row["population"], row["item"]) == (population, item)
    }


def figures(trends: Mapping[str, Any] | None = None) -> list[Figure]:
    """All printed figures with their fitted values; those of the shipped trends by default."""
    table = trends or json.loads(TRENDS.read_text(encoding="utf-8"))
    return [
        Figure(
            quantity=row["item"],
            name=row["figure"],
            printed=row["printed"],
            value=_value(table[row["population"]], row["item"], row["figure"]),
            note=row["why_not"],
            population=row["population"],
            released=row["source"] == RELEASED,
        )
        for row in _rows()
    ]


def _value(table: Mapping[str, Any], item: str, figure: str) -> float | None:
    if item == "allometry":
        return None
    if item == "robots":
        if figure.startswith("share_"):
            return table["actuator_share"][figure.removeprefix("share_")]
        return table["held_out"]["paper" if figure == "held_out" else figure]
    if item == "torso":
        return table["torso_range"][_ENDS.index(figure)]
    record = table["trunk"] if item == "trunk" else table["segments"].get(item)
    if record is None:
        return None
    law = Law.read(item, record)
    if figure in _ENDS:
        return law.range[_ENDS.index(figure)]
    return getattr(law, {"density": "coefficient"}.get(figure, figure))
