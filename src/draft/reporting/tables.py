"""Tables of a report as HTML; all text that is not `Html` is escaped."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from draft.design.bands import actuator_bands
from draft.design.findings import grouped
from draft.design.report import actuator_rows
from draft.design.widened import band
from draft.explore.comparison_tables import TextTable
from draft.laws.actuators import Laws
from draft.metrics import METRICS
from draft.model.picture import corners
from draft.model.scene import home
from draft.reporting.plots import part_names, parts
from draft.reporting.subjects import Subject
from draft.values import scalar

NOTHING = "–"


class Html(str):
    """Text that is HTML."""

    __slots__ = ()


Row = tuple[str, str, Sequence[str]]  # label, unit, cells


def number(value: Any, digits: int = 3) -> str:
    """Text of a number with some significant digits; an exponent only for extreme numbers."""
    if value is None or not math.isfinite(float(value)):
        return NOTHING
    value = float(value)
    if value == 0:
        return "0"
    if 1e-4 <= abs(value) < 10**digits - 0.5:
        return f"{value:#.{digits}g}".rstrip(".")
    return f"{value:.0f}" if 1 <= abs(value) < 1e7 else f"{value:.{digits - 1}e}"


def text(value: str) -> str:
    """Escape a text unless it is HTML."""
    return str(value) if isinstance(value, Html) else escape(str(value))


def table(head: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "") -> Html:
    """Return a table whose first column has the headings of the rows.

    Args:
        head: cells of the head.
        rows: cells of the rows.
        kind: CSS class: "words" aligns all columns to the left.
    """
    top = "".join(f'<th scope="col">{text(cell)}</th>' for cell in head)
    body = []
    for row in rows:
        first, *rest = (text(cell) for cell in row)
        cells = "".join(f"<td>{cell}</td>" for cell in rest)
        body.append(f'<tr><th scope="row">{first}</th>{cells}</tr>')
    found = "\n".join(body)
    return Html(
        f'<div class="scroll"><table class="{kind}"><thead><tr>{top}</tr></thead>\n'
        f"<tbody>{found}</tbody></table></div>"
    )


def plain(of: TextTable, kind: str = "") -> Html:
    """Return a table of text, with its title and note.

    Args:
        of: the table.
        kind: CSS class, as of `table`.
    """
    heads = [cell.partition("\n") for cell in of.head]
    head = [Html(escape(a) + (f"<small>{escape(b)}</small>" if b else "")) for a, _, b in heads]
    title = f"<h3>{text(of.title[:1].upper() + of.title[1:])}</h3>" if of.title else ""
    note = "".join(f"<p><small>{text(line)}</small></p>" for line in of.note.splitlines())
    return Html(f"{title}{table(head, of.rows, kind)}{note}")


def compared(subjects: Sequence[Subject], rows: Iterable[Row]) -> Html:
    """Return a table with a column per design."""
    head = ["", "unit", *(titled(subject) for subject in subjects)]
    return table(head, [(label, unit, *cells) for label, unit, cells in rows])


def titled(subject: Subject) -> Html:
    """Title of a design with a spot of its colour."""
    return Html(f'<i style="background:{subject.color}"></i>{escape(subject.title)}')


def verdict(subject: Subject) -> Html:
    """Badge with the verdict of the design filter."""
    if subject.design.accepted and not subject.design.judged:
        return Html('<span class="badge refused">not judged</span>')
    word = "accepted" if subject.design.accepted else "refused"
    return Html(f'<span class="badge {word}">{word}</span>')


def overview(subjects: Sequence[Subject]) -> Html:
    """Masses and sizes of the designs."""
    records = [subject.record for subject in subjects]
    sizes = [_size(subject) for subject in subjects]
    whole = [record["mass_by_leg_length"] or {} for record in records]
    share = [100 * record["actuator_mass_kg"] / record["mass_kg"] for record in records]
    driven = [sum(j.actuator is not None for j in s.design.joints.values()) for s in subjects]
    rows: list[Row] = [
        ("design filter", "", [verdict(subject) for subject in subjects]),
        ("mass", "kg", [number(record["mass_kg"]) for record in records]),
        (
            "90 % band of the mass",
            "kg",
            [_band(band(subject.design)) for subject in subjects],
        ),
        ("mass by leg length alone", "kg", [number(one.get("mass_kg")) for one in whole]),
        ("structure", "kg", [number(record["structure_mass_kg"]) for record in records]),
        ("actuators", "kg", [number(record["actuator_mass_kg"]) for record in records]),
        *_carried(records),
        *_origins(records),
        ("actuators' share", "%", [number(x) for x in share]),
        ("driven joints", "1", [str(count) for count in driven]),
        ("thigh and shank", "m", [number(subject.design.leg_length) for subject in subjects]),
    ]
    for k, words in enumerate(("length", "width", "height")):
        rows.append((f"{words}, home pose", "m", [number(size[k]) for size in sizes]))
    return compared(subjects, rows)


def _carried(records: Sequence[Mapping[str, Any]]) -> list[Row]:
    """Row of the carried masses, if any robot carries a part."""
    masses = [record["carried_mass_kg"] for record in records]
    return [("carried", "kg", [number(mass) for mass in masses])] if any(masses) else []


def _origins(records: Sequence[Mapping[str, Any]]) -> list[Row]:
    """Rows of the masses by origin, if any robot has parts of its own."""
    if not any(record["own_parts"] for record in records):
        return []
    each = [record["mass_by_origin_kg"] for record in records]
    return [
        (f"mass {what}", "kg", [number(one[origin]) for one in each])
        for origin, what in _ORIGINS.items()
    ]


def own_parts(subjects: Sequence[Subject]) -> Html | None:
    """Table of the parts in place of drawn solids; None without any."""
    head = ["design", "file", "in place of", "copies", *map(Html, _OF_PARTS)]
    rows: list[Sequence[str]] = []
    for subject in subjects:
        for one in subject.record["own_parts"]:
            origin = _ORIGINS.get(one["origin"], one["origin"])
            numbers = (one["mass_kg"], one["density_kg_m3"], 1e6 * one["volume_m3"])
            words = (one["file"], one["in_place_of"], str(len(one["bodies"])))
            rows.append([titled(subject), *words, *map(number, numbers), f"mass {origin}"])
    return table(head, rows, "words") if rows else None


_ORIGINS = {"stated": "stated", "trend": "predicted by laws", "catalogue": "of the catalogue"}
_OF_PARTS = (
    *("mass<small>kg</small>", "density<small>kg/m3</small>", "volume<small>cm3</small>"),
    "",
)


def _size(subject: Subject) -> Sequence[float]:
    """Length, width and height in the home pose [m]; NaN without a model."""
    if subject.model is None:
        return (math.nan,) * 3
    points = corners(subject.model.mujoco, home(subject.design, subject.model.mujoco))
    return (points.max(axis=0) - points.min(axis=0)).tolist()


def _band(ends: Sequence[float]) -> str:
    return " to ".join(number(end) for end in ends)


def parameters(subjects: Sequence[Subject]) -> tuple[Html | None, Html]:
    """Table of the parameters that differ between the designs (None for none), and of all."""
    rows: dict[str, Row] = {}
    differ: list[Row] = []
    for subject in subjects:
        for name, one in subject.record["parameters"].items():
            if name in rows:
                continue
            found = [s.record["parameters"].get(name, {}).get("value") for s in subjects]
            label = Html(f"{escape(name)}<small>{escape(one['doc'])}</small>")
            rows[name] = (label, one["unit"], [_stated(value) for value in found])
            if None not in found and len(set(found)) > 1:
                differ.append(rows[name])
    return (compared(subjects, differ) if differ else None), compared(subjects, rows.values())


def _stated(value: float | None) -> str:
    """Text of the value of a parameter."""
    return NOTHING if value is None else f"{value:.5g}"


def masses(subjects: Sequence[Subject]) -> Html:
    """Table of the mass of each part, with its share."""
    tables = [parts(subject) for subject in subjects]
    names = part_names(tables)
    totals = [sum(each.values()) for each in tables]

    def cell(mass: float | None, total: float) -> str:
        if mass is None:
            return NOTHING
        return Html(f"{number(mass)} <small>{100 * mass / total:.0f} %</small>")

    rows: list[Row] = [
        (name, "kg", [cell(each.get(name), t) for each, t in zip(tables, totals, strict=True)])
        for name in names
    ]
    return compared(subjects, [*rows, ("total", "kg", [number(total) for total in totals])])


def actuators(subjects: Sequence[Subject]) -> Html:
    """Table of all actuator classes, with bands of the numbers that depend on a trend."""
    columns = actuator_rows(a for one in subjects for a in one.design.actuators.values())
    heads = (Html(f"{one.label}<small>{one.table_unit}</small>") for one in columns.values())
    head = ["design, class", "joints", *heads]
    rows: list[Sequence[str]] = []
    for subject in subjects:
        for name, a in subject.design.actuators.items():
            count = sum(joint.actuator == name for joint in subject.design.joints.values())
            bands = actuator_bands(a)
            cells: list[str] = []
            for quantity, one in columns.items():
                cell = number(scalar(getattr(a, quantity)) * one.factor)
                if quantity in bands:
                    ends = " to ".join(number(scalar(x) * one.factor) for x in bands[quantity])
                    cell = Html(f"{cell}<small>{ends}</small>")
                cells.append(cell)
            like = f"<small>like {escape(a.like)}</small>" if a.like else ""
            rows.append((Html(f"{titled(subject)}, {escape(name)}{like}"), str(count), *cells))
    return table(head, rows)


def findings(subjects: Sequence[Subject]) -> Html:
    """Table of findings, errors first, with the limit and its source."""
    rows: list[Sequence[str]] = []
    for subject in subjects:
        for finding in grouped(subject.design.findings):
            unit = "" if finding.unit in ("", "1") else f" {finding.unit}"
            pair = [
                NOTHING if value is None else f"{number(value)}{unit}"
                for value in (finding.value, finding.limit)
            ]
            badge = Html(f'<span class="badge {finding.severity}">{finding.severity}</span>')
            reason = finding.message
            if finding.allowed:
                reason = f"{reason} (allowed by '{finding.allowed}')"
            remedy = f"<small>{escape(finding.remedy)}</small>" if finding.remedy else ""
            text = Html(f"{escape(reason)}{remedy}")
            kind = finding.id.replace("_", " ")
            rows.append((titled(subject), badge, kind, text, *pair, finding.source))
    if not rows:
        return Html("<p>None.</p>")
    head = ["design", "", "kind", "finding", "value", "limit", "source of the limit"]
    return table(head, rows, "words")


def metrics(subjects: Sequence[Subject]) -> Html | None:
    """Table of the metrics, with the best value in bold; None if none is known."""
    rows: list[Row] = []
    for name, metric in METRICS.items():
        found = [subject.metrics.get(name, math.nan) for subject in subjects]
        known = [value for value in found if math.isfinite(value)]
        if not known:
            continue
        best = {"less": min(known), "more": max(known)}.get(metric.better)
        cells = [_metric(v, metric.unit, v == best and len(set(known)) > 1) for v in found]
        tip = f"{escape(metric.doc)} {escape(metric.formula)}. {escape(metric.source)}"
        unit = "" if metric.unit == "bool" else metric.unit
        label = Html(f"{escape(name.replace('_', ' '))}<small>{tip}</small>")
        rows.append((label, unit, cells))
    return compared(subjects, rows) if rows else None


def _metric(value: float, unit: str, best: bool) -> str:
    words = number(value)
    if unit == "bool" and math.isfinite(value):
        words = "yes" if value else "no"
    return Html(f"<b>{words}</b>") if best else words


def laws(subjects: Sequence[Subject]) -> Html:
    """Table of the actuator laws, with their errors on held-out vendors."""
    rows: list[Sequence[str]] = []
    sets: dict[str, Laws] = {}
    for subject in subjects:
        for actuator in subject.design.actuators.values():
            sets.setdefault(actuator.laws.name, actuator.laws)
    for name, found in sets.items():
        for quantity, trend in found.trends.items():
            if trend.terms:
                label = quantity.replace("_", " ")
                error = f"{trend.held_out['vendor']:.2f} x" if trend.held_out else ""
                rows.append((label, name, trend.formula, str(trend.n), error, trend.source))
    head = ["quantity", "laws", "law", "modules", "error on held-out vendors", "source"]
    return table(head, rows, "words")
