"""Picture of the robots of a study, side by side at true relative size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from draft.learn.bodies.legged import LeggedRobot
from draft.model.picture import MARGIN, Exhibit, Pixels, axes, corners, draw, stage
from draft.study.report.labels import color
from draft.study.report.records import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GAP = 0.22  # Gap between two robots [m].
VIEW = (90, -6)  # Azimuth and elevation [deg]: from the side, so that lengths are true.
WIDTH = 1500  # Width of the picture [pixels].
PAGE, BELOW = 7.0, 0.38  # Width of the figure, and height of the text below the picture [in].


def exhibits(members: list[LeggedRobot]) -> tuple[list[Exhibit], list[float]]:
    """Return robots in a row along x in their home poses, and the middle of each [m]."""
    found: list[Exhibit] = []
    middles: list[float] = []
    edge = 0.0
    for member in members:
        robot = mujoco.MjSpec.from_string(member.xml)
        free = mujoco.mjtJoint.mjJNT_FREE
        base = next(joint.name for joint in robot.joints if joint.type == free)
        home = dict(zip(member.joints, member.home, strict=True))
        x = corners(*stage([Exhibit(robot, base, member.height, home)]))[:, 0]
        place = (edge - float(x.min()), 0.0)
        found.append(Exhibit(robot, base, member.height, home, place))
        middles.append(edge + float(np.ptp(x)) / 2)
        edge += float(np.ptp(x)) + GAP
    return found, middles


def render(members: list[LeggedRobot]) -> tuple[Pixels, list[float], float]:
    """Render robots.

    Returns:
        Pixels, shape (height, width, 3); the middle of each robot [pixels]; and pixels per metre.

    Raises:
        DraftError: MuJoCo cannot draw on this machine.
    """
    shown, middles = exhibits(members)
    seen = corners(*stage(shown))
    width, height = np.ptp(seen[:, 0]), np.ptp(seen[:, 2]) + 0.1 * np.ptp(seen[:, 1])
    size = (WIDTH, int(WIDTH * min(1.0, max(0.25, 1.06 * height / width))))
    image = draw(shown, VIEW, size, flat=True)
    # The camera shows MARGIN times the larger extent; see `draft.model.picture`.
    tall = max(width * size[1] / size[0], float(np.ptp(seen @ axes(VIEW)[1])))
    scale = size[1] / (MARGIN * tall)
    centre = (seen[:, 0].min() + seen[:, 0].max()) / 2
    return image, [size[0] / 2 + (x - centre) * scale for x in middles], scale


def figure(study: Study, image: Pixels, middles: list[float], scale: float) -> Figure:
    """Draw the picture with names, leg lengths, masses and a scale bar."""
    from matplotlib import pyplot as plt

    tall = PAGE * image.shape[0] / image.shape[1]
    made = plt.figure(figsize=(PAGE, tall + BELOW))
    ax = made.add_axes((0, BELOW / (tall + BELOW), 1, tall / (tall + BELOW)))
    ax.imshow(image)
    ax.set_axis_off()
    height = image.shape[0]
    for (design, member), x in zip(study.members.items(), middles, strict=True):
        ax.text(
            x,
            height + 12,
            study.titles[design],
            color=color(study, design),
            fontsize=9,
            fontweight="bold",
            ha="center",
            va="top",
        )
        words = f"L = {member.leg_length:.2f} m, {member.mass:.0f} kg"
        ax.text(x, height + 46, words, color="0.3", fontsize=7.5, ha="center", va="top")
    length = 1.0 if scale < image.shape[1] / 3 else 0.25
    left, low = 0.015 * image.shape[1], 0.06 * height
    ax.plot([left, left + length * scale], [low, low], color="0.3", linewidth=1.2)
    ax.text(left, low + 14, f"{length:g} m", color="0.3", fontsize=7.5, va="top")
    made.set_layout_engine("none")
    return made
