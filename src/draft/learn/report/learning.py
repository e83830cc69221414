"""Training over iterations: the median over seeds and their band, stage by stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from draft.learn.config import STAGES
from draft.learn.report.gather import Study, Trained
from draft.learn.report.marks import color, label_ends
from draft.learn.run import robots_digest
from draft.plotting import COLUMN, GREY
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Column of progress.csv -> words, label.
SHOWN = {
    "reward": ("reward", "reward [1/s]"),
    "tracking_error": ("tracking error", "tracking error [m/s]"),
    "falls": ("falls", "episodes that end by a fall"),
}
WINDOWS = 60


@dataclass(frozen=True)
class Line:
    """Runs whose training is one line.

    Attributes:
        title: of a design, or of a family.
        tint: its colour.
        runs: of all stages and seeds.
    """

    title: str
    tint: str
    runs: list[Trained]


def lines(study: Study) -> list[Line]:
    """Designs by leg length, then families."""
    found = [
        Line(title, color(study, design), [one for one in study.singles if one.key[0] == design])
        for design, title in study.titles.items()
    ]
    groups: dict[str, list[Trained]] = {}
    for one in study.families:
        groups.setdefault(robots_digest(one.run.plan.members), []).append(one)
    for number, runs in enumerate(groups.values(), 1):
        found.append(Line("family" if len(groups) == 1 else f"family {number}", GREY, runs))
    return found


def makers(study: Study) -> dict[str, Callable[[], Figure]]:
    """A figure for each stage and quantity, by name."""
    drawn = lines(study)
    return {
        f"training_{stage}_{name}": partial(_figure, drawn, stage, name)
        for stage in STAGES
        for name in SHOWN
        if any(_curves(line, stage, name) for line in drawn)
    }


def _figure(drawn: list[Line], stage: str, name: str) -> Figure:
    from matplotlib import pyplot as plt

    figure, ax = plt.subplots(figsize=(COLUMN, 0.62 * COLUMN))
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
    """Iterations and values of each seed, those that are known, smoothed."""
    runs = [one for one in line.runs if one.run.plan.stage == stage]
    return [curve for one in runs if len((curve := _smooth(one, name))[0])]


def _smooth(one: Trained, name: str) -> tuple[Array, Array]:
    """Means over windows of a sixtieth of the run; a short run is left as it is."""
    pairs = [(row["iteration"], row.get(name, float("nan"))) for row in one.rows]
    rows = np.array([pair for pair in pairs if np.isfinite(pair[1])]).reshape(-1, 2)
    width = max(1, round(len(rows) / WINDOWS))
    whole = len(rows) // width * width
    means = rows[:whole].reshape(-1, width, 2).mean(axis=1)
    return means[:, 0], means[:, 1]


def band(curves: list[tuple[Array, Array]]) -> tuple[Array, Array, Array, Array]:
    """Median, least and greatest of curves at the iterations that any has, each within its own."""
    at = np.unique(np.concatenate([x for x, _ in curves]))
    values = np.array([np.interp(at, x, y, left=np.nan, right=np.nan) for x, y in curves])
    return at, np.nanmedian(values, 0), np.nanmin(values, 0), np.nanmax(values, 0)
