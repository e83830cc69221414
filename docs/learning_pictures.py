"""Pictures of a training run for docs/learning.md.

draft train cheetah --recipe laptop --out RUN
python -m docs.learning_pictures RUN   # docs/images/learning.png and walk.png
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from draft.learn.progress import read
from draft.learn.run import PROGRESS, open_run
from draft.plotting import COLORS

IMAGES = Path(__file__).parent / "images"
CURVES = (
    ("reward", "reward [1/s]"),
    ("tracking_error", "tracking error [m/s]"),
    ("reward/linear_velocity", "reward for tracking vx, vy [1/s]"),
)
SMOOTH = 15  # iterations


def curves(folder: Path) -> Figure:
    """Reward and tracking over the steps of training."""
    plan = open_run(folder).plan
    rows = read(folder / PROGRESS)
    steps = np.array([row["iteration"] for row in rows])
    steps *= plan.environments * plan.config.learning.steps / 1e6
    figure = Figure(figsize=(9.0, 2.6), layout="constrained")
    for ax, (name, label), color in zip(figure.subplots(1, 3), CURVES, COLORS, strict=False):
        values = np.array([row[name] for row in rows])
        ax.plot(steps, values, color=color, alpha=0.25, linewidth=0.8)
        mean = np.convolve(values, np.ones(SMOOTH) / SMOOTH, mode="valid")
        ax.plot(steps[SMOOTH - 1 :], mean, color=color, linewidth=1.6)
        ax.set_xlabel("environment steps [million]")
        ax.set_ylabel(label)
        ax.spines[["top", "right"]].set_visible(False)
    return figure


def main(folder: Path) -> None:
    """Draw a run's curves, and its policy asked to walk at 0.6 m/s."""
    curves(folder).savefig(IMAGES / "learning.png", dpi=160)
    strip = ("--seconds", "4", "--command", "0.6", "0", "0", "--strip", str(IMAGES / "walk.png"))
    subprocess.run([sys.executable, "-m", "draft", "play", str(folder), *strip], check=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
