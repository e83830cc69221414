"""Figures of a family's members: capability by level, and the limiting joint of each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from draft.learn.legged import CLASSES
from draft.plotting import BLUE, COLUMN, GREEN, GREY, ORANGE
from draft.study.report.curves import line, scales
from draft.study.report.family import Family, axis_words, figure_name
from draft.study.report.labels import MAP, halo
from draft.study.report.occupancy import BATTERIES, Limit, limiting
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Panel -> scalar that is read from it.
PANELS = {"speed": "top_speed", "efficiency": "eta", "stairs": "step", "push": "kick"}
# Battery -> words, and scalar at which its utilisation is taken.
LIMITS = {
    "speed": ("sprinting", "top_speed"),
    "ascent": ("climbing stairs", "step"),
    "descent": ("going down stairs", "step"),
    "push": ("under kicks", "kick"),
    "walk": ("walking", ""),
}
JOINTS: dict[str, tuple[str, str]] = dict(
    zip(CLASSES, ((BLUE, "o"), (ORANGE, "s"), (GREEN, "^")), strict=True)
)
# Largest number of members that are labelled with their limits.
FEW = 20


def makers(found: list[Family]) -> dict[str, Callable[[], Figure]]:
    """Return makers of the figures of each family whose members were measured, by name."""
    made: dict[str, Callable[[], Figure]] = {}
    for i, family in enumerate(found):
        for panel in PANELS:
            if curves(family, panel):
                made[figure_name(i, len(found), f"curves_{panel}")] = partial(
                    _curves, family, panel
                )
        for battery in BATTERIES:
            if limits(family, battery) and family.axes(LIMITS[battery][1]):
                made[figure_name(i, len(found), f"limits_{battery}")] = partial(
                    _limits, family, battery
                )
    return made


def curves(family: Family, panel: str) -> list[tuple[str, Array, Array]]:
    """Return members and their curves, one for each seed that has one."""
    found = (
        (name, *line(panel, one))
        for name, all_seeds in family.summaries.items()
        for one in all_seeds
    )
    return [curve for curve in found if len(curve[1])]


def limits(family: Family, battery: str) -> dict[str, Limit]:
    """Return the limit of most seeds of each member that was measured, by name."""
    found = {name: limiting(battery, seeds) for name, seeds in family.summaries.items()}
    return {name: limit for name, limit in found.items() if limit is not None}


def _curves(family: Family, panel: str) -> Figure:
    """Draw a thin line for each member and seed, coloured by the most relevant parameter."""
    from matplotlib import colormaps
    from matplotlib import pyplot as plt
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    figure, ax = plt.subplots(figsize=(COLUMN, 0.8 * COLUMN))
    axes = family.axes(PANELS[panel])
    values = [family.parameters[n][axes[0]] for n in family.parameters] if axes else [0.0]
    norm = Normalize(min(values), max(values))
    found = curves(family, panel)
    for name, x, y in found:
        known = axes and name in family.parameters
        tint = colormaps[MAP](norm(family.parameters[name][axes[0]])) if known else GREY
        marker = {"marker": "o", "markersize": 2.5} if len(x) == 1 else {}
        ax.plot(x, y, color=tint, linewidth=0.8, alpha=0.85, **marker)
    scales(ax, panel, {str(i): (x, y) for i, (_, x, y) in enumerate(found)})
    if axes:
        bar = figure.colorbar(ScalarMappable(norm, MAP), ax=ax, pad=0.02, aspect=30)
        bar.set_label(axis_words(axes[0]))
        bar.outline.set_visible(False)
    ax.set_title(f"Family: {ax.get_title('left').lower()}", loc="left", fontweight="bold")
    return figure


def _limits(family: Family, battery: str) -> Figure:
    """Draw members at their parameters, each with its limiting joint."""
    from matplotlib import pyplot as plt

    words, scalar = LIMITS[battery]
    axes = family.axes(scalar)
    found = limits(family, battery)
    figure, ax = plt.subplots(figsize=(COLUMN, 0.8 * COLUMN))
    for name, row in family.parameters.items():
        limit = found.get(name)
        if len(axes) == 1 and limit is None:
            continue
        at = row[axes[0]], row[axes[1]] if len(axes) == 2 else limit.value if limit else 0.0
        _member(ax, at, limit, len(family.parameters) <= FEW)
    ax.margins(0.12)
    ax.set_xlabel(axis_words(axes[0]))
    ax.set_ylabel(axis_words(axes[1]) if len(axes) == 2 else "95th percentile, share of the limit")
    ax.set_title(f"Family: what limits {words}", loc="left", fontweight="bold", pad=16)
    _legend(ax, found, len(found) < len(family.parameters) and len(axes) == 2)
    return figure


def _member(ax: Axes, at: tuple[float, float], limit: Limit | None, words: bool) -> None:
    style: dict[str, Any] = {"linestyle": "none", "markersize": 5, "clip_on": False}
    if limit is None:
        ax.plot(*at, marker="x", color="0.6", **style)
        return
    tint, mark = JOINTS[limit.joint]
    ax.plot(*at, marker=mark, color=tint, **style)
    if words:
        ax.annotate(
            f"{limit.by} {limit.value:.2f}",
            at,
            xytext=(0, -5),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=5.5,
            path_effects=halo(),
        )


def _legend(ax: Axes, found: dict[str, Limit], nobody: bool) -> None:
    """Draw a legend of the joints that occur, above the axes."""
    from matplotlib.lines import Line2D

    shown = {
        joint: JOINTS[joint] for joint in CLASSES if joint in {f.joint for f in found.values()}
    }
    if nobody:
        shown["all fell"] = ("0.6", "x")
    handles = [Line2D([], [], color=c, marker=m, linestyle="none") for c, m in shown.values()]
    style: dict[str, Any] = {"handletextpad": 0.1, "columnspacing": 1.0, "borderpad": 0}
    place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0, 1.01)}
    ax.legend(handles, list(shown), ncols=len(shown), **place, **style)


def caption(family: Family, battery: str) -> str:
    """Return the caption of a figure of limits."""
    seeds = len(family.seeds)
    of = "" if seeds == 1 else f" in most of {seeds} seeds"
    return (
        f"Joint with the largest 95th percentile of torque plus speed share{of}, and what it is "
        "limited by, at the level that the member's own value is taken at."
    )
