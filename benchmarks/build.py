"""How fast a robot is compiled, resolved in batches, and built from the command line.

`python -m benchmarks.build` prints a table and writes `benchmarks/results/build.json`. Times of one
machine say little about another's, so the bars are ratios to what MuJoCo itself takes to load the
same text in the same run, except where a person waits.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import itertools
import resource
import statistics
import subprocess
import sys
import tempfile
import time
import tracemalloc
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import draft
from benchmarks.rows import measured, publish, timed

REPEATS = 60
BATCH = 100_000
# robot -> the parameter that is edited, and values that it takes in turn
EDITED = {"quadruped": ("thigh_length", 0.25), "humanoid": ("thigh_length", 0.20)}


def main() -> None:
    """Measure everything, print a table and write it as JSON."""
    rows = [row for robot in EDITED for row in rebuild(robot)]
    publish("build", [*rows, first_use("humanoid"), *batch("quadruped"), *command_line()])


def rebuild(robot: str) -> list[dict[str, Any]]:
    """One parameter changed, to MjModel, MJCF text and verdict, against MuJoCo's load of the text.

    The two alternate, so that both see the machine in the same state.
    """
    spec = draft.load(robot)
    name, value = EDITED[robot]
    steps = itertools.count()
    ours: list[float] = []
    theirs: list[float] = []
    for _ in range(REPEATS + 10):
        edited = {name: value * (1 + 1e-4 * (1 + next(steps)))}
        seconds, model = timed(lambda edited=edited: spec.resolve(edited).build())
        ours.append(seconds)
        text = model.xml
        theirs.append(timed(lambda text=text: mujoco.MjModel.from_xml_string(text))[0])
    build, load = statistics.median(ours[10:]), statistics.median(theirs[10:])
    return [
        measured(f"{robot}: MuJoCo loads the text", load * 1e3, "ms"),
        measured(f"{robot}: edit to checked model", build * 1e3, "ms"),
        measured(f"{robot}: edit / MuJoCo's load", build / load, "x", 3.0),
    ]


def first_use(robot: str) -> dict[str, Any]:
    """Files on disk to model on disk, the first time in a process, imports done before."""
    code = (
        "import time, draft, draft.spec, draft.model, draft.model.folder\n"
        "import sys\n"
        "start = time.perf_counter()\n"
        f"draft.load({robot!r}).resolve().build().save(sys.argv[1])\n"
        "print(time.perf_counter() - start)\n"
    )
    times = []
    for _ in range(7):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-c", code, str(Path(folder) / "model")]
            output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            times.append(float(output))
    return measured(f"{robot}: first use, disk to disk", statistics.median(times) * 1e3, "ms", 60.0)


def batch(robot: str) -> list[dict[str, Any]]:
    """N designs at once around the default: designs a second on one core, memory of each."""
    spec = draft.load(robot)
    random = np.random.default_rng(0)
    values: dict[str, Any] = {
        name: parameter.value.constant * random.uniform(0.8, 1.25, BATCH)
        for name, parameter in spec.parameters.items()
        if parameter.value.constant is not None
    }
    for quantity in ("peak_torque", "no_load_speed", "gear_ratio"):
        stated = spec.actuators["leg"].stated[quantity].constant or 1.0
        values[f"actuators.leg.{quantity}"] = stated * random.uniform(0.8, 1.25, BATCH)
    spec.resolve(values)
    start = time.process_time()
    for _ in range(5):
        spec.resolve(values)
    seconds = (time.process_time() - start) / 5
    tracemalloc.start()
    design = spec.resolve(values)
    held, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    varied = f"{robot}: batch of {BATCH:,}, {len(values)} quantities varied"
    return [
        measured(f"{varied}, designs/s of CPU", BATCH / seconds, "", 100_000, at_least=True),
        measured(f"{robot}: memory held", held / BATCH, "B/design", 2000),
        measured(f"{robot}: memory at the peak", peak / BATCH, "B/design", 2000),
        measured(f"{robot}: accepted of the batch", 100 * float(np.mean(design.accepted)), "%"),
    ]


def command_line() -> list[dict[str, Any]]:
    """What a person waits for, process start included."""
    draft_command = [sys.executable, "-m", "draft"]
    with tempfile.TemporaryDirectory() as folder:
        build = [*draft_command, "build", "quadruped", "--out", str(Path(folder) / "model")]
        wall = statistics.median(timed(lambda: run(build))[0] for _ in range(7))
    cpu = statistics.median(cpu_seconds([*draft_command, "--help"]) for _ in range(7))
    return [
        measured("draft --help, CPU", cpu, "s", 0.25),
        measured("draft build quadruped, wall", wall, "s", 1.0),
    ]


def run(command: list[str]) -> None:
    subprocess.run(command, check=True, capture_output=True)


def cpu_seconds(command: list[str]) -> float:
    """CPU seconds of a child process, user and system."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(command)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
