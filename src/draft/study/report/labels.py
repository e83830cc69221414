"""Colours of designs, and names at their lines, alike in all figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from draft.plotting import COLORS
from draft.study.report.records import Study
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patheffects import AbstractPathEffect
    from matplotlib.typing import LegendLocType, LineStyleType

# Name -> x, y, colour.
Lines = Mapping[str, tuple[Array, Array, str]]
# Range of heights at which falling curves are labelled.
HEIGHTS = (0.82, 0.28)
# Least distance of two labels, as a share of the height of the axes.
APART = 0.085


def color(study: Study, design: str) -> str:
    """Return the colour of a design, the same everywhere in a report."""
    return COLORS[list(study.members).index(design) % len(COLORS)]


def halo() -> list[AbstractPathEffect]:
    """Return a white outline that keeps text readable on lines."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=1.8, foreground="white")]


def label_ends(ax: Axes, lines: Lines) -> None:
    """Write each name at the right visible end of its line, without overlaps."""
    if not lines:
        return
    right = ax.get_xlim()[1]
    ends = {}
    for name, (x, y, tint) in lines.items():
        end = min(float(x[-1]), right)
        ends[name] = end, float(np.interp(end, x, y)), tint
    _make_room(ax, _width(max(lines, key=len)))
    low, high = ax.get_ylim()
    order = sorted(ends, key=lambda name: ends[name][1])
    places = spread_out([(ends[name][1] - low) / (high - low) for name in order])
    for name, place in zip(order, places, strict=True):
        end, _, tint = ends[name]
        _name(ax, name, (end, low + place * (high - low)), tint)


def _width(words: str) -> float:
    """Estimate the share of an axis that a text takes."""
    return min(0.05 + 0.032 * len(words), 0.5)


def _make_room(ax: Axes, share: float) -> None:
    """Widen an axis so that its right share is empty."""
    left, right = (ax.transScale.transform((x, 1.0))[0] for x in ax.get_xlim())
    wider = left + (right - left) / (1 - share)
    ax.set_xlim(right=float(ax.transScale.inverted().transform((wider, 0.0))[0]))


def _name(ax: Axes, words: str, at: tuple[float, float], tint: str) -> None:
    """Write a text to the right of a point."""
    note = ax.annotate(
        words,
        at,
        xytext=(3, 0),
        textcoords="offset points",
        ha="left",
        va="center",
        color=tint,
        path_effects=halo(),
    )
    note.set_in_layout(False)


def label_drops(ax: Axes, lines: Lines) -> None:
    """Write each name where its line falls through a height of its own, else at its end."""
    falling = {
        name for name, (_, y, _) in lines.items() if y[0] > HEIGHTS[0] and y[-1] < HEIGHTS[1]
    }
    label_ends(ax, {name: line for name, line in lines.items() if name not in falling})
    crossings = {
        name: [float(np.interp(-h, -y, x)) for h in HEIGHTS]
        for name, (x, y, _) in lines.items()
        if name in falling
    }
    order = sorted(crossings, key=lambda name: sum(crossings[name]))
    heights = [0.6] if len(order) == 1 else np.linspace(*HEIGHTS, len(order))
    for name, height in zip(order, heights, strict=True):
        x, y, tint = lines[name]
        place = float(np.interp(-float(height), -np.minimum.accumulate(y), x))
        across = ax.transAxes.inverted().transform(ax.transData.transform((place, height)))[0]
        over = float(across) + _width(name) - 1
        if over > 0:
            _make_room(ax, over / (1 + over))
        _name(ax, name, (place, float(height)), tint)


def spread_out(places: list[float]) -> list[float]:
    """Move rising positions until no two are closer than APART, within 0 to 1 if they fit."""
    found = list(places)
    for _ in range(100):
        for i in range(len(found) - 1):
            short = APART - (found[i + 1] - found[i])
            if short > 1e-9:
                found[i] -= short / 2
                found[i + 1] += short / 2
    low = min(0.0, 1.0 - found[-1]) if found else 0.0
    return [place + max(low, 0.03 - found[0]) for place in found]


def key(
    on: Axes | Figure, styles: Mapping[str, LineStyleType], where: LegendLocType, columns: int = 1
) -> None:
    """Draw a small legend of line styles, in grey."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color="0.35", linestyle=style) for style in styles.values()]
    style = {"handlelength": 1.8, "labelspacing": 0.2, "fontsize": 6, "ncols": columns}
    on.legend(handles, list(styles), loc=where, **style)
