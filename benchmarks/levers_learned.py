"""Effects on a learned metric: how fast they are found, and how right they are.

`python -m benchmarks.levers_learned` prints a table and writes
`benchmarks/results/levers_learned.json`. The effects beyond their intervals are held against
evaluations with more roll-outs, of another seed, which have draws of their own for each body. It
takes a quarter of an hour; speeds hold for two idle cores, and the load is printed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Annotated

import numpy as np
import tyro

import draft
from benchmarks.rows import measured, publish, timed
from draft.design import Design
from draft.explore.sensitivity import stated_numbers
from draft.learn.measuring.evaluation import setting
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.learned_metrics import of_body, roll_outs, walkers
from draft.learn.measuring.levels import SPEED
from draft.learn.measuring.policies import open_source
from draft.values import Array, Value

METRIC, TARGET = "learned.top_speed", "learned.top_speed >= 4.25"
NUMBERS = 10


def main(
    robot: Annotated[str, tyro.conf.arg(help="Design of the quadruped.")] = "cheetah",
    rollouts: Annotated[int, tyro.conf.arg(help="Roll-outs of an evaluation.")] = 256,
    replicas: Annotated[int, tyro.conf.arg(help="Roll-outs of a sensitivity.")] = 12,
) -> None:
    """Measure everything, print a table and write it as JSON."""
    design = draft.load("quadruped").resolve(robot)
    by = list(stated_numbers(design))[-NUMBERS:]
    before = os.getloadavg()[0]
    command = [sys.executable, "-m", "draft", "sensitivity", robot, "--of", METRIC, "--by", *by]
    command += ["--replicas", str(replicas)]
    seconds, _ = timed(lambda: subprocess.run(command, capture_output=True, check=True))
    rows = [
        measured(f"draft sensitivity {robot} --of {METRIC}, {NUMBERS} numbers", seconds, "s", 60)
    ]
    found = draft.sensitivity(design, [METRIC], by, replicas=replicas)
    sides = (
        (found.step_up, found.low, found.high),
        (found.step_down, found.down_low, found.down_high),
    )
    ranked = [
        (i, sign, float(change[i, 0]))
        for sign, (change, low, high) in zip((1, -1), sides, strict=True)
        for i in range(len(by))
        if low[i, 0] > 0 or high[i, 0] < 0
    ]
    values = np.tile(found.values, (1 + len(ranked), 1))
    for row, (i, sign, _) in enumerate(ranked, start=1):
        values[row, i] += sign * found.steps[i]
    arrays: dict[str, Value] = {name: values[:, i] for i, name in enumerate(by)}
    many = design.spec.resolve(design.values, arrays)
    speeds = _evaluated(many, rollouts)
    right = [np.sign(speeds[k] - speeds[0]) == np.sign(x) for k, (*_, x) in enumerate(ranked, 1)]
    for (i, sign, change), speed in zip(ranked, speeds[1:], strict=True):
        print(f"{by[i]} {sign * found.steps[i]:+g}: {change:+.3f}, {speed - speeds[0]:+.3f} m/s")
    share = 100 * float(np.mean(right))
    what = f"signs of {len(ranked)} ranked effects that are right"
    rows.append(measured(what, share, "%", 95, at_least=True))
    seconds, solved = timed(lambda: draft.solve(design, [TARGET, "mass <= 36"]))
    rows.append(measured(f"draft solve {robot} {TARGET!r}", seconds, "s", 60))
    speed = float(_evaluated(solved.design, rollouts)[0])
    rows.append(measured("top speed of the solution", speed, "m/s", 4.25, at_least=True))
    publish("levers_learned", rows, load=f"{before:.1f} before, {os.getloadavg()[0]:.1f} after")


def _evaluated(design: Design, rollouts: int) -> Array:
    """Top speeds by roll-outs of another seed, with draws of their own for each body [m/s]."""
    source = open_source(None)
    members, _ = walkers(source, design, None)
    asked = BodyRollOuts.of({"replicas": rollouts, "seed": 1})
    rolled = roll_outs(
        source, tuple(members.values()), *setting("auto", "auto"), asked, tests=[SPEED]
    )
    return np.array(
        [of_body(*one, source.forward_for(one[0])).numbers["top_speed"] for one in rolled]
    )


if __name__ == "__main__":
    tyro.cli(main)
