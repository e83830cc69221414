"""Figures of twins: both robots side by side with what the twin misses; masses of a whole survey.

In the style of `draft.plotting`.
"""

# pyright: reportMissingImports=false, reportMissingModuleSource=false
from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.model.picture import Pixels
from draft.plotting import BLUE, COLUMN, GREY, ORANGE, decorate
from draft.twins.compare import Comparison
from draft.twins.every import Row, score

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAGE = 2 * COLUMN
MARKS = {"humanoid": (BLUE, "o"), "quadruped": (ORANGE, "^")}
BINS = 30
# Resolution of the figure of a twin [dots per inch]: that at which its picture is rendered.
DPI = 200


def twin(found: Comparison, picture: Pixels | None) -> Figure:
    """The robots, the errors of M(q) and g(q) over the poses, and the groups' masses.

    Args:
        found: the comparison.
        picture: both robots, from `draft.twins.look`; None leaves it out.
    """
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(PAGE, (0.92 if picture is not None else 0.36) * PAGE))
    below: Any = figure
    if picture is not None:
        parts: Any = figure.subfigures(2, 1, height_ratios=(0.57, 0.35))
        _picture(parts[0].subplots(), found, picture)
        below = parts[1]
    left, right = below.subplots(1, 2, width_ratios=(1.0, 1.25))
    _errors(left, found)
    _groups(right, found)
    layout = figure.get_layout_engine()
    if layout is not None:
        # Once for all file formats: each would scale the picture again to lay out the figure.
        layout.execute(figure)
        figure.set_layout_engine("none")
    return figure


def _picture(ax: Axes, found: Comparison, picture: Pixels) -> None:
    ax.imshow(picture)
    ax.set_axis_off()
    mass = "mass unknown" if found.unstated else f"{found.vendor_mass:.1f} kg"
    ax.set_title(
        f"{found.name}: left the maker's, {mass}; right its twin, masses by "
        f"trends, {found.design.mass:.1f} kg",
        fontsize=8,
    )


def _errors(ax: Axes, found: Comparison) -> None:
    """Histograms of both errors, with their medians."""
    both = np.concatenate([found.inertia.values, found.gravity.values])
    if np.isnan(both).all():
        ax.set_axis_off()
        ax.set_title("M(q), g(q): nothing to compare", fontsize=8)
        return
    edges = np.linspace(0, float(np.nanquantile(both, 0.995)), BINS + 1).tolist()
    kinds = (("M(q)", found.inertia, BLUE), ("g(q)", found.gravity, ORANGE))
    for name, errors, color in kinds:
        label = f"{name}, median {errors.median:.1f} %"
        ax.hist(errors.values, edges, color=color, alpha=0.55, label=label)
        ax.axvline(errors.median, color=color)
    ax.set_xlabel(f"error over {len(found.inertia.values)} poses [% of the maker's norm]")
    ax.set_ylabel("poses")
    ax.set_xlim(0)
    ax.legend(loc="best")


def _groups(ax: Axes, found: Comparison) -> None:
    """Mass of each group, the maker's beside the twin's."""
    groups = found.groups()
    at = np.arange(len(groups))
    sides = ((0, "the maker's", GREY), (1, "the twin's", BLUE))
    for k, label, color in sides:
        masses = [pair[k] for pair in groups.values()]
        ax.bar(at + 0.4 * (k - 0.5), masses, 0.38, color=color, label=label)
    ax.set_xticks(at, [name.replace("_", " ") for name in groups], rotation=35, ha="right")
    ax.set_ylabel("mass [kg]")
    ax.legend(loc="upper right")


def survey(rows: Sequence[Row]) -> Figure:
    """Mass of each twin over its robot's, with bands, for the robots that the fits use.

    Where the fits use none of them, all are drawn.
    """
    from matplotlib import pyplot as plt

    figure, ax = plt.subplots(figsize=(1.4 * COLUMN, 1.25 * COLUMN))
    rows = [row for row in rows if not math.isnan(row.vendor_mass)]
    rows = [row for row in rows if row.fitted] or list(rows)
    masses = [mass for row in rows for mass in (row.vendor_mass, row.low, row.high)]
    line = np.array([0.9 * min(masses), 1.1 * max(masses)])
    ax.plot(line, line, color=GREY, linewidth=0.6)
    for population, (color, mark) in MARKS.items():
        own = [row for row in rows if row.population == population]
        if not own:
            continue
        x = np.array([row.vendor_mass for row in own])
        y = np.array([row.twin_mass for row in own])
        below, above = np.array([(row.low, row.high) for row in own]).T
        total = score(own)
        fold, inside = f"{total.fold:.2f}", f"{100 * total.covered:.0f} %"
        label = f"{total.n} {population}s: fold {fold}, {inside} in the band"
        ax.errorbar(
            x, y, (y - below, above - y), fmt="none", ecolor=color, alpha=0.35, linewidth=0.7
        )
        ax.plot(x, y, mark, color=color, markersize=3.5, label=label)
        for row in own:
            if not 1 / 1.35 < row.ratio < 1.35:
                ax.annotate(
                    row.robot.replace("_", " "),
                    (row.vendor_mass, row.twin_mass),
                    xytext=(3, -6),
                    textcoords="offset points",
                    fontsize=5.5,
                    color=GREY,
                )
    ax.set(xlim=line, ylim=line)
    decorate(ax, "mass by the maker [kg]", "mass of the twin, robot held out [kg]")
    ax.legend(loc="upper left")
    return figure
