"""A search in one figure: every pair of goals, all sound trials and the front among them.

In the style of `draft.plotting`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.errors import DraftError
from draft.explore.front import sound
from draft.explore.optimise import Search
from draft.metrics import find
from draft.plotting import BLUE, COLUMN, GREY

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHARE = (0.02, 0.98)


def draw(search: Search, trials: Sequence[Any], front: Sequence[dict[str, Any]]) -> Figure:
    """Scatter each pair of goals; of a single goal, its best value by trial.

    Args:
        search: the search, with at least one goal.
        trials: Optuna's finished trials.
        front: from `draft.explore.front.front`.
    """
    from matplotlib import pyplot as plt

    values = np.array([trial.values for trial in sound(trials)]).reshape(-1, len(search.goals))
    best = np.array([list(one["goals"].values()) for one in front]).reshape(-1, len(search.goals))
    pairs = list(itertools.combinations(range(len(search.goals)), 2))
    if not pairs:
        figure, ax = plt.subplots(figsize=(COLUMN, 0.75 * COLUMN))
        reach = np.minimum if search.goals[0].less else np.maximum
        ax.plot(reach.accumulate(values[:, 0]), color=BLUE)
        ax.set(xlabel="sound trials", ylabel=_words(search, 0))
        return figure
    wide = min(len(pairs), 3)
    rows = -(-len(pairs) // wide)
    size = (COLUMN * (1.0 if wide == 1 else 0.8 * wide), 0.75 * COLUMN * rows)
    figure, axes = plt.subplots(rows, wide, figsize=size, squeeze=False)
    for ax, (i, k) in zip(axes.ravel(), pairs, strict=False):
        ax.plot(values[:, i], values[:, k], ".", color=GREY, alpha=0.35, markersize=2.5)
        ax.plot(best[:, i], best[:, k], "o", color=BLUE, markersize=3.2 if wide == 1 else 1.8)
        ax.set(xlabel=_words(search, i), ylabel=_words(search, k))
        _limits(ax, values[:, (i, k)], best[:, (i, k)])
    for ax in axes.ravel()[len(pairs) :]:
        ax.set_axis_off()
    _legend(axes.ravel()[0], len(values), len(best))
    return figure


def _legend(ax: Any, sound: int, best: int) -> None:
    handles = [
        ax.plot([], [], ".", color=GREY, label=f"{sound} trials that meet the constraints")[0],
        ax.plot([], [], "o", color=BLUE, markersize=3.2, label=f"{best} that no other beats")[0],
    ]
    ax.figure.legend(handles=handles, loc="outside upper center", ncols=2)


def _limits(ax: Any, values: np.ndarray, best: np.ndarray) -> None:
    """Show the front and most trials; a few far ones must not press the rest together."""
    if not len(values):
        return
    low, high = np.quantile(values, SHARE, axis=0)
    if len(best):
        low, high = np.minimum(low, best.min(axis=0)), np.maximum(high, best.max(axis=0))
    room = 0.05 * (high - low) + 1e-12
    ax.set_xlim(low[0] - room[0], high[0] + room[0])
    ax.set_ylim(low[1] - room[1], high[1] + room[1])


def _words(search: Search, i: int) -> str:
    """A goal with its unit, and which way is better."""
    goal = search.goals[i]
    try:
        unit = find(goal.text).unit
    except DraftError:  # an expression
        unit = ""
    shown = f" [{unit}]" if unit not in ("", "1", "bool") else ""
    return f"{goal.text.replace('_', ' ')}{shown}, {'less' if goal.less else 'more'} is better"
