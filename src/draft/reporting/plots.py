"""Plots of a report as Plotly figures in plain data: traces and layout."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from itertools import cycle
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from draft.design.bands import actuator_bands
from draft.design.report import carried_parts, used_actuators
from draft.fitting.actuators.catalogue_figures import (
    FAMILIES,
    OTHER,
    RELATIONS,
    curve,
)
from draft.fitting.actuators.catalogue_rows import Rows, rows_of
from draft.laws.actuators import Laws
from draft.laws.catalogue import catalogue
from draft.laws.quantities import QUANTITIES
from draft.reporting.subjects import Subject
from draft.reporting.torque_speed import Curve
from draft.values import scalar

INK, RULE = "#24292f", "#e4e8ec"
CATALOGUE = "#9aa4af"  # colour of the modules, different from those of the designs
PALETTE = ("#33608f", "#7fa3c7", "#b9c9da", "#c98d4f", "#e5c49a", "#6f9d80", "#b5d0bd", "#8d7aa5")
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross", "star")
Figure = dict[str, Any]  # traces and layout, as Plotly's JSON
# Dashes in SVG, and in matplotlib.
DASHES = {"none": "-", "8 4": "--", "2 3": ":", "8 3 2 3": "-."}
_MARKS = {"o": "circle", "s": "square", "^": "triangle-up", "D": "diamond"}


def _layout(height: int, **more: Any) -> dict[str, Any]:
    font = {"family": "system-ui, sans-serif", "size": 12, "color": INK}
    base = {
        "height": height,
        "font": font,
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "margin": {"l": 64, "r": 16, "t": 8, "b": 48},
        "hoverlabel": {"bgcolor": "white"},
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
    }
    return base | more


def _axis(title: str, **more: Any) -> dict[str, Any]:
    line = {"gridcolor": RULE, "linecolor": "#8c959f", "zerolinecolor": RULE, "ticks": "outside"}
    return line | {"title": {"text": title, "standoff": 8}, "automargin": True} | more


def parts(subject: Subject) -> dict[str, float]:
    """Masses [kg] by part: actuators, trunk, segments, carried parts; those above zero."""
    design = subject.design
    found: dict[str, float] = {}
    for name, actuator in design.actuators.items():
        count = sum(body.actuator is actuator for body in design.bodies)
        found[f"actuators, {name}"] = scalar(actuator.mass * count)
    found["trunk" if design.floating else "base"] = scalar(design.base_mass)
    for segment in design.segments:
        label = f"structure, {segment.label.replace('_', ' ')}"
        found[label] = found.get(label, 0.0) + scalar(segment.mass * segment.copies)
    for name, bodies in carried_parts(design).items():
        found[f"carried, {name}"] = sum(scalar(body.end_mass) for body in bodies)
    return {label: mass for label, mass in found.items() if mass > 0}


def part_names(tables: Sequence[Mapping[str, float]]) -> list[str]:
    """Names of all parts: actuators, trunk or base, structure, carried parts."""
    names = dict.fromkeys(name for table in tables for name in table)
    order = ("actuators", "trunk", "base", "structure", "carried")
    return sorted(names, key=lambda name: order.index(name.split(",")[0]))


def masses(subjects: Sequence[Subject]) -> Figure:
    """Plot of the masses [kg]: one stacked bar per design."""
    tables = [parts(subject) for subject in subjects]
    names = part_names(tables)
    titles = [escape(subject.title) for subject in subjects]
    traces = [
        {
            "type": "bar",
            "orientation": "h",
            "name": escape(name),
            "y": titles,
            "x": [table.get(name, 0.0) for table in tables],
            "marker": {"color": PALETTE[i % len(PALETTE)], "line": {"color": "#fff", "width": 1}},
            "hovertemplate": "%{y}: %{x:.3g} kg<extra>%{fullData.name}</extra>",
        }
        for i, name in enumerate(names)
    ]
    height = 120 + 44 * len(subjects) + 18 * math.ceil(len(names) / 6)
    yaxis = _axis("", autorange="reversed", ticks="")
    axes = {"xaxis": _axis("mass [kg]"), "yaxis": yaxis}
    legend = {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom", "traceorder": "normal"}
    return {
        "data": traces,
        "layout": _layout(height, barmode="stack", bargap=0.35, legend=legend, **axes),
    }


def trends(subjects: Sequence[Subject]) -> Figure:
    """Plot of actuator classes over the catalogue, with laws and bands, in four panels."""
    rows = rows_of(catalogue().values())
    traces: list[dict[str, Any]] = []
    layout = _layout(720, grid={"rows": 2, "columns": 2, "pattern": "independent", "ygap": 0.22})
    for i, (y, x) in enumerate(RELATIONS):
        number = "" if i == 0 else str(i + 1)
        panel = {"xaxis": f"x{number}", "yaxis": f"y{number}", "showlegend": i == 0}
        drawn = [*_cloud(rows, x, y), *_law(rows, subjects, x, y), *_classes(subjects, x, y)]
        traces += [panel | trace for trace in drawn]
        for letter, quantity in (("x", x), ("y", y)):
            ends = [value for trace in drawn for value in trace[letter]]
            layout[f"{letter}axis{number}"] = _axis(QUANTITIES[quantity].axis, **_log(ends))
    layout["margin"] = {"l": 64, "r": 16, "t": 8, "b": 48}
    return {"data": traces, "layout": layout}


def _log(values: Sequence[float]) -> dict[str, Any]:
    """Logarithmic axis with plain numbers: 0.1, 1, 20, 1000."""
    low, high = math.log10(min(values)), math.log10(max(values))
    steps = (1, 2, 5) if high - low < 2.4 else (1,)
    powers = range(math.floor(low), math.ceil(high) + 1)
    ticks = [step * 10.0**power for power in powers for step in steps]
    words = [f"{tick:g}" for tick in ticks]
    return {"type": "log", "tickmode": "array", "tickvals": ticks, "ticktext": words}


def _cloud(rows: Rows, x: str, y: str) -> list[dict[str, Any]]:
    """Modules of the catalogue, with a symbol per family."""
    found = []
    families = np.array(rows.family)
    known = rows.geared & rows.has(x, y)
    for family in (*FAMILIES, *sorted({*rows.family} - {*FAMILIES})):
        _, mark, words = FAMILIES.get(family, OTHER)
        at = known & (families == family)
        found.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": f"catalogue, {words if family in FAMILIES else escape(family)}",
                "legendgroup": family,
                "x": _scaled(np.exp(rows.log[x][at]), x),
                "y": _scaled(np.exp(rows.log[y][at]), y),
                "text": [escape(name) for name, kept in zip(rows.name, at, strict=True) if kept],
                "hovertemplate": "%{text}: %{x:.3g}, %{y:.3g}<extra></extra>",
                "marker": {"color": CATALOGUE, "symbol": _MARKS[mark], "size": 5},
            }
        )
    return found


def _law(rows: Rows, subjects: Sequence[Subject], x: str, y: str) -> list[dict[str, Any]]:
    """Law of the first actuator class, with its 90 % band."""
    at, middle, fold = curve(rows, laws_of(subjects), x, y)
    line = {"type": "scatter", "mode": "lines", "hoverinfo": "skip", "x": _scaled(at, x)}
    none = {"width": 0, "color": "rgba(0,0,0,0)"}
    shade = {"fill": "tonexty", "fillcolor": "rgba(36,41,47,0.08)"}
    return [
        line | {"y": _scaled(middle / fold, y), "line": none, "showlegend": False},
        line | {"y": _scaled(middle * fold, y), "line": none, "name": "90 % band"} | shade,
        line | {"y": _scaled(middle, y), "line": {"color": INK, "width": 1.2}, "name": "law"},
    ]


def _classes(subjects: Sequence[Subject], x: str, y: str) -> list[dict[str, Any]]:
    """Actuator classes of the designs, with their bands."""
    found = []
    for subject in subjects:
        for k, actuator in enumerate(used_actuators(subject.design)):
            value = scalar(getattr(actuator, y)) * QUANTITIES[y].factor
            band = actuator_bands(actuator).get(y)
            low, high = (scalar(end) * QUANTITIES[y].factor for end in band or (0.0, 0.0))
            bars = {"array": [high - value], "arrayminus": [value - low], "color": subject.color}
            symbol = SYMBOLS[k % len(SYMBOLS)]
            found.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": escape(f"{subject.title}, {actuator.name}"),
                    "legendgroup": escape(f"{subject.title}, {actuator.name}"),
                    "x": _scaled([scalar(getattr(actuator, x))], x),
                    "y": [value],
                    "error_y": {"type": "data", "symmetric": False, "visible": band is not None}
                    | {"thickness": 1.4, "width": 5, **bars},
                    "hovertemplate": "%{x:.3g}, %{y:.3g}<extra>%{fullData.name}</extra>",
                    "marker": {"color": subject.color, "symbol": symbol, "size": 11}
                    | {"line": {"color": "#fff", "width": 1}},
                }
            )
    return found


def laws_of(subjects: Sequence[Subject]) -> Laws:
    """Laws that size the first actuator class."""
    return next(a.laws for subject in subjects for a in subject.design.actuators.values())


def curves(subjects: Sequence[Subject]) -> list[Curve]:
    """Torque-speed line of each actuator class."""
    return [
        Curve(f"{subject.title}, {actuator.name}", actuator, subject.color, dashes)
        for subject in subjects
        for actuator, dashes in zip(used_actuators(subject.design), cycle(DASHES), strict=False)
    ]


def _scaled(values: ArrayLike, quantity: str) -> list[float]:
    """Convert values to the unit of their axis, with six digits."""
    return [float(f"{v:.6g}") for v in np.asarray(values) * QUANTITIES[quantity].factor]
