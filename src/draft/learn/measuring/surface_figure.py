"""Figure of a surface: capabilities over the plane, refusals, and the region of validity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from draft.metrics.capabilities import MEASURED
from draft.plotting import COLORS, COLUMN
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from draft.learn.measuring.surface import Surface

_REFUSED, _FELL = "#d9d9d9", "white"


def draw(found: Surface) -> Figure:
    """Draw top speed, kick, cost of transport and limiting joint over the plane."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(2 * COLUMN, 1.6 * COLUMN), sharex=True, sharey=True)
    for ax, (name, one) in zip(axes.ravel(), MEASURED.items(), strict=False):
        _refused(ax, found)
        mesh = ax.pcolormesh(*_edges(found), _map(found, getattr(found.learned, name)))
        figure.colorbar(mesh, ax=ax)
        ax.set_title(f"{one.label} [{one.unit}]")
        _outside(ax, found)
    _limiting(axes[1, 1], found)
    labels = [
        axis.rpartition(".")[2].replace("_", " ") + (f" [{unit}]" if unit else "")
        for axis, unit in zip(found.axes, found.units, strict=True)
    ]
    for ax in axes[1]:
        ax.set_xlabel(labels[0])
    for ax in axes[:, 0]:
        ax.set_ylabel(labels[1])
    figure.suptitle(
        f"{found.robot}. Grey: refused by the filter. White: falls. Crosses: outside the "
        "policy's region of validity.",
        fontsize=7,
    )
    return figure


def _map(found: Surface, values: Array) -> Array:
    """Values with the first axis to the right and the second upwards."""
    return np.ma.masked_invalid(found.grid(values).T)


def _edges(found: Surface) -> tuple[Array, Array]:
    """Edges of the cells along both axes."""
    first, second = (_between(values) for values in found.values)
    return first, second


def _between(values: Array) -> Array:
    middle = (values[1:] + values[:-1]) / 2
    first, last = values[0] - (middle[0] - values[0]), values[-1] + (values[-1] - middle[-1])
    return np.array([first, *middle, last])


def _refused(ax: Axes, found: Surface) -> None:
    from matplotlib.colors import ListedColormap

    refused = np.array([float(bool(text)) for text in found.refusal])
    colors = ListedColormap([_FELL, _REFUSED])
    ax.pcolormesh(*_edges(found), _map(found, refused), cmap=colors, vmin=0, vmax=1)


def _outside(ax: Axes, found: Surface) -> None:
    """Mark measured designs outside the region of validity."""
    measured = np.array([not text for text in found.refusal])
    first, second = np.meshgrid(*found.values, indexing="ij")
    rows = measured & ~found.learned.inside
    ax.plot(first.ravel()[rows], second.ravel()[rows], "x", color="black", markersize=2, mew=0.4)


def _limiting(ax: Axes, found: Surface) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    _refused(ax, found)
    names = sorted({text for text in found.learned.limiting if text})
    codes = [float(names.index(t)) if t else np.nan for t in found.learned.limiting]
    colors = [COLORS[i % len(COLORS)] for i in range(len(names))]
    ax.set_title("joint nearest its limit at top speed")
    if names:
        options = {"cmap": ListedColormap(colors), "vmin": -0.5, "vmax": len(names) - 0.5}
        ax.pcolormesh(*_edges(found), _map(found, np.array(codes)), **options)
        handles = [Patch(color=c, label=n) for c, n in zip(colors, names, strict=True)]
        ax.legend(handles=handles, loc="upper right", frameon=True, edgecolor="none")
    _outside(ax, found)
