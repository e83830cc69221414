"""Figure of sensitivities: for each metric a bar for a step of each number, longest first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from draft import plotting
from draft.errors import DraftError
from draft.explore.indices import Indices
from draft.explore.sensitivity import Sensitivity
from draft.metrics import find
from draft.plotting import BLUE, COLUMN, GREY, ORANGE
from draft.values import brief

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".png", ".pdf", ".svg")
_MOST = 10  # Numbers of a panel.
_SIDES = ((BLUE, "more"), (ORANGE, "less"))


def tornado(found: Sensitivity) -> Figure:
    """Draw the changes of metrics for a step more (blue) and a step less (orange) of each number.

    Black lines are the 90 % bands over the errors of the laws, for a step more; of learned metrics
    the 95 % intervals over roll-outs.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    size = found.sizes
    bars = [max(1, min(_MOST, count)) for count in (size > 0).sum(axis=0)]
    heights = [0.6 + 0.17 * count for count in bars]
    figure = Figure(figsize=(1.6 * COLUMN, sum(heights) + 0.2))
    panels = figure.subplots(len(bars), 1, squeeze=False, height_ratios=heights).ravel()
    for k, (axes, name) in enumerate(zip(panels, found.metrics, strict=True)):
        metric = find(name)
        order = [i for i in np.argsort(-size[:, k], kind="stable") if size[i, k] > 0]
        order = order[:_MOST][::-1]
        place = np.arange(len(order))
        for values, color in ((found.step_up, BLUE), (found.step_down, ORANGE)):
            axes.barh(place, np.nan_to_num(values[order, k]), 0.6, color=color, alpha=0.85)
        middle = np.nan_to_num(found.step_up[order, k])
        low, high = (np.nan_to_num(of[order, k], nan=0.0) for of in (found.low, found.high))
        axes.hlines(place, np.where(low, low, middle), np.where(high, high, middle), "k", lw=0.8)
        labels = [_label(found, i) for i in order]
        axes.set_yticks(place, labels)
        axes.axvline(0, color=GREY, lw=0.5)
        unit = "" if metric.unit == "1" else f" {metric.unit}"
        axes.set_title(f"{metric.name}: {brief(found.base[k])}{unit} now", loc="left")
        axes.set_xlabel(f"change{f' [{metric.unit}]' if unit else ''}")
    sides = [Patch(color=color, label=f"a step {word}") for color, word in _SIDES]
    figure.legend(handles=sides, loc="outside upper right", ncols=2)
    return figure


def shares(found: Indices) -> Figure:
    """Draw the shares of each metric's variance that numbers explain alone, and with others."""
    from matplotlib.figure import Figure

    rows = len(found.metrics)
    figure = Figure(figsize=(1.4 * COLUMN, rows * (0.5 + 0.2 * len(found.names))))
    place = np.arange(len(found.names))[::-1]
    for k, (axes, name) in enumerate(
        zip(figure.subplots(rows, 1, squeeze=False).ravel(), found.metrics, strict=True)
    ):
        for values, width, shift, color, label in (
            (found.first, found.first_width, 0.18, BLUE, "alone"),
            (found.total, found.total_width, -0.18, ORANGE, "with others"),
        ):
            bars = np.nan_to_num(values[:, k])
            errors = np.nan_to_num(width[:, k])
            axes.barh(place + shift, bars, 0.34, xerr=errors, color=color, label=label)
        axes.set_yticks(place, [own.removeprefix("actuators.") for own in found.names])
        axes.set_xlim(0, 1)
        axes.set_xlabel(f"share of the variance of {name}")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def save_indices(found: Indices, file: Path) -> None:
    """Write the figure of indices; errors as `save`."""
    _save(lambda: shares(found), file)


def save(found: Sensitivity, file: Path) -> None:
    """Write the figure.

    Raises:
        DraftError: the file's name has another ending, or it cannot be written.
    """
    _save(lambda: tornado(found), file)


def _save(make: Callable[[], Figure], file: Path) -> None:
    if file.suffix not in FORMATS:
        cause = f"{file} is no picture that can be written"
        raise DraftError(cause, f"end its name with {', '.join(FORMATS)}")
    plotting.save(file.parent, {file.stem: make}, kinds=(file.suffix[1:],))


def _label(found: Sensitivity, i: int) -> str:
    name = found.names[i].removeprefix("actuators.")
    return f"{name} +{found.steps[i]:g} {found.units[i]}".rstrip()
