"""Figure of sensitivities: for each metric a bar for a step of each number, longest first."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from draft import plotting
from draft.errors import DraftError
from draft.explore.sensitivity import Sensitivity
from draft.metrics import find
from draft.plotting import BLUE, COLUMN, GREY, ORANGE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".png", ".pdf", ".svg")
_MOST = 10  # Numbers of a panel.
_SIDES = ((BLUE, "more"), (ORANGE, "less"))


def tornado(found: Sensitivity) -> Figure:
    """Draw the changes of metrics for a step more (blue) and a step less (orange) of each number.

    Black lines are the 90 % bands over the errors of the laws, for a step more.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    columns = min(2, len(found.metrics))
    rows = -(-len(found.metrics) // columns)
    count = min(_MOST, int((~found.still).sum()))
    figure = Figure(figsize=(columns * COLUMN, rows * (0.55 + 0.17 * max(count, 1))))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in panels[len(found.metrics) :]:
        axes.axis("off")
    for k, (axes, name) in enumerate(zip(panels, found.metrics, strict=False)):
        metric = find(name)
        size = np.fmax(abs(found.step_up[:, k]), abs(found.step_down[:, k]))
        order = [i for i in np.argsort(-np.nan_to_num(size), kind="stable") if size[i] > 0]
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
        unit = "" if metric.unit == "1" else f" [{metric.unit}]"
        axes.set_xlabel(f"change of {metric.name}{unit}, now {found.base[k]:.3g}")
    sides = [Patch(color=color, label=f"a step {word}") for color, word in _SIDES]
    figure.legend(handles=sides, loc="outside upper right", ncols=2)
    return figure


def save(found: Sensitivity, file: Path) -> None:
    """Write the figure.

    Raises:
        DraftError: the file's name has another ending, or it cannot be written.
    """
    if file.suffix not in FORMATS:
        cause = f"{file} is no picture that can be written"
        raise DraftError(cause, f"end its name with {', '.join(FORMATS)}")
    plotting.save(file.parent, {file.stem: lambda: tornado(found)}, kinds=(file.suffix[1:],))


def _label(found: Sensitivity, i: int) -> str:
    name = found.names[i].removeprefix("actuators.")
    return f"{name} +{found.steps[i]:g} {found.units[i]}".rstrip()
