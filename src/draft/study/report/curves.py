"""Figures of capability by level: median and band over seeds, the perturbed arm dashed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from draft.learn.measuring.summary import Measured
from draft.plotting import COLUMN, GREY, logarithmic
from draft.study.report.labels import color, key, label_drops, label_ends
from draft.study.report.records import Study
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import LegendLocType, LineStyleType

Points = dict[float, float]
STYLES = {"nominal": "-", "perturbed": "--"}
# Position of the key of a panel; lower left for the others.
KEYS: dict[str, LegendLocType] = {"speed": "upper left", "efficiency": "lower right"}


@dataclass(frozen=True)
class Panel:
    """Description of a panel.

    Attributes:
        title: title of the panel.
        x: label of its levels.
        y: label of its values.
        points: returns values by level of a summary or of a member in it; empty if it has none.
        threshold: share at which the scalar is read; None for none.
        caption: caption on the page.
        falls: whether the curves fall from 1 to 0.
    """

    title: str
    x: str
    y: str
    points: Callable[[Measured], Points]
    caption: str
    threshold: float | None = None
    falls: bool = True


def _values(test: str, quantity: str, summary: Measured) -> Points:
    curve = summary.tests.get(test)
    if curve is None or quantity not in curve:
        return {}
    pairs = zip(curve["levels"], curve[quantity], strict=True)
    return {x: y for x, y in pairs if y is not None}


def _pooled(summary: Measured) -> Points:
    up, down = (_values(test, "traversed", summary) for test in ("ascent", "descent"))
    return {x: (up[x] + down[x]) / 2 for x in up if x in down}


def to_peak(summary: Measured) -> tuple[Points, Points]:
    """Return achieved speed and efficiency by command, up to the peak command."""
    speed, eta = (_values("speed", quantity, summary) for quantity in ("speed", "eta"))
    peak = summary.scalars.get("peak_command")
    both = [x for x in speed if x in eta and peak is not None and x <= peak + 1e-9]
    return {x: speed[x] for x in both}, {x: eta[x] for x in both}


PANELS = {
    "speed": Panel(
        *("Achieved speed", "commanded speed [m/s]", "achieved speed [m/s]"),
        partial(_values, "speed", "speed"),
        "Achieved speed over the command; grey: as commanded.",
        falls=False,
    ),
    "survival": Panel(
        *("Survival", "commanded speed [m/s]", "share that never fell [1]"),
        partial(_values, "speed", "survival"),
        "Share of roll-outs without a fall; top speed counts where it is 80 % or more.",
        0.8,
    ),
    "efficiency": Panel(
        *("Drivetrain efficiency", "achieved speed [m/s]", "efficiency η [1]"),
        partial(_values, "speed", "eta"),
        "Mechanical power per mechanical power and heat, up to the peak command.",
        falls=False,
    ),
    "stairs": Panel(
        *("Stairs, both ways", "step height [m]", "share that traversed [1]"),
        _pooled,
        "Mean of ascent and descent; the step is the tallest with 50 % or more.",
        0.5,
    ),
    "ascent": Panel(
        *("Stairs up", "step height [m]", "share that traversed [1]"),
        partial(_values, "ascent", "traversed"),
        "Share that climbed by more than a step without a fall.",
        0.5,
    ),
    "descent": Panel(
        *("Stairs down", "step height [m]", "share that traversed [1]"),
        partial(_values, "descent", "traversed"),
        "Share that went down by more than a step without a fall.",
        0.5,
    ),
    "push": Panel(
        *("Kicks", "kick dv [m/s]", "share that recovered [1]"),
        partial(_values, "push", "recovered"),
        "Share without a fall under three kicks; the kick is where it crosses 50 %.",
        0.5,
    ),
}


def has(study: Study, name: str) -> bool:
    """Return whether a study has values for a panel."""
    return any(
        PANELS[name].points(one.summary)
        for d in study.members
        for arm in study.arms
        for one in study.of(d, arm)
    )


def figure(study: Study, shown: Sequence[str]) -> Figure:
    """Draw one or more panels, up to four in a row."""
    from matplotlib import pyplot as plt

    columns = min(4, len(shown) if len(shown) < 4 else (len(shown) + 1) // 2)
    lines = -(-len(shown) // columns)
    below = 0.25 * (columns * lines == len(shown))  # room for the key
    alone = len(shown) == 1
    size = (COLUMN, 0.72 * COLUMN) if alone else (1.95 * columns, 1.72 * lines + below)
    figure, axes = plt.subplots(lines, columns, figsize=size, squeeze=False)
    figure.set_layout_engine("constrained", wspace=0.06)
    for ax, name in zip(axes.flat, shown, strict=False):
        draw(ax, study, name)
    spare = axes.flat[len(shown) :]
    for ax in spare:
        ax.set_axis_off()
    if "perturbed" in study.arms:
        styles: dict[str, LineStyleType] = {"nominal": "-", "perturbed inertia": "--"}
        if alone:
            key(axes.flat[0], styles, KEYS.get(shown[0], "lower left"))
        elif len(spare):
            key(spare[0], styles, "upper left")
        else:
            key(figure, styles, "outside lower center", 2)
    return figure


def draw(ax: Axes, study: Study, name: str) -> None:
    """Draw a panel: every design in its colour, the perturbed arm dashed."""
    panel = PANELS[name]
    medians: dict[str, tuple[Array, Array]] = {}
    for design in study.members:
        for arm in study.arms:
            found = (
                over_speed(study, design, arm)
                if name == "efficiency"
                else over_level(study, design, arm, panel)
            )
            x, middle, low, high = found
            if len(x):
                tint = color(study, design)
                if arm == "nominal":
                    ax.fill_between(x, low, high, color=tint, alpha=0.18, linewidth=0)
                marker = {"marker": "o", "markersize": 2.5} if len(x) == 1 else {}
                ax.plot(x, middle, STYLES[arm], color=tint, **marker)
                if arm == "nominal" or design not in medians:
                    medians[design] = (x, middle)
    scales(ax, name, medians)
    names = {study.titles[design]: (*medians[design], color(study, design)) for design in medians}
    if panel.falls:
        label_drops(ax, names)
    else:
        label_ends(ax, names)


def scales(ax: Axes, name: str, drawn: Mapping[str, tuple[Array, Array]]) -> None:
    """Set title, labels, limits and ticks of a panel with curves."""
    panel = PANELS[name]
    ax.set_title(panel.title, loc="left", fontweight="bold")
    ax.set_xlabel(panel.x)
    ax.set_ylabel(panel.y)
    if panel.threshold is not None:
        ax.axhline(panel.threshold, color="0.6", linewidth=0.6, linestyle=(0, (1, 2)))
    if panel.falls:
        ax.set_ylim(-0.03, 1.05)
        ax.set_yticks([0, 0.25, 0.5, 0.75, 1], ["0", "25 %", "50 %", "75 %", "100 %"])
        ax.set_ylabel(panel.y.replace(" [1]", ""))
    across = np.concatenate([x for x, _ in drawn.values()])
    low, high = float(across.min()), float(across.max())
    if panel.x.startswith("commanded"):
        ax.set_xmargin(0.02)  # Two decades of commands then have ticks of 1, 2 and 5.
        logarithmic(ax.xaxis)
        ax.set_xticks([x for x in ax.get_xticks() if 0.99 * low <= x <= 1.01 * high])
    if panel.falls:
        _cut(ax, drawn)
    if name == "speed":
        top = max(float(y.max()) for _, y in drawn.values())
        line = np.geomspace(low, high, 60)
        ax.plot(line, line, color=GREY, linewidth=0.6, zorder=0)
        ax.set_ylim(0, 1.25 * top)
    if name == "efficiency":
        ax.set_ylim(bottom=0)
        ax.set_xlim(left=0)


def _cut(ax: Axes, drawn: Mapping[str, tuple[Array, Array]]) -> None:
    """End an axis shortly after the last curve has fallen."""
    ends = [float(x[min(len(x) - 1, int((y > 0.005).sum()) + 2)]) for x, y in drawn.values()]
    starts = [float(x[0]) for x, _ in drawn.values()]
    if max(ends) > min(starts):
        ax.set_xlim(0.9 * min(starts), max(ends))


def over_level(
    study: Study, design: str, arm: str, panel: Panel
) -> tuple[Array, Array, Array, Array]:
    """Return levels, and median, least and greatest value over seeds at each."""
    return band([points for one in study.of(design, arm) if (points := panel.points(one.summary))])


def over_speed(study: Study, design: str, arm: str) -> tuple[Array, Array, Array, Array]:
    """Return median achieved speeds and the median, least and greatest efficiency at each."""
    seeds = [both for one in study.of(design, arm) if (both := to_peak(one.summary))[0]]
    _, across, _, _ = band([speed for speed, _ in seeds])
    _, middle, low, high = band([eta for _, eta in seeds])
    order = np.argsort(across, kind="stable")
    return across[order], middle[order], low[order], high[order]


def band(seeds: list[Points]) -> tuple[Array, Array, Array, Array]:
    """Return levels that at least half of the seeds have, with median, least and greatest value."""
    count = Counter(x for points in seeds for x in points)
    levels = sorted(x for x in count if 2 * count[x] >= len(seeds))
    values = [[points[x] for points in seeds if x in points] for x in levels]
    middle = np.array([np.median(v) for v in values])
    low, high = np.array([min(v) for v in values]), np.array([max(v) for v in values])
    return np.array(levels), middle, low, high
