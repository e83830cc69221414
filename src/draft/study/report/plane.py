"""Figures of torque and speed of the joints per limit, with the line of the motor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.laws.torque_speed import Line, torque_speed
from draft.learn.bodies.legged import CLASSES, LeggedRobot
from draft.learn.measuring.utilisation import CELL, CELLS
from draft.study.report.labels import color, halo
from draft.study.report.occupancy import Use, Utilisation
from draft.study.report.records import Study
from draft.study.report.spread import few
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

# End of the axes, per limit.
TOP = 1.28
# Shares of the samples in a cell, palest and darkest.
SHARES = (1e-4, 1e-1)
TICKS = (0, 0.5, 1)


def figure(study: Study, test: str, found: Mapping[str, Use], wide: float) -> Figure:
    """Draw the planes of a skill test: a row for each design, a column for each joint class.

    Args:
        study: the study.
        test: name of the test.
        found: utilisation of the designs to draw, see `shown`.
        wide: width of the figure [in].
    """
    from matplotlib import pyplot as plt

    size = (wide, 0.36 * wide * len(found) + 0.2)
    shape: dict[str, Any] = {"sharex": True, "sharey": True, "squeeze": False}
    figure, axes = plt.subplots(len(found), len(CLASSES), figsize=size, **shape)
    for row, (design, use) in zip(axes, found.items(), strict=True):
        _row(row, use, study.members[design], color(study, design))
        row[0].set_ylabel("|torque| per peak torque")
        title = f"{study.titles[design]}: {_described(test, use)}"
        row[0].set_title(title, loc="left", fontweight="bold", pad=12)
        for ax, joint in zip(row, CLASSES, strict=True):
            ax.annotate(joint, (0, 1.03), xycoords="axes fraction", color="0.3")
    figure.supxlabel("|speed| per no-load speed", fontsize=7)
    return figure


def shown(study: Study, used: Utilisation, test: str) -> dict[str, Use]:
    """Return the utilisation of the designs with counts in a test."""
    found = {design: used.of(design, test) for design in study.titles}
    return {design: use for design, use in found.items() if use and use.samples.plane}


def _row(axes: Sequence[Axes], use: Use, robot: LeggedRobot, tint: str) -> None:
    """Draw one plane for each joint class."""
    for ax, joint in zip(axes, CLASSES, strict=True):
        _limits(ax)
        for line in _lines(robot, joint):
            ax.plot(*zip(*line, strict=True), color="0.2", linewidth=0.8, zorder=3)
        if joint in use.samples.plane:
            _density(ax, use.samples.plane[joint], _shades(tint))
        _percentiles(ax, joint, use)


def _described(test: str, use: Use) -> str:
    """Return test and levels, in words."""
    level = few(set(use.levels))
    return {
        "speed": f"sprint at {level} m/s",
        "ascent": f"stairs up, {level} m",
        "descent": f"stairs down, {level} m",
        "walk": f"walk at {level} m/s",
        "push": f"kicks of {level} m/s",
    }[test]


def _shades(tint: str) -> Colormap:
    """Return a colour map from nearly white over a colour to nearly black."""
    from matplotlib.colors import LinearSegmentedColormap, to_rgb

    full = np.array(to_rgb(tint))
    steps = [0.16 * full + 0.84, full, 0.35 * full]
    return LinearSegmentedColormap.from_list("samples", list(zip((0, 0.65, 1), steps, strict=True)))


def _density(ax: Axes, cells: Array, shades: Colormap) -> None:
    """Draw shares of the samples by torque and speed; the open last cells are off the axes."""
    from matplotlib.colors import LogNorm

    share = np.ma.masked_less(cells / cells.sum(), SHARES[0])
    ax.imshow(
        share,
        cmap=shades,
        norm=LogNorm(*SHARES, clip=True),
        origin="lower",
        extent=(0, CELLS * CELL, 0, CELLS * CELL),
        interpolation="nearest",
    )


def _percentiles(ax: Axes, joint: str, use: Use) -> None:
    """Draw 95th percentiles: of torque and speed at their axes, of their sum as text."""
    torque, speed, both = (use.shares.get((joint, q)) for q in ("torque", "speed", "sum"))
    mark: dict[str, Any] = {"color": "0.1", "clip_on": False, "markersize": 4, "linestyle": "none"}
    if torque is not None:
        ax.plot(0, torque, marker=5, **mark)
    if speed is not None:
        ax.plot(speed, 0, marker=6, **mark)
    if both is not None:
        limit = use.limiting
        limits = limit is not None and limit.near and limit.joint == joint
        weight = "bold" if limits else "normal"
        words = f"Σ {both:.2f}"
        at = (0.96, 0.95)
        style: dict[str, Any] = {"ha": "right", "va": "top", "path_effects": halo()}
        ax.annotate(words, at, xycoords="axes fraction", fontweight=weight, **style)


def _lines(robot: LeggedRobot, joint: str) -> set[Line]:
    """Torque-speed lines of the motors of a joint class, as shares of their limits."""
    corners = robot.corner_speed or (0.0,) * len(robot.joints)
    shares = [corner / speed for corner, speed in zip(corners, robot.no_load_speed, strict=True)]
    classes = zip(robot.joint_classes, shares, strict=True)
    return {torque_speed(1.0, 1.0, at) for k, at in classes if robot.classes[k] == joint}


def _limits(ax: Axes) -> None:
    """Draw the limits of torque and speed."""
    for line in (ax.axvline, ax.axhline):
        line(1, color="0.85", linewidth=0.6, zorder=0)
    ax.set_xlim(0, TOP)
    ax.set_ylim(0, TOP)
    ax.set_aspect("equal")
    ax.set_xticks(TICKS, [f"{x:g}" for x in TICKS])
    ax.set_yticks(TICKS, [f"{x:g}" for x in TICKS])
