"""What all figures share: a colour for each design, and names at its lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.learn.report.gather import Study
from draft.trends.figures import COLORS
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Name -> x, y, colour.
Lines = Mapping[str, tuple[Array, Array, str]]
# Heights between which falling curves are named, one height each.
HEIGHTS = (0.82, 0.28)
# Least distance of two names, per height of the axes.
APART = 0.085


def color(study: Study, design: str) -> str:
    """A design's colour, the same everywhere in a report."""
    return COLORS[list(study.members).index(design) % len(COLORS)]


def halo() -> list[Any]:
    """A white edge that keeps words readable on lines."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=1.8, foreground="white")]


def label_ends(ax: Axes, lines: Lines) -> None:
    """Write each name at the right end of its line, apart from each other."""
    if not lines:
        return
    low, high = ax.get_ylim()
    ends = sorted(lines, key=lambda name: float(lines[name][1][-1]))
    at = [(float(lines[name][1][-1]) - low) / (high - low) for name in ends]
    for i, place in enumerate(spread_out(at)):
        x, _, tint = lines[ends[i]]
        ax.annotate(
            ends[i],
            (float(x[-1]), low + place * (high - low)),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            color=tint,
            path_effects=halo(),
            annotation_clip=False,
        )


def label_drops(ax: Axes, lines: Lines) -> None:
    """Write each name where its line falls through a height, each at its own."""
    crossings = {
        name: [float(np.interp(-h, -y, x)) for h in HEIGHTS] for name, (x, y, _) in lines.items()
    }
    order = sorted(crossings, key=lambda name: sum(crossings[name]))
    heights = np.linspace(*HEIGHTS, len(order)) if len(order) > 1 else [0.6]
    for name, height in zip(order, heights, strict=True):
        x, y, tint = lines[name]
        falling = np.minimum.accumulate(y)
        place = float(np.interp(-float(height), -falling, x))
        ax.annotate(
            name,
            (place, float(height)),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            color=tint,
            path_effects=halo(),
        )


def spread_out(places: list[float], apart: float = APART) -> list[float]:
    """Rising places moved so that no two are nearer than this, about where they were."""
    found = list(places)
    for _ in range(100):
        for i in range(len(found) - 1):
            short = apart - (found[i + 1] - found[i])
            if short > 1e-9:
                found[i] -= short / 2
                found[i + 1] += short / 2
    return found


def key(ax: Axes, styles: Mapping[str, Any], where: str) -> None:
    """A small legend of line styles, in grey."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color="0.35", linestyle=style) for style in styles.values()]
    ax.legend(handles, list(styles), loc=where, handlelength=1.8, labelspacing=0.2, fontsize=6)
