"""Figures of capability over a family's parameters, with designs trained alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from draft.plotting import BLUE, COLUMN, ORANGE
from draft.study.report.family import (
    LEAST,
    SHOWN,
    Check,
    Family,
    axis_words,
    checks,
    figure_name,
    triangles,
)
from draft.study.report.labels import MAP, halo
from draft.study.report.records import Study, seeds_in_words
from draft.study.report.spread import SCALARS
from draft.study.report.table import Cell, Column, Table
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def makers(study: Study, found: list[Family]) -> dict[str, Callable[[], Figure]]:
    """Return a maker of a figure for each family and scalar that its members have, by name."""
    return {
        figure_name(i, len(found), scalar): partial(_figure, study, family, scalar)
        for i, family in enumerate(found)
        for scalar in SHOWN
        if len(family.scalars[scalar]) >= 2 and family.axes(scalar)
    }


def tables(study: Study, found: list[Family]) -> dict[str, Table]:
    """Return tables that compare designs trained alone with the families, by name."""
    tables = {}
    for i, family in enumerate(found):
        rows: list[list[Cell]] = []
        notes: dict[str, None] = {}
        for scalar in SHOWN:
            compared, omitted = (
                checks(study, family, scalar) if family.scalars[scalar] else ([], [])
            )
            notes |= dict.fromkeys(omitted)
            rows += [_row(family, scalar, one) for one in compared]
        if rows or notes:
            name = figure_name(i, len(found), "check")
            caption = (
                "Designs that were trained alone against what lies between the members of the "
                "family at their parameters."
            )
            columns = [Column("design"), Column("parameters"), Column("scalar")]
            columns += [Column("trained alone", "", 3), Column("family", "", 3)]
            columns += [Column("family − alone", "%", 1)]
            tables[name] = Table(name, caption, columns, rows, list(notes))
    return tables


def _row(family: Family, scalar: str, one: Check) -> list[Cell]:
    axes = family.axes(scalar)
    pairs = zip(axes, one.at, strict=True)
    at = ", ".join(f"{axis_words(n).partition(' [')[0]} {v:g}" for n, v in pairs)
    words, unit = SCALARS[scalar]
    named = words if unit == "1" else f"{words} [{unit}]"
    if one.interpolated is None:
        return [one.title, at, named, one.own, "outside of the members", None]
    off = 100 * (one.interpolated / one.own - 1) if one.own else "alone is 0"
    return [one.title, at, named, one.own, one.interpolated, off]


def caption(family: Family, scalar: str) -> str:
    """Return the caption of a figure."""
    axes = family.axes(scalar)
    count = len(family.scalars[scalar])
    others = [name for name in family.varied if name not in axes]
    words = f"{count} members of the family, {seeds_in_words(family.seeds)}"
    words += "; linear between members" if len(axes) == 2 else ""
    if others:
        listed = ", ".join(axis_words(name).partition(" [")[0] for name in others[:4])
        more = f" and {len(others) - 4} more" if len(others) > 4 else ""
        words += f"; they differ in {listed}{more} too"
    return f"{words}. Diamonds: designs trained alone, with their own value."


def _figure(study: Study, family: Family, scalar: str) -> Figure:
    from matplotlib import pyplot as plt

    figure, ax = plt.subplots(figsize=(COLUMN, 0.8 * COLUMN))
    axes = family.axes(scalar)
    points, values = family.points(scalar, axes)
    compared, _ = checks(study, family, scalar)
    words, unit = SCALARS[scalar]
    label = f"{words} [{unit}]"
    if len(axes) == 2 and len(values) >= LEAST:
        _surface(ax, points, values, label, compared)
        ax.set_ylabel(axis_words(axes[1]))
    else:
        _line(ax, points[:, 0], values, label, compared)
    ax.set_xlabel(axis_words(axes[0]))
    ax.set_title(f"Family: {words}", loc="left", fontweight="bold")
    return figure


def _surface(ax: Axes, points: Array, values: Array, label: str, compared: list[Check]) -> None:
    own = [one.own for one in compared]
    low, high = min(*values, *own, *values), max(*values, *own, *values)
    high = high if high > low else low + 1e-9
    levels = np.linspace(low, high, 11)
    between = triangles(points)
    shades = ax.tricontourf(between, values, levels=levels, cmap=MAP, alpha=0.9)
    ax.tricontour(between, values, levels=levels[1:-1], colors="white", linewidths=0.4)
    common = {"cmap": MAP, "vmin": low, "vmax": high}
    ax.scatter(
        *points.T,
        c=values,
        s=14,
        edgecolors="white",
        linewidths=0.6,
        clip_on=False,
        zorder=3,
        **common,
    )
    for one in compared:
        ax.scatter(
            *one.at,
            c=[one.own],
            s=62,
            marker="D",
            edgecolors=ORANGE,
            linewidths=1.4,
            zorder=4,
            **common,
        )
        ax.annotate(
            f"{one.title} {one.own:.3g}",
            (one.at[0], one.at[1]),
            xytext=(7, 0),
            textcoords="offset points",
            va="center",
            path_effects=halo(),
        )
    bar = ax.figure.colorbar(shades, ax=ax, pad=0.02, aspect=30)
    bar.set_label(label)
    bar.ax.set_yticks([levels[0], levels[5], levels[10]])
    bar.ax.yaxis.set_major_formatter(lambda value, _: f"{value:.3g}")
    bar.outline.set_visible(False)


def _line(ax: Axes, x: Array, values: Array, label: str, compared: list[Check]) -> None:
    order = np.argsort(x)
    ax.plot(x[order], values[order], "o-", color=BLUE, markersize=3)
    for one in compared:
        ax.plot(one.at[0], one.own, "D", color=ORANGE, markersize=6, markerfacecolor="none")
        ax.annotate(
            f"{one.title} {one.own:.3g}",
            (one.at[0], one.own),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
            path_effects=halo(),
        )
    ax.set_ylabel(label)
