"""How fast designs are screened, compiled, swept and searched, and how much memory that takes.

`python -m benchmarks.explore` prints a table and writes `benchmarks/results/explore.json`; with
`--ray` it also starts a small Ray cluster on this machine and runs the sweep on it. Rates of one
machine say little about another's: the bars hold for two cores.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import draft
from benchmarks.rows import measured, publish, timed
from draft.explore.engines import Engine, LocalEngine, RayEngine
from draft.explore.job import Job, make
from draft.explore.settings import Sampled
from draft.explore.sweep import chunk, run_sweep
from tests.fixed import ARM

VARY = (
    "thigh_length=0.2:0.7",
    "shank_length=0.2:0.7",
    "trunk_length=0.3:1.0",
    "actuators.leg.peak_torque=40:500:log",
)
VARY_ARM = (
    "upper_arm_length=0.2:0.8",
    "forearm_length=0.2:0.8",
    "actuators.large.peak_torque=50:300:log",
    "actuators.small.peak_torque=10:80:log",
)
BUILT = ("thigh_length=0.2:0.3", "shank_length=0.2:0.3", "trunk_length=0.4:0.6")
FAMILY = ("thigh_length=0.2:0.3", "shank_length=0.2:0.3", "trunk_length=0.4:0.6")
BODIES = 4096
SCREENED, SWEPT, TRIALS = 1_000_000, 20_000, 2_000
COMPILED = 20_000
ROUNDS = 5


def main() -> None:
    """Measure everything, print a table and write it as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            *compiles(),
            *families(),
            *screens(Path(folder)),
            *arms(Path(folder)),
            *sweeps(Path(folder)),
            *searches(Path(folder)),
        ]
    publish("explore", rows)


def screens(folder: Path) -> list[dict[str, Any]]:
    """A million quadrupeds from the command line: closed-form metrics, filter, one file."""
    where = ["--where", "mass < 40 and accepted"]
    arguments = ["screen", "quadruped", "--vary", *VARY, "--n", str(SCREENED), *where]
    seconds, memory = watched([*arguments, "--out", str(folder / "screen.parquet")])
    return [
        measured(f"screen of {SCREENED:,}, start to file", seconds, "s", 5.0),
        measured("screen, designs/s", SCREENED / seconds, "", SCREENED / 5, at_least=True),
        measured("screen, memory of all processes at the peak", memory / 1e6, "MB", 2000),
    ]


def arms(folder: Path) -> list[dict[str, Any]]:
    """A million arms of six joints by reach and payload, from the command line."""
    robot = folder / "arm"
    robot.mkdir()
    for name, text in ARM.items():
        (robot / name).write_text(text, encoding="utf-8")
    where = ["--where", "reach > 0.8 and payload_peak > 5"]
    metrics = ["--metrics", "reach", "payload_peak", "payload_rated"]
    arguments = ["screen", str(robot), "--vary", *VARY_ARM, "--n", str(SCREENED), *where, *metrics]
    seconds, memory = watched([*arguments, "--out", str(folder / "arms.parquet")])
    return [
        measured(f"screen of {SCREENED:,} arms by reach and payload", seconds, "s", 8.0),
        measured("the same, memory of all processes at the peak", memory / 1e6, "MB", 2000),
    ]


def compiles() -> list[dict[str, Any]]:
    """Fields of compiled quadrupeds, by arrays and one by one in turns; CPU time of one core."""
    spec = draft.load("quadruped")
    random = np.random.default_rng(0)
    values: dict[str, Any] = {
        name: parameter.value.constant * random.uniform(0.9, 1.1, COMPILED)
        for name, parameter in spec.parameters.items()
        if parameter.value.constant is not None
    }
    for quantity in ("peak_torque", "no_load_speed", "gear_ratio", "damping", "friction_loss"):
        stated = spec.actuators["leg"].stated[quantity].constant or 1.0
        values[f"actuators.leg.{quantity}"] = stated * random.uniform(0.95, 1.05, COMPILED)
    design = spec.resolve(values)
    together, alone = [], []
    for number in range(ROUNDS):
        together.append(_cpu(design.build_batch) / COMPILED)
        one = [design[100 * number + i] for i in range(20)]
        alone.append(_cpu(lambda one=one: [each.build() for each in one]) / len(one))
    tracemalloc.start()
    batch = design.build_batch()
    held, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    rate, single = 1 / statistics.median(together), 1 / statistics.median(alone)
    what = f"models of {COMPILED:,} quadrupeds as fields of arrays"
    return [
        measured(f"{what}, designs/s of CPU", rate, "", 20_000, at_least=True),
        measured("fields by arrays / models compiled one by one", rate / single, "x"),
        measured("share of the designs that have a model", 100 * len(batch) / COMPILED, "%"),
        measured(f"{what}, memory held", held / COMPILED, "B/design", 20_000),
        measured(f"{what}, memory at the peak", peak / COMPILED, "B/design"),
    ]


