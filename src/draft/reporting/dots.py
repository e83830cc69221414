"""Dot plot of several designs: a row with its own scale per quantity, a numbered dot per design."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import NamedTuple

from draft.metrics import METRICS
from draft.reporting.subjects import Subject
from draft.reporting.tables import Html, number

# Width of a dot as a share of the scale, on the narrowest screens; closer dots are stacked.
DOT = 0.09
_HEIGHT = 22  # of a dot and of a row with one lane of them [px]
_DIRECTIONS = {"more": "higher is better", "less": "lower is better", "": ""}


class Row(NamedTuple):
    """One quantity of all designs.

    Attributes:
        name: name of the quantity.
        unit: SI unit; "1" for none.
        better: direction that is better, "more" or "less"; "" for neither.
        values: value of each design; NaN where it has none.
    """

    name: str
    unit: str
    better: str
    values: Sequence[float]

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value: the ends of the scale."""
        known = [value for value in self.values if math.isfinite(value)]
        return min(known), max(known)

    @property
    def about(self) -> str:
        """Unit and direction as a text, such as "kg, lower is better"."""
        unit = "" if self.unit == "1" else self.unit
        return ", ".join(words for words in (unit, _DIRECTIONS[self.better]) if words)


class Dot(NamedTuple):
    """Place of a design in a row: its number, its share of the scale, and its lane from below."""

    design: int
    share: float
    lane: int


def metrics(subjects: Sequence[Subject]) -> list[Row]:
    """Rows of the metrics whose values differ between the designs."""
    rows = [
        Row(
            name.replace("_", " "),
            metric.unit,
            metric.better,
            [subject.metrics.get(name, math.nan) for subject in subjects],
        )
        for name, metric in METRICS.items()
        if metric.unit != "bool"
    ]
    return [row for row in rows if _differs(row)]


def parameters(subjects: Sequence[Subject]) -> list[Row]:
    """Rows of the parameters whose values differ between the designs."""
    records = [subject.record["parameters"] for subject in subjects]
    units = {name: one["unit"] for record in records for name, one in record.items()}
    rows = [
        Row(name, unit, "", [_value(record.get(name)) for record in records])
        for name, unit in units.items()
    ]
    return [row for row in rows if _differs(row)]


def places(row: Row, width: float = DOT) -> list[Dot]:
    """Dots of a row, from the smallest value on; dots that would overlap are in other lanes.

    Args:
        row: the quantity.
        width: width of a dot as a share of the scale.
    """
    low, high = row.ends
    found: list[Dot] = []
    last: list[float] = []  # share of the last dot of each lane
    known = [k for k, value in enumerate(row.values) if math.isfinite(value)]
    for k in sorted(known, key=lambda k: row.values[k]):
        share = (row.values[k] - low) / (high - low)
        lane = next((i for i, at in enumerate(last) if share - at >= width), len(last))
        last[lane : lane + 1] = [share]
        found.append(Dot(k + 1, share, lane))
    return found


def ink(color: str) -> str:
    """Colour of a number that is readable on a dot of this colour, "#rrggbb"."""
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return "#ffffff" if 0.299 * red + 0.587 * green + 0.114 * blue < 140 else "#14181c"


def plot(subjects: Sequence[Subject], rows: Sequence[Row]) -> Html:
    """Dot plot as HTML, with a key of the designs."""
    key = "".join(
        f"<li>{_dot(subject, k + 1)}{escape(subject.title)}</li>"
        for k, subject in enumerate(subjects)
    )
    return Html(
        f'<div class="dots"><ol>{key}</ol>{"".join(_row(subjects, row) for row in rows)}</div>'
    )


def _row(subjects: Sequence[Subject], row: Row) -> str:
    dots = places(row)
    height = _HEIGHT * (1 + max(dot.lane for dot in dots))
    drawn = []
    for number_, share, lane in dots:
        subject, value = subjects[number_ - 1], row.values[number_ - 1]
        unit = "" if row.unit == "1" else f" {row.unit}"
        place = f"left:{100 * share:.2f}%;bottom:{_HEIGHT * lane + 2}px"
        drawn.append(_dot(subject, number_, place, f"{subject.title}: {number(value)}{unit}"))
    low, high = (f"<span>{number(end)}</span>" for end in row.ends)
    if row.better == "less":
        low = f"<b>{low}</b>"
    if row.better == "more":
        high = f"<b>{high}</b>"
    lacking = [s.title for s, v in zip(subjects, row.values, strict=True) if not math.isfinite(v)]
    lack = f"no value: {', '.join(lacking)}" if lacking else ""
    small = "".join(f"<small>{escape(words)}</small>" for words in (row.about, lack) if words)
    return (
        f'<div class="row"><p>{escape(row.name)}{small}</p>{low}'
        f'<div style="height:{height}px">{"".join(drawn)}</div>{high}</div>'
    )


def _dot(subject: Subject, design: int, place: str = "", tip: str = "") -> str:
    style = f"background:{subject.color};color:{ink(subject.color)};{place}"
    title = f' title="{escape(tip, quote=True)}"' if tip else ""
    return f'<i style="{style}"{title}>{design}</i>'


def _value(parameter: dict[str, object] | None) -> float:
    value = parameter["value"] if parameter is not None else None
    return float(value) if isinstance(value, (int, float)) else math.nan


def _differs(row: Row) -> bool:
    """Whether designs have values of a row that differ as written."""
    known = {number(value) for value in row.values if math.isfinite(value)}
    return len(known) > 1
