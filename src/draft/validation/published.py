"""Published capabilities of real robots, as their makers state and papers measured them.

`published.csv` has a row for each figure that was read in a text: robot (its key in the survey),
quantity, value or range, bound, condition, confidence (A a measurement in a paper or a certified
record, B the maker's data, C a secondary text), source and note.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

FILE = Path(__file__).resolve().parent / "published.csv"
Bound = Literal["", "least", "most"]


@dataclass(frozen=True)
class Figure:
    """A published figure.

    Attributes:
        robot: key of the robot.
        name: the robot as the source calls it.
        quantity: what is stated, such as "top_speed".
        low, high: the value, or the ends of a range; units by `UNITS`.
        bound: "least" or "most" if it is a bound.
        condition: the kind of figure, or what the robot did.
        confidence: "A", "B" or "C".
        source, note: where it was read, and doubts.
    """

    robot: str
    name: str
    quantity: str
    low: float
    high: float
    bound: Bound
    condition: str
    confidence: str
    source: str
    note: str


UNITS = {
    "top_speed": "m/s",
    "step": "m",
    "stairs": "m",
    "payload": "kg",
    "payload_standing": "kg",
    "jump_height": "m",
    "endurance": "h",
    "range": "km",
    "battery_energy": "Wh",
    "walking_power": "W",
}


@cache
def figures() -> tuple[Figure, ...]:
    """All published figures."""
    with FILE.open(newline="", encoding="utf-8") as file:
        return tuple(_figure(row) for row in csv.DictReader(file))


def of_robot(key: str, quantity: str | None = None) -> tuple[Figure, ...]:
    """Published figures of a robot.

    Args:
        key: key of the robot in the survey, such as "unitree_go2".
        quantity: one of `UNITS`; None for all.
    """
    return tuple(one for one in figures() if one.robot == key and quantity in (None, one.quantity))


def best(found: Sequence[Figure]) -> Figure | None:
    """The figure with the greatest value, the better sourced of equal ones; None for none."""
    return max(found, key=lambda one: (one.high, -ord(one.confidence)), default=None)


def _figure(row: dict[str, str]) -> Figure:
    bound: Bound = "least" if row["bound"] == "least" else "most" if row["bound"] else ""
    return Figure(**{**row, "low": float(row["low"]), "high": float(row["high"]), "bound": bound})
