"""Pictures of the shipped robots, for the README and for a look from every side.

python -m docs.pictures                 # docs/images/quadrupeds.png and robots.png
python -m docs.pictures --sides out     # every robot and design from four sides
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

import draft
from draft.offscreen import prefer_offscreen

prefer_offscreen()  # before MuJoCo is imported

from draft.model.picture import Exhibit, Pixels, View, corners, draw, exhibit, stage  # noqa: E402
from draft.spec.load import shipped  # noqa: E402
from draft.study.report import figures  # noqa: E402

IMAGES = Path(__file__).resolve().parent / "images"
# A robot of a row turns this far from the camera [rad], and stands this far from the next [m].
TURN = 0.80
GAP = 0.10
# Pictures of robots have more colours than figures.
shrink = partial(figures.shrink, tints=256)
ROW: View = (180, -12)
SIDES: dict[str, View] = {
    "front": (180, 0),
    "side": (90, 0),
    "top": (90, -90),
    "corner": (135, -20),
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the pictures."""
    parser = argparse.ArgumentParser(
        prog="python -m docs.pictures", description="Draw the shipped robots."
    )
    parser.add_argument(
        "--sides", type=Path, help="draw each robot from four sides, to this folder"
    )
    options = parser.parse_args(arguments)
    if options.sides is not None:
        sides(options.sides)
        return
    quadruped = draft.load("quadruped")
    designs = [quadruped.resolve(name) for name in ("cheetah", "bear", "giraffe")]
    row([design.build() for design in designs], IMAGES / "quadrupeds.png")
    robots = [draft.load(name).resolve() for name in ("hopper", "quadruped", "humanoid")]
    row([design.build() for design in robots], IMAGES / "robots.png", (1200, 800))


def row(
    models: Sequence[draft.Model],
    path: Path,
    size: tuple[int, int] = (1600, 800),
) -> None:
    """Draw models side by side on one floor, at true relative size."""
    _save(draw(line_up(models), ROW, size), path)


def line_up(models: Iterable[draft.Model], gap: float = GAP) -> list[Exhibit]:
    """Exhibits of models side by side, turned from the camera, with a gap between two [m]."""
    edge = 0.0
    exhibits = []
    for model in models:
        y = corners(*stage([exhibit(model, yaw=TURN)]))[:, 1]
        exhibits.append(exhibit(model, (0, edge - float(y.min())), TURN))
        edge += float(np.ptp(y)) + gap
    return exhibits


def sides(folder: Path) -> None:
    """Draw every shipped robot and design from the front, the side, the top and a corner."""
    for name in shipped():
        spec = draft.load(name)
        for label in (None, *spec.designs):
            model = spec.resolve(label or {}).build()
            views = [
                draw([exhibit(model)], view, (800, 800), flat=side != "corner")
                for side, view in SIDES.items()
            ]
            sheet = np.vstack([np.hstack(views[:2]), np.hstack(views[2:])])
            _save(sheet, folder / (f"{name}_{label}.png" if label else f"{name}.png"))


def _save(pixels: Pixels, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels).save(path)
    shrink(path)
    print(f"{path}  {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
