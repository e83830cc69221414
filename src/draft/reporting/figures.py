"""Figures of a report as PNG and PDF, in the style of `draft.plotting`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from draft import plotting
from draft.design.bands import actuator_bands
from draft.design.report import used_actuators
from draft.fitting.actuators import catalogue_figures as trends
from draft.fitting.actuators.catalogue_rows import rows_of
from draft.laws.catalogue import catalogue
from draft.laws.quantities import QUANTITIES
from draft.model.picture import Pixels
from draft.model.picture import draw as render
from draft.model.picture import row as side_by_side
from draft.reporting import dots, plots
from draft.reporting.plots import PALETTE, parts
from draft.reporting.scene3d import YAW
from draft.reporting.subjects import Subject
from draft.reporting.tables import number
from draft.values import scalar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAGE = 2 * plotting.COLUMN
SIZE = (1500, 600)
VIEW = (180, -9)
_DOT = 0.04  # width of a dot of a dot plot as a share of its scale
_MARKS = ("o", "s", "D", "^", "P", "*")


def draw(folder: Path, subjects: Sequence[Subject]) -> list[Path]:
    """Draw all figures and write them as PNG and PDF.

    Returns:
        The files written.

    Raises:
        DraftError: the extra `figures` is not installed, MuJoCo cannot draw on this machine, or
            the folder cannot be written.
    """
    makers = {"masses": partial(masses, subjects)}
    if any(subject.design.actuators for subject in subjects):
        makers["actuators"] = partial(actuators, subjects)
        makers["torque_speed"] = partial(torque_speed, subjects)
    for name, rows in (
        ("metrics", dots.metrics(subjects)),
        ("parameters", dots.parameters(subjects)),
    ):
        if rows:
            makers[name] = partial(dot_plot, subjects, rows)
    pixels = picture(subjects)
    if pixels is not None:
        makers["robots"] = partial(robots, subjects, pixels)
    return plotting.save(folder, makers)


def picture(subjects: Sequence[Subject]) -> Pixels | None:
    """Render the robots in a row, shape (height, width, 3); None if none has a model."""
    shown = side_by_side([one.model for one in subjects if one.model is not None], YAW)
    return render(shown, VIEW, SIZE) if shown else None


def robots(subjects: Sequence[Subject], pixels: Pixels) -> Figure:
    """Figure of the rendered robots, with their titles in order."""
    from matplotlib import pyplot as plt

    figure, ax = plt.subplots(figsize=(PAGE, PAGE * SIZE[1] / SIZE[0]))
    ax.imshow(pixels)
    ax.set_axis_off()
    shown = [s for s in subjects if s.model is not None]
    ax.set_title(", ".join(f"{s.title} {s.design.mass:.1f} kg" for s in shown))
    return figure


def masses(subjects: Sequence[Subject]) -> Figure:
    """Figure of the masses [kg]: one stacked bar per design."""
    from matplotlib import pyplot as plt

    figure, ax = plt.subplots(figsize=(PAGE, 0.7 + 0.3 * len(subjects)))
    tables = [parts(subject) for subject in subjects]
    places = np.arange(len(subjects))
    left = np.zeros(len(subjects))
    for i, name in enumerate(plots.part_names(tables)):
        width = np.array([table.get(name, 0.0) for table in tables])
        color = PALETTE[i % len(PALETTE)]
        ax.barh(places, width, 0.62, left, color=color, label=name, edgecolor="white")
        left += width
    ax.set_yticks(places, [subject.title for subject in subjects])
    ax.invert_yaxis()
    ax.set_xlabel("mass [kg]")
    figure.legend(loc="outside upper center", ncols=5)
    return figure


def actuators(subjects: Sequence[Subject]) -> Figure:
    """Figure of the designs' actuator classes over the catalogue, with the trends and bands."""
    from matplotlib import pyplot as plt

    rows = rows_of(catalogue().values())
    laws = plots.laws_of(subjects)
    figure, axes = plt.subplots(2, 2, figsize=(PAGE, 0.8 * PAGE))
    for ax, (y, x) in zip(axes.flat, trends.RELATIONS, strict=True):
        trends.cloud(ax, rows, x, y, plots.CATALOGUE)
        at, middle, fold = trends.curve(rows, laws, x, y)
        at, middle = at * QUANTITIES[x].factor, middle * QUANTITIES[y].factor
        ax.plot(at, middle, color="black", label="law")
        trends.band(ax, at, middle, fold)
        _classes(ax, subjects, x, y)
        plotting.decorate(ax, QUANTITIES[x].axis, QUANTITIES[y].axis)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5)
    return figure


