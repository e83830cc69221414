"""Figures of the structure trends, and of held-out errors, each as PNG and PDF.

Their style is that of `draft.plotting`; figures with many panels are as wide as a page.
"""

# pyright: reportMissingImports=false, reportMissingModuleSource=false
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from draft import plotting
from draft.fitting.actuators.catalogue_figures import dumbbells
from draft.fitting.actuators.catalogue_figures import held_out_errors as actuator_errors
from draft.fitting.actuators.catalogue_rows import Rows, rows_of
from draft.fitting.structure import fits, whole
from draft.fitting.structure import survey_holdout as holdout
from draft.fitting.structure import survey_published as published
from draft.fitting.structure.attribution import Machine, machines
from draft.fitting.structure.robots import robots as known
from draft.laws.catalogue import Part
from draft.laws.law import Law
from draft.laws.structure import population
from draft.laws.survey import read
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAGE = 7.0
# Colour and marker of each population.
POPULATIONS = {"humanoid": (plotting.BLUE, "o"), "quadruped": (plotting.ORANGE, "^")}
METHODS = {
    "published: classes by length": holdout.published,
    "Draft's: structure by leg length": whole.by_legs,
}
# Fold errors: of the dotted lines, and above which a robot is named.
NEAR, NAMED = 1.25, 1.4
# Factor by which the drawn range of a law exceeds its fitted range.
BEYOND = 1.7
LENGTHS = (0.01, 1.0)

Populations = dict[str, list[Machine]]


def draw(folder: Path, parts: Sequence[Part]) -> list[Path]:
    """Draw the figures of the shipped survey.

    Args:
        folder: folder of the files.
        parts: modules for the held-out errors of the actuator laws.

    Returns:
        The files written.

    Raises:
        DraftError: the extra is not installed, or the folder cannot be written.
    """
    surveyed = populations()
    return plotting.save(
        folder,
        {
            "structure_by_class": partial(by_class, surveyed),
            "structure_predicted": partial(predicted, surveyed),
            "held_out_errors": partial(held_out_errors, rows_of(parts)),
        },
    )


def populations() -> Populations:
    """Surveyed robots by population."""
    surveyed = machines(read())
    return {name: [robot for robot in surveyed if robot.population == name] for name in POPULATIONS}


