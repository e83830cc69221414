"""Where the joints of a design work: torque and speed per limit, and the line of the motor."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.learn.quadruped import CLASSES
from draft.learn.report.gather import Study
from draft.learn.report.marks import color, halo, spread_out
from draft.learn.report.occupancy import Use, Utilisation
from draft.learn.utilisation import PERCENTILE, WIDTH, percentile
from draft.trends.figures import COLUMN
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINES: dict[str, Any] = {"hip roll": ":", "hip pitch": (0, (4, 1.5)), "knee": "-"}
MARKS = {"hip roll": "o", "hip pitch": "s", "knee": "^"}
# Bins that make one bar of a marginal.
COARSE = 8
SHOWN = ("speed", "ascent", "push")
TOP = 1.32


def makers(study: Study, used: Utilisation) -> dict[str, Callable[[], Figure]]:
    """A figure for each design and battery whose samples were counted, by name."""
    found: dict[str, Callable[[], Figure]] = {}
    for battery in SHOWN:
        for design, title in study.titles.items():
            use = used.of(design, battery)
            if use is not None and use.counts:
                word = "".join(c if c.isalnum() else "_" for c in title)
                name = f"occupancy_{battery}_{word}"
                found[name] = partial(_figure, title, battery, use, color(study, design))
    return found


def _figure(title: str, battery: str, use: Use, tint: str) -> Figure:
    """The plane in the middle, marginals above and to the right of it."""
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(COLUMN, 0.92 * COLUMN))
    grid = figure.add_gridspec(2, 2, width_ratios=(4, 1), height_ratios=(1, 4))
    plane = figure.add_subplot(grid[1, 0])
    above = figure.add_subplot(grid[0, 0], sharex=plane)
    beside = figure.add_subplot(grid[1, 1], sharey=plane)
    for joint in CLASSES:
        speed, torque = (use.counts.get((joint, quantity)) for quantity in ("speed", "torque"))
        if speed is not None and torque is not None:
            _joint(plane, joint, speed, torque, tint)
            _marginal(above, joint, speed, tint, False)
            _marginal(beside, joint, torque, tint, True)
    _names(plane, use, tint)
    _motor(plane)
    for ax in (above, beside):
        ax.tick_params(labelbottom=False, labelleft=False, left=False, bottom=False)
        ax.spines[["left", "bottom"]].set_visible(False)
        ax.set_yticks([]) if ax is above else ax.set_xticks([])
    above.spines["bottom"].set_visible(True)
    beside.spines["left"].set_visible(True)
    above.set_title(f"{title}: {_battery(battery, use)}", loc="left", fontweight="bold")
    return figure


def _battery(battery: str, use: Use) -> str:
    """Battery and levels in words."""
    ends = dict.fromkeys((min(use.levels), max(use.levels)))
    level = "–".join(f"{x:g}" for x in ends)
    return {
        "speed": f"sprint at {level} m/s",
        "ascent": f"stairs up, {level} m",
        "push": f"kicks of {level} m/s",
    }[battery]


def _value(counts: Array, share: float = PERCENTILE) -> float:
    """Value that a share of the samples does not exceed; NaN, which is not drawn, of none."""
    found = percentile(counts, share)
    return np.nan if found is None else found


def _joint(ax: Axes, joint: str, speed: Array, torque: Array, tint: str) -> None:
    """Medians, and lines from them to the 95th percentiles."""
    x, y = _value(speed, 0.5), _value(torque, 0.5)
    far_x, far_y = _value(speed), _value(torque)
    style: dict[str, Any] = {"color": tint, "linestyle": LINES[joint], "linewidth": 1.3}
    ax.plot([x, far_x], [y, y], **style)
    ax.plot([x, x], [y, far_y], **style)
    ax.plot(x, y, MARKS[joint], color=tint, markersize=4)
    ends: dict[str, Any] = {"color": tint, "markersize": 4, "markerfacecolor": "white"}
    ax.plot([far_x, x], [y, far_y], MARKS[joint], linestyle="none", **ends)


def _names(ax: Axes, use: Use, tint: str) -> None:
    """Names of the joint classes, upright above their lines."""
    tops = {
        joint: (
            _value(use.counts[joint, "speed"], 0.5),
            _value(use.counts[joint, "torque"]),
        )
        for joint in CLASSES
        if {(joint, "speed"), (joint, "torque")} <= set(use.counts)
    }
    order = sorted(tops, key=lambda joint: tops[joint])
    places = spread_out([tops[joint][0] / TOP for joint in order], 0.055)
    for joint, place in zip(order, places, strict=True):
        ax.annotate(
            joint,
            (place * TOP, tops[joint][1] + 0.04),
            rotation=90,
            ha="center",
            va="bottom",
            color=tint,
            path_effects=halo(),
        )


def _marginal(ax: Axes, joint: str, counts: Array, tint: str, upright: bool) -> None:
    """Share of the samples by value, in the open last bin what is past it."""
    bars = counts[: -1 - (len(counts) - 1) % COARSE].reshape(-1, COARSE).sum(axis=1) / counts.sum()
    edges = np.arange(len(bars) + 1) * WIDTH * COARSE
    orientation = "horizontal" if upright else "vertical"
    style: dict[str, Any] = {"color": tint, "linestyle": LINES[joint], "linewidth": 0.9}
    ax.stairs(bars, edges, orientation=orientation, baseline=None, **style)


def _motor(ax: Axes) -> None:
    """The torque-speed line of the motor, and the limits of both."""
    ax.plot([0, 1], [1, 0], color="0.3", linewidth=0.9)
    ax.axvline(1, color="0.8", linewidth=0.6, zorder=0)
    ax.axhline(1, color="0.8", linewidth=0.6, zorder=0)
    ax.annotate(
        "torque-\nspeed line",
        (0.97, 0.05),
        linespacing=1.0,
        color="0.3",
        path_effects=halo(),
    )
    ax.set_xlim(0, TOP)
    ax.set_ylim(0, TOP)
    ax.set_xticks([0, 0.25, 0.5, 0.75, 1, 1.25])
    ax.set_yticks([0, 0.25, 0.5, 0.75, 1, 1.25])
    ax.set_xlabel("|speed| per no-load speed [1]")
    ax.set_ylabel("|torque| per peak torque [1]")
