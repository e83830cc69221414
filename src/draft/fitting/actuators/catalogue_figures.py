"""Figures of the actuator laws, each as PNG and PDF.

A figure is a function that takes the modules and returns a matplotlib figure; `FIGURES` lists
them. Those of structure are in `draft.fitting.structure.survey_figures`.
"""

# pyright: reportMissingImports=false, reportMissingModuleSource=false
from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from draft.fitting.actuators import catalogue_holdout as holdout
from draft.fitting.actuators.catalogue_rows import Rows, rows_of
from draft.fitting.actuators.recipes import SETS as RECIPES
from draft.fitting.scores import fold_error
from draft.laws.actuators import Laws, laws
from draft.laws.catalogue import Part
from draft.laws.quantities import QUANTITIES
from draft.plotting import BLUE, COLUMN, GREEN, GREY, ORANGE, decorate, save
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Colour, marker and label of each family.
FAMILIES = {
    "QDD": (BLUE, "o", "quasi-direct drive"),
    "MidGear": (ORANGE, "s", "medium reduction"),
    "HighGR": (GREEN, "^", "high reduction"),
}
OTHER = (GREY, "D", "other")
# Quantities on the y and x axis of each panel.
RELATIONS = (
    ("mass", "peak_torque"),
    ("volume", "peak_torque"),
    ("rotor_inertia", "radius"),
    ("gear_ratio", "no_load_speed"),
)
SCORED = ("mass", "volume", "radius", "length", "gear_ratio", "rotor_inertia")


def draw(folder: Path, parts: Sequence[Part]) -> list[Path]:
    """Draw every figure and write it as PNG and PDF.

    Returns:
        The files written.

    Raises:
        DraftError: the extra is not installed, or the folder cannot be written.
    """
    rows = rows_of(parts)
    return save(folder, {name: partial(make, rows) for name, make in FIGURES.items()})


def relations(rows: Rows) -> Figure:
    """Figure of four relations: the modules, the laws of both sets, and the band of Draft's."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(COLUMN, 0.98 * COLUMN))
    for ax, (y, x) in zip(axes.flat, RELATIONS, strict=True):
        cloud(ax, rows, x, y)
        _law(ax, rows, x, y)
        decorate(ax, QUANTITIES[x].axis, QUANTITIES[y].axis)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def predicted(rows: Rows) -> Figure:
    """Figure of predicted against published quantities of modules of held-out vendors."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(COLUMN, 1.07 * COLUMN))
    held_out = {
        name: holdout.held_out(recipes, rows, rows.vendor, mass_from_all=True)
        for name, recipes in RECIPES.items()
    }
    quantities = ("mass", "volume", "rotor_inertia", "gear_ratio")
    for ax, quantity in zip(axes.flat, quantities, strict=True):
        _versus(ax, rows, quantity, {name: logs[quantity] for name, logs in held_out.items()})
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _versus(ax: Axes, rows: Rows, quantity: str, held_out: dict[str, Array]) -> None:
    """Draw one panel of predicted against published."""
    factor = QUANTITIES[quantity].factor
    known = rows.geared & rows.has(quantity)
    published, ours = np.exp(rows.log[quantity]) * factor, np.exp(held_out["draft"]) * factor
    _points(ax, rows, published, ours)
    both = np.concatenate([published[known], ours[known]])
    ends = np.array([both.min() / 1.2, both.max() * 1.2])
    fold = laws().trends[quantity].band(0.9)
    ax.plot(ends, ends, color="black", linewidth=0.6)
    ax.fill_between(ends, ends / fold, ends * fold, color="black", alpha=0.08, linewidth=0)
    scores = [
        f"{name} {fold_error((rows.log[quantity] - logs)[known]):.2f}"
        for name, logs in held_out.items()
    ]
    text = "\n".join(["mean fold error", *scores])
    ax.text(0.04, 0.97, text, transform=ax.transAxes, va="top", fontsize=7)
    decorate(ax, f"published {QUANTITIES[quantity].axis}", f"predicted {QUANTITIES[quantity].axis}")
    ax.set_xlim(*ends)
    ax.set_ylim(*ends)


def held_out_errors(axes: Sequence[Axes], rows: Rows) -> None:
    """Draw mean fold errors, rows, vendors and families held out, one panel each."""
    groups = {"row": range(len(rows.name)), "vendor": rows.vendor, "family": rows.family}
    names = [quantity.replace("_", " ") for quantity in SCORED]
    for ax, (held_out, labels) in zip(axes, groups.items(), strict=True):
        scores = {}
        for name, recipes in RECIPES.items():
            logs = holdout.held_out(recipes, rows, labels, mass_from_all=held_out == "vendor")
            errors = holdout.errors(rows, logs)
            scores[name] = [fold_error(errors[quantity]) for quantity in SCORED]
        dumbbells(ax, names, scores["paper"], scores["draft"])
        ax.set_title(f"actuators: {held_out} held out")