def by_class(surveyed: Populations) -> Figure:
    """Figure of structural mass against length, with a panel for each class that has a law."""
    from matplotlib import pyplot as plt

    laws = {name: fits.structure(robots).fits for name, robots in surveyed.items()}
    rows = {name: fits.usable_rows(robots) for name, robots in surveyed.items()}
    fitted = {kind for table in laws.values() for kind in table}
    first = [kind for kind in published.classes("humanoid") if kind in fitted]
    kinds = [*first, *sorted(fitted - {*first})]
    columns = 5
    figure, grid = plt.subplots(
        -(-len(kinds) // columns), columns, figsize=(PAGE, 4.7), sharex=True, sharey=True
    )
    for ax, kind in zip(grid.flat, kinds, strict=False):
        for name in surveyed:
            if kind in laws[name]:
                _cloud(ax, name, rows[name][kind])
                _law(ax, name, replace(laws[name][kind], beyond="proportional"))
        ax.set_title(kind.replace("_", " "))
        plotting.decorate(ax, "", "")
    grid.flat[0].set_xlim(*LENGTHS)
    grid.flat[0].set_xticks([0.02, 0.1, 0.5])
    _drop_empty(grid, len(kinds))
    figure.supxlabel("joint-to-joint length [m]", fontsize=7)
    figure.supylabel("structural mass [kg]", fontsize=7)
    figure.legend(handles=_handles(), loc="lower right", bbox_to_anchor=(0.995, 0.09))
    return figure


def _handles() -> list[Artist]:
    """Handles of the legend of classes: populations in their colours, kinds of line in grey."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    dots = [
        Line2D([], [], color=colour, marker=mark, markersize=3.5, linestyle="", label=name)
        for name, (colour, mark) in POPULATIONS.items()
    ]
    lines = [
        Line2D([], [], color=plotting.GREY, linestyle="-", label="law over its fitted lengths"),
        Line2D([], [], color=plotting.GREY, linestyle="--", label="mass per metre held"),
    ]
    band = Patch(color=plotting.GREY, alpha=0.2, linewidth=0, label="mean fold error of the law")
    return [*dots, *lines, band]


def _cloud(ax: Axes, name: str, pieces: Sequence[fits.Piece]) -> None:
    colour, mark = POPULATIONS[name]
    style = {"s": 7, "alpha": 0.55, "linewidths": 0}
    ax.scatter(*fits.columns(pieces), color=colour, marker=mark, **style)


def _law(ax: Axes, name: str, law: Law) -> None:
    """Draw a law with its mean fold error as a band; dashed outside its fitted lengths."""
    colour, _ = POPULATIONS[name]
    low, high = law.range
    inside = np.geomspace(low, high, 50)
    mass, fold = law(inside), law.fold or 1.0
    band = {"color": colour, "alpha": 0.15, "linewidth": 0}
    ax.plot(inside, mass, color=colour)
    ax.fill_between(inside, mass / fold, mass * fold, **band)
    for ends in ((low / BEYOND, low), (high, high * BEYOND)):
        outside = np.array(ends)
        ax.plot(outside, law(outside), "--", color=colour)


def _drop_empty(grid: NDArray[np.object_], used: int) -> None:
    """Remove the unused panels, and label the ticks of the panels above them."""
    axes: list[Axes] = grid.ravel().tolist()
    for i in range(used, len(axes)):
        axes[i].remove()
        axes[i - grid.shape[1]].tick_params(labelbottom=True)


def _legend(figure: Figure, ax: Axes, columns: int) -> None:
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=columns)


def predicted(surveyed: Populations) -> Figure:
    """Figure of total masses predicted from the other robots, against true masses."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(PAGE, 3.6), sharex=True, sharey=True)
    masses = [robot.mass for robots in surveyed.values() for robot in robots]
    ends = np.array([min(masses) / 1.6, max(masses) * 1.6])
    for ax, (title, method) in zip(axes, METHODS.items(), strict=True):
        scores: list[str] = []
        ax.plot(ends, ends, color="black", linewidth=0.6, label="equal")
        ax.plot(ends, ends * NEAR, ":", color="black", label=f"{NEAR:g} times over or under")
        ax.plot(ends, ends / NEAR, ":", color="black")
        for name, robots in surveyed.items():
            score = holdout.leave_one_out(robots, method)
            _robots(ax, name, robots, np.exp(score.logs))
            scores.append(f"{name} {score.fold:.2f}")
        text = "\n".join(("mean fold error", *scores))
        ax.text(0.97, 0.04, text, transform=ax.transAxes, ha="right")
        plotting.decorate(ax, "true total mass [kg]", "predicted total mass [kg]")
        ax.set_title(title)
        ax.set_xlim(*ends)
        ax.set_ylim(*ends)
        ax.set_aspect("equal")
        ax.label_outer()
    _legend(figure, axes[0], columns=4)
    return figure


def _robots(ax: Axes, name: str, robots: Sequence[Machine], folds: Array) -> None:
    """Draw the robots of one population, with the names of those far from their true mass."""
    colour, mark = POPULATIONS[name]
    mass = np.array([robot.mass for robot in robots])
    ax.scatter(
        mass,
        mass * folds,
        s=12,
        color=colour,
        marker=mark,
        alpha=0.75,
        linewidths=0,
        label=f"{name} ({len(robots)})",
    )
    for robot, true, fold in zip(robots, mass, folds, strict=True):
        if abs(np.log(fold)) > np.log(NAMED):
            label = known()[robot.key].name if robot.key in known() else robot.key
            side = -1 if fold > 1.0 else 1
            ax.annotate(
                fill(label, 14),
                (true, true * fold),
                (4 * side, 0),
                textcoords="offset points",
                ha="right" if side < 0 else "left",
                va="center",
                linespacing=0.9,
                color=colour,
            )


def held_out_errors(rows: Rows) -> Figure:
    """Figure of mean fold errors on held-out actuators and held-out robots."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 4, figsize=(PAGE, 2.2))
    actuator_errors(axes[:3], rows)
    for ax in axes[1:3]:
        ax.set_yticklabels([])
    scores = [asdict(population(name).held_out) for name in POPULATIONS]
    names = [f"{name},\n{out} out" for name in POPULATIONS for out in ("robot", "maker")]
    paper, draft = (
        [score[method + end] for score in scores for end in ("", "_maker_out")]
        for method in ("paper", "draft")
    )
    dumbbells(axes[3], names, paper, draft)
    axes[3].set_title("robots: total mass")
    figure.supxlabel("mean fold error of what is held out [1]", fontsize=7)
    _legend(figure, axes[0], columns=2)
    return figure