def families() -> list[dict[str, Any]]:
    """A family of drawn quadrupeds, from the command's arguments to the fields of all worlds."""
    # Imported here: worker processes of the sweeps import this module.
    from draft.learn.bodies.designs import open_bodies
    from draft.learn.bodies.family_fields import family_fields
    from draft.learn.bodies.features import family_features
    from draft.learn.training.members import robots_digest

    open_bodies(["cheetah"], FAMILY, 2)  # Imports are not part of it.
    found: list[Any] = []
    steps: dict[str, Callable[[], Any]] = {
        "drawn": lambda: found.append(open_bodies(["cheetah"], FAMILY, BODIES).members),
        "recorded": lambda: robots_digest(found[0]),
        "compiled": lambda: family_fields(found[0]),
        "features": lambda: family_features(found[0]),
    }
    seconds = {name: _cpu(work) for name, work in steps.items()}
    print({name: round(time, 2) for name, time in seconds.items()})
    what = f"family of {BODIES:,} bodies ready to train, CPU"
    return [measured(what, sum(seconds.values()), "s", 5.0)]


def _cpu(work: Callable[[], Any]) -> float:
    """Seconds of CPU that some work takes in this process."""
    start = time.process_time()
    work()
    return time.process_time() - start


def sweeps(folder: Path) -> list[dict[str, Any]]:
    """Compiled models with M(q) metrics, all accepted; alone, by two processes, and on Ray."""
    spec = draft.load("quadruped")
    job = make(spec, "sweep", Sampled(vary=BUILT, n=SWEPT), chunk(SWEPT))
    cpu = SWEPT / _cpu(lambda: run_sweep(job, folder / "cpu", LocalEngine(1)))
    rates = {name: _rate(job, folder / name, engine) for name, engine in _engines()}
    if "--ray" in sys.argv:
        import ray

        # A cluster that stands already: its start is not part of the work.
        ray.init(num_cpus=os.cpu_count(), log_to_driver=False, include_dashboard=False)
        rates["ray"] = _rate(job, folder / "ray", RayEngine())
        ray.shutdown()
    rows = [
        measured("sweep with M(q) metrics, designs/s of CPU", cpu, ""),
        measured("sweep with M(q) metrics, two processes, designs/s", rates["two"], "", 5000, True),
        measured("sweep, two processes / one", rates["two"] / rates["one"], "x"),
    ]
    if "ray" in rates:
        rows.append(measured("sweep, Ray / two processes", rates["ray"] / rates["two"], "x"))
    return rows


def searches(folder: Path) -> list[dict[str, Any]]:
    """A search by closed-form metrics, from the command line."""
    goals = ["--minimise", "mass", "cost_of_standing", "--maximise", "jump_height"]
    arguments = ["optimise", "quadruped", "--vary", *VARY, *goals, "--subject-to", "accepted"]
    seconds, _ = watched([*arguments, "--trials", str(TRIALS), "--out", str(folder / "search")])
    return [measured(f"optimise, {TRIALS:,} trials", seconds, "s", 8.0)]


def _engines() -> list[tuple[str, Engine]]:
    return [("one", LocalEngine(1)), ("two", LocalEngine(2))]


def _rate(job: Job, out: Path, engine: Engine) -> float:
    seconds, _ = timed(lambda: run_sweep(job, out, engine))
    return job.n / seconds


def watched(arguments: list[str]) -> tuple[float, float]:
    """Seconds that a command takes, and the most bytes that its processes held together."""
    start = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "draft", *arguments], stdout=subprocess.DEVNULL
    )
    most = 0.0
    while process.poll() is None:
        most = max(most, sum(map(_resident, _family(process.pid))))
        time.sleep(0.05)
    assert process.returncode == 0, arguments
    return time.perf_counter() - start, most


def _family(pid: int) -> list[int]:
    """A process and all below it, on Linux."""
    found = [pid]
    for one in found:
        for task in Path(f"/proc/{one}/task").glob("*/children"):
            try:
                found += [int(child) for child in task.read_text().split()]
            except OSError:  # it has ended
                continue
    return found


def _resident(pid: int) -> float:
    """Bytes of memory that a process holds; those it shares count for each."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return float(pages * os.sysconf("SC_PAGE_SIZE"))


if __name__ == "__main__":
    main()
