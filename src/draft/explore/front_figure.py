"""Figure of a search: every pair of goals, with all feasible trials and the front."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from draft.errors import DraftError
from draft.explore.front import Entry, feasible
from draft.explore.optimise import Search
from draft.metrics import find
from draft.plotting import BLUE, COLUMN, GREY
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from optuna.trial import FrozenTrial

QUANTILES = (0.02, 0.98)


def draw(search: Search, trials: Sequence[FrozenTrial], front: Sequence[Entry]) -> Figure:
    """Plot each pair of goals; for a single goal, its best value over the trials.

    Args:
        search: the search, with at least one goal.
        trials: Optuna's finished trials.
        front: from `draft.explore.front.front`.
    """
    from matplotlib import pyplot as plt

    values = np.array([trial.values for trial in feasible(trials)]).reshape(-1, len(search.goals))
    best = np.array([list(one["goals"].values()) for one in front]).reshape(-1, len(search.goals))
    pairs = list(itertools.combinations(range(len(search.goals)), 2))
    if not pairs:
        figure, ax = plt.subplots(figsize=(COLUMN, 0.75 * COLUMN))
        reach = np.minimum if search.goals[0].less else np.maximum
        ax.plot(reach.accumulate(values[:, 0]), color=BLUE)
        ax.set(xlabel="feasible trials", ylabel=_label(search, 0))
        return figure
    columns = min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    size = (COLUMN * (1.0 if columns == 1 else 0.8 * columns), 0.75 * COLUMN * rows)
    figure, axes = plt.subplots(rows, columns, figsize=size, squeeze=False)
    for ax, (i, k) in zip(axes.ravel(), pairs, strict=False):
        ax.plot(values[:, i], values[:, k], ".", color=GREY, alpha=0.35, markersize=2.5)
        ax.plot(best[:, i], best[:, k], "o", color=BLUE, markersize=3.2 if columns == 1 else 1.8)
        ax.set(xlabel=_label(search, i), ylabel=_label(search, k))
        _limits(ax, values[:, (i, k)], best[:, (i, k)])
    for ax in axes.ravel()[len(pairs) :]:
        ax.set_axis_off()
    _legend(axes.ravel()[0], len(values), len(best))
    return figure


def _legend(ax: Axes, feasible: int, best: int) -> None:
    handles = [
        ax.plot([], [], ".", color=GREY, label=f"{feasible} trials that meet the constraints")[0],
        ax.plot([], [], "o", color=BLUE, markersize=3.2, label=f"{best} that no other beats")[0],
    ]
    ax.figure.legend(handles=handles, loc="outside upper center", ncols=2)


def _limits(ax: Axes, values: Array, best: Array) -> None:
    """Show the front and most trials, without the outliers, which would compress the others."""
    if not len(values):
        return
    low, high = np.quantile(values, QUANTILES, axis=0)
    if len(best):
        low, high = np.minimum(low, best.min(axis=0)), np.maximum(high, best.max(axis=0))
    margin = 0.05 * (high - low) + 1e-12
    ax.set_xlim(low[0] - margin[0], high[0] + margin[0])
    ax.set_ylim(low[1] - margin[1], high[1] + margin[1])


def _label(search: Search, i: int) -> str:
    """Label of a goal, with its unit and the better direction."""
    goal = search.goals[i]
    try:
        unit = find(goal.text).unit
    except DraftError:  # an expression
        unit = ""
    shown = f" [{unit}]" if unit not in ("", "1", "bool") else ""
    return f"{goal.text.replace('_', ' ')}{shown}, {'less' if goal.less else 'more'} is better"
