"""Pictures for docs/learning.md.

draft train cheetah --recipe laptop --out RUN
python -m docs.learning_pictures RUN   # docs/images/learning.png, of a training run
python -m docs.learning_pictures       # docs/images/walk.png, of a shipped policy
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from docs.pictures import IMAGES, shrink
from draft.learn.training.progress import read
from draft.learn.training.run import PROGRESS, open_run
from draft.plotting import COLORS

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


def walk(path: Path) -> None:
    """Draw the cheetah's shipped policy, asked to walk at 0.6 m/s."""
    with tempfile.TemporaryDirectory() as scratch:
        outputs = ("--out", f"{scratch}/walk.mp4", "--strip", str(path))
        words = ("--skill", "walk", "--seconds", "3", "--command", "0.6", "0", "0", *outputs)
        subprocess.run([sys.executable, "-m", "draft", "play", "cheetah", *words], check=True)
    shrink(path)


def main(folders: Sequence[str]) -> None:
    """Draw a run's curves, or the walking cheetah."""
    if folders:
        curves(Path(folders[0])).savefig(IMAGES / "learning.png", dpi=160)
    else:
        walk(IMAGES / "walk.png")


if __name__ == "__main__":
    main(sys.argv[1:])