def dumbbells(
    ax: Axes, names: Sequence[str], paper: Sequence[float], draft: Sequence[float]
) -> None:
    """Draw two mean fold errors of each quantity on one line, the first quantity on top."""
    from matplotlib.ticker import MaxNLocator

    places = np.arange(len(names))[::-1]
    ax.hlines(places, draft, paper, color="0.75", linewidth=1.2)
    hollow = {"markerfacecolor": "none", "markeredgewidth": 0.7}
    ax.plot(paper, places, "D", color=GREY, markersize=3.8, label="published", **hollow)
    ax.plot(draft, places, "o", color=BLUE, markersize=3.4, label="Draft's")
    ax.set_yticks(places, names)
    ax.set_ylim(-0.5, len(names) - 0.5)
    ax.set_xlim(1.0, 1.06 * max(*draft, *paper))
    ax.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5]))
    ax.grid(axis="x", color="0.9", linewidth=0.6)
    ax.set_axisbelow(True)


# To add a figure, write a function and list it here.
FIGURES: dict[str, Callable[[Rows], Figure]] = {
    "actuator_relations": relations,
    "actuator_predicted": predicted,
}


def cloud(ax: Axes, rows: Rows, x: str, y: str, color: str | None = None) -> None:
    """Draw the modules, with a marker for each family, and its colour or the given one."""
    across, up = (np.exp(rows.log[name]) * QUANTITIES[name].factor for name in (x, y))
    _points(ax, rows, across, up, color)


def _points(ax: Axes, rows: Rows, x: Array, y: Array, color: str | None = None) -> None:
    """Draw values of the modules with a published reduction; colours as in `cloud`."""
    families = np.array(rows.family)
    known = rows.geared & np.isfinite(x) & np.isfinite(y)
    for family in (*FAMILIES, *sorted({*rows.family} - {*FAMILIES})):
        colour, marker, label = FAMILIES.get(family, OTHER)
        at = known & (families == family)
        ax.scatter(
            x[at],
            y[at],
            s=5,
            color=color or colour,
            marker=marker,
            alpha=0.75,
            linewidths=0,
            label=label if family in FAMILIES else family,
        )


def _law(ax: Axes, rows: Rows, x: str, y: str) -> None:
    """Draw both laws over the range of the modules, with the 90 % band of Draft's."""
    scale = QUANTITIES[x].factor, QUANTITIES[y].factor
    for name, style in (("draft", "-"), ("paper", "--")):
        at, middle, fold = curve(rows, laws(name), x, y)
        label = "Draft's law" if name == "draft" else "published law"
        ax.plot(at * scale[0], middle * scale[1], style, color="black", label=label)
        if name == "draft":
            band(ax, at * scale[0], middle * scale[1], fold)


def band(ax: Axes, at: Array, middle: Array, fold: float) -> None:
    """Shade the band within a fold error of a law."""
    low, high = middle / fold, middle * fold
    ax.fill_between(at, low, high, label="90 % band", color="black", alpha=0.1, linewidth=0)


def curve(rows: Rows, by: Laws, x: str, y: str) -> tuple[Array, Array, float]:
    """Evaluate a law over the range of the modules.

    Its inputs besides x are those of a typical module: for the volume, the reduction that the rows
    have at this torque; for the rotor, the mass and the reduction at this radius.

    Returns:
        Values of x and of the law, each of shape (100,) in SI units, and the fold of its 90 % band.
    """
    low, high = np.exp(np.nanmin(rows.log[x])), np.exp(np.nanmax(rows.log[x]))
    at = np.geomspace(low / 1.1, high * 1.1, 100)
    trend = by.trends[y]
    middle = trend(*(_typical(rows, quantity, x, at) for quantity in trend.inputs))
    return at, np.asarray(middle), by.error(y).band(0.9)


def _typical(rows: Rows, quantity: str, x: str, at: Array) -> Array:
    """Typical quantity of modules at values of x: x itself, or from a line through the rows."""
    if quantity == x:
        return at
    known = rows.geared & rows.has(quantity, x)
    slope, intercept = np.polyfit(rows.log[x][known], rows.log[quantity][known], 1)
    return np.exp(intercept + slope * np.log(at))
