"""How well does the policy that ships walk published quadrupeds whose descriptions are imported?

    python -m benchmarks.imported FOLDER     # of descriptions, with a manifest.csv

Every quadruped of the manifest is imported, with the masses that Draft predicts, and walks at 0.25,
0.5 and 1 sqrt(g L), from four starts each, in plain MuJoCo. It prints the mean speeds over the last
6 of 9 s in units of sqrt(g L) and the falls, or why the policy does not drive the robot; some
2 minutes of CPU time and as much for the imports.
"""

from __future__ import annotations

import csv
import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from draft.errors import DraftError
from draft.imports.importer import import_robot
from draft.learn.policy.validity import Fit, fit
from draft.learn.policy.walk import Walk
from draft.metrics import of_design
from draft.model import Model
from draft.model.model import preview
from draft.values import scalar

COMMANDS = (0.25, 0.5, 1.0)  # [sqrt(g L)]
STARTS, SECONDS, SETTLING = 4, 9.0, 3.0
GRAVITY = 9.81


@dataclass(frozen=True)
class Row:
    """What one robot does.

    Attributes:
        name: name of the robot.
        speeds: mean speed at each command [sqrt(g L)]; () if no policy drives it.
        falls: falls of all roll-outs.
        words: what lies outside the policy's region, or why no policy drives it.
    """

    name: str
    speeds: tuple[float, ...]
    falls: int
    words: str


def main(folder: tyro.conf.Positional[str], /, robots: tuple[str, ...] = ()) -> None:
    """Import, roll out and print.

    Args:
        folder: folder of the descriptions.
        robots: keys of the manifest; all quadrupeds of a survey by default.
    """
    with (Path(folder) / "manifest.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["population"] == "quadruped"]
    chosen = [row for row in rows if row["key"] in robots or not robots]
    for row in chosen:
        if row["file"].startswith("survey/"):
            _print(measured(row["key"], Path(folder) / row["file"]))


def measured(name: str, description: Path) -> Row:
    """Import a robot and let it walk."""
    with tempfile.TemporaryDirectory() as place:
        model = preview(import_robot(description, out=Path(place) / name).spec.resolve())
    try:
        found = fit(model, "run")
    except DraftError as error:
        return Row(name, (), 0, error.problems[0].cause)
    unit = math.sqrt(GRAVITY * scalar(of_design(model.design, ["leg_length"])["leg_length"]))
    speeds, falls = [], 0
    for command in COMMANDS:
        walks = [_walked(model, found, command * unit, seed) for seed in range(STARTS)]
        speeds.append(float(np.mean([speed for speed, _ in walks])) / unit)
        falls += sum(fallen for _, fallen in walks)
    return Row(name, tuple(speeds), falls, found.warning)


def _walked(model: Model, found: Fit, command: float, seed: int) -> tuple[float, int]:
    """Mean speed of a roll-out [m/s], and its falls."""
    walk = Walk(model, found, (command, 0.0, 0.0), seed)
    walk.advance(SETTLING)
    start = walk.data.qpos[:2].copy()
    walk.advance(SECONDS - SETTLING)
    way = float(np.linalg.norm(walk.data.qpos[:2] - start))
    return way / (SECONDS - SETTLING), walk.falls


def _print(row: Row) -> None:
    speeds = " ".join(f"{speed:.2f}" for speed in row.speeds)
    print(f"{row.name}: {speeds}, {row.falls} falls; {row.words}" if speeds else row.words)


if __name__ == "__main__":
    tyro.cli(main)
