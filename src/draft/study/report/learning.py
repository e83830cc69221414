"""Figures of training over iterations: median and band over seeds, by stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from draft.plotting import COLUMN, GREY
from draft.study.report.labels import color, label_ends
from draft.study.report.records import Study, Trained
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Column of progress.csv -> words, label.
SHOWN = {
    "reward": ("reward", "reward [1/s]"),
    "tracking_error": ("tracking error", "tracking error [m/s]"),
    "falls": ("falls", "episodes that end in a fall"),
}


@dataclass(frozen=True)
class Line:
    """Runs that are drawn as one line.

    Attributes:
        title: title of the design or family.
        tint: colour.
        runs: runs of all stages and seeds.
    """

    title: str
    tint: str
    runs: list[Trained]


def lines(study: Study) -> list[Line]:
    """Return the lines of designs by leg length, then of families."""
    found = [
        Line(title, color(study, design), [one for one in study.singles if one.design == design])
        for design, title in study.titles.items()
    ]
    groups: dict[str, list[Trained]] = {}
    for one in study.families:
        groups.setdefault(one.robots, []).append(one)
    for number, runs in enumerate(groups.values(), 1):
        found.append(Line("family" if len(groups) == 1 else f"family {number}", GREY, runs))
    return found


def quantities(drawn: list[Line], stage: str) -> list[str]:
    """Return the quantities of a stage that have a curve."""
    return [name for name in SHOWN if any(_curves(line, stage, name) for line in drawn)]


def figure(drawn: list[Line], stage: str, names: list[str]) -> Figure:
    """Draw one or more quantities of a stage side by side."""
    from matplotlib import pyplot as plt

    size = (2.0 * len(names), 1.8) if len(names) > 1 else (COLUMN, 0.62 * COLUMN)
    figure, axes = plt.subplots(1, len(names), figsize=size, squeeze=False)
    for ax, name in zip(axes.flat, names, strict=True):
        draw(ax, drawn, stage, name)
    return figure


def draw(ax: Axes, drawn: list[Line], stage: str, name: str) -> None:
    """Draw a quantity of a stage over its iterations."""
    ends, last = {}, 1.0
    for line in drawn:
        curves = _curves(line, stage, name)
        if not curves:
            continue
        at, middle, low, high = band(curves)
        last = max(last, float(at[-1]))
        ax.fill_between(at, low, high, color=line.tint, alpha=0.18, linewidth=0)
        marker = {"marker": "o", "markersize": 2.5} if len(at) == 1 else {}
        ax.plot(at, middle, color=line.tint, **marker)
        ends[line.title] = (at, middle, line.tint)
    words, label = SHOWN[name]
    ax.set_title(f"{stage.capitalize()}: {words}", loc="left", fontweight="bold")
    ax.set_xlabel("iteration")
    ax.set_ylabel(label)
    if name == "falls":
        ax.set_ylim(-0.03, 1.03)
        ax.set_yticks([0, 0.25, 0.5, 0.75, 1], ["0", "25 %", "50 %", "75 %", "100 %"])
    elif name == "tracking_error":
        ax.set_ylim(bottom=0)
    ax.set_xlim(0, last)
    ax.locator_params(axis="x", nbins=5, integer=True)
    ticks = ax.get_xticks()
    ax.set_xticks(ticks[ticks <= last])
    label_ends(ax, ends)


def _curves(line: Line, stage: str, name: str) -> list[tuple[Array, Array]]:
    """Return iterations and known values of each seed."""
    runs = [one for one in line.runs if one.stage == stage]
    return [curve for one in runs if len((curve := _curve(one, name))[0])]


def _curve(one: Trained, name: str) -> tuple[Array, Array]:
    """Return iterations and known values of a run."""
    columns = (one.curve.get(column, []) for column in ("iteration", name))
    pairs = [pair for pair in zip(*columns, strict=False) if None not in pair]
    at, values = np.array(pairs, dtype=float).reshape(-1, 2).T
    return at, values


def band(curves: list[tuple[Array, Array]]) -> tuple[Array, Array, Array, Array]:
    """Return all iterations, and median, least and greatest value of the curves that reach each."""
    at = np.unique(np.concatenate([x for x, _ in curves]))
    values = np.array([np.interp(at, x, y, left=np.nan, right=np.nan) for x, y in curves])
    return at, np.nanmedian(values, 0), np.nanmin(values, 0), np.nanmax(values, 0)