def _classes(ax: Axes, subjects: Sequence[Subject], x: str, y: str) -> None:
    """Plot a point per actuator class of each design, with its 90 % band."""
    across, up = QUANTITIES[x].factor, QUANTITIES[y].factor
    for subject in subjects:
        for k, actuator in enumerate(used_actuators(subject.design)):
            at, value = scalar(getattr(actuator, x)) * across, scalar(getattr(actuator, y)) * up
            band = actuator_bands(actuator).get(y, (value / up, value / up))
            low, high = (scalar(end) * up for end in band)
            ax.errorbar(
                [at],
                [value],
                [[max(value - low, 0.0)], [max(high - value, 0.0)]],
                fmt=_MARKS[k % len(_MARKS)],
                color=subject.color,
                markersize=5,
                markeredgecolor="white",
                capsize=2,
                label=f"{subject.title}, {actuator.name}",
            )


def dot_plot(subjects: Sequence[Subject], rows: Sequence[dots.Row]) -> Figure:
    """Figure with a scale per quantity, between its smallest and largest value, and its dots."""
    from matplotlib import pyplot as plt

    placed = [dots.places(row, _DOT) for row in rows]
    lanes = [1 + max(dot.lane for dot in of) for of in placed]
    bases = np.cumsum([0.0, *(0.5 + 0.55 * count for count in lanes)])
    height = 0.22 * float(bases[-1]) + 0.5
    figure, ax = plt.subplots(figsize=(PAGE, height))
    for row, of, top in zip(rows, placed, bases[1:], strict=True):
        at = float(top)  # the axis points down: the scale is below its lanes
        ax.plot([0, 1], [at, at], color="#c4ccd4", linewidth=0.6, zorder=1)
        low, high = (number(end) for end in row.ends)
        bold = {"less": (True, False), "more": (False, True)}.get(row.better, (False, False))
        for x, side, words, best in ((-0.04, "right", low, bold[0]), (1.04, "left", high, bold[1])):
            weight = "bold" if best else "normal"
            ax.text(x, at, words, ha=side, va="center", weight=weight)
        about = f" [{row.about}]" if row.about else ""
        ax.text(-0.2, at, f"{row.name}{about}", ha="right", va="center")
        for design, share, lane in of:
            color = subjects[design - 1].color
            y = at - 0.6 * lane
            ax.scatter([share], [y], 70, color, edgecolors="white", linewidths=0.6, zorder=2)
            ax.text(
                share,
                y,
                str(design),
                ha="center",
                va="center_baseline",
                fontsize=6,
                weight="bold",
                color=dots.ink(color),
            )
    ax.set_xlim(-1.0, 1.25)
    ax.set_ylim(float(bases[-1]) + 0.6, -0.2)
    ax.set_axis_off()
    handles = [
        ax.scatter([], [], 70, subject.color, label=f"{k + 1}  {subject.title}")
        for k, subject in enumerate(subjects)
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=min(len(subjects), 4))
    return figure


def torque_speed(subjects: Sequence[Subject]) -> Figure:
    """Figure of torque over speed of each actuator class."""
    from matplotlib import pyplot as plt

    figure, ax = plt.subplots(figsize=(1.3 * plotting.COLUMN, 0.9 * plotting.COLUMN))
    for curve in plots.curves(subjects):
        speed, torque = zip(*curve.line, strict=True)
        style = plots.DASHES[curve.dashes]
        ax.plot(speed, torque, label=curve.name, color=curve.color, linestyle=style)
    ax.set_xlabel("joint speed [rad/s]")
    ax.set_ylabel("torque [N m]")
    ax.set_xlim(0)
    ax.set_ylim(0)
    ax.legend()
    return figure
