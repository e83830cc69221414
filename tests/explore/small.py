"""Small runs for tests of exploration."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

import draft
from draft.design import Design
from draft.explore.engines import LocalEngine, Work
from draft.explore.job import Job, make
from draft.explore.settings import Sampled
from draft.metrics import METRICS, Metric

# All tests that use this need the extra; without it they are skipped.
pq: Any = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("scipy")
pytest.importorskip("optuna")
VARY = ("thigh_length=0.2:0.5", "actuators.leg.peak_torque=20:300:log")
HERE = LocalEngine(1)


def job(spec: draft.Spec, n: int = 1000, kind: str = "screen", **changes: Any) -> Job:
    """A run of a few parts over two axes."""
    chunk = changes.pop("chunk", 100)
    settings = Sampled.of({"vary": VARY, "n": n, "metrics": (), **changes})
    return make(spec, kind, settings, chunk)


def rows(path: Path) -> list[dict[str, Any]]:
    """Every row of a file, or of the parts of a folder in their order."""
    paths = sorted(path.glob("*.parquet")) if path.is_dir() else [path]
    return [row for one in paths for row in pq.read_table(one).to_pylist()]


class StopError(Exception):
    """What a test throws in the middle of a run."""


class Stops:
    """An engine that is stopped after some tasks."""

    def __init__(self, after: int) -> None:
        self.after = after

    def run(self, tasks: Iterable[int], work: Work) -> Iterator[tuple[int, Any]]:
        for count, result in enumerate(HERE.run(tasks, work)):
            if count == self.after:
                raise StopError
            yield result


# A command that stops for ever when it moves a part into place, after some whole ones.
_PAUSES = """
import os, signal, sys, time
from draft.cli import main
# A shell starts what it runs in the background with Ctrl-C ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
replace, whole = os.replace, []

def pauses(source, target):
    if "part-" in str(target):
        if len(whole) == int(sys.argv[1]):
            print("paused", flush=True)
            while True:
                time.sleep(60)
        whole.append(target)
    replace(source, target)

os.replace = pauses
sys.exit(main(sys.argv[2:]))
"""


def paused(parts: int, *arguments: str) -> subprocess.Popen[str]:
    """A command in a process of its own, which has written this many parts and goes no further."""
    process = subprocess.Popen(
        [sys.executable, "-c", _PAUSES, str(parts), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    while (line := process.stdout.readline()) != "paused\n":
        assert line, process.communicate()[1]
    return process


def metric(monkeypatch: pytest.MonkeyPatch, name: str = "weight", needs: Any = "design") -> None:
    """Register a metric for a test: ten times the mass, of a design or of its model."""

    def weight(subject: Any) -> Any:
        design: Design = subject if needs == "design" else subject.design
        return 10.0 * design.mass

    one = Metric(name, "N", "Weight.", "10 m", "a test", "less", needs, weight)
    monkeypatch.setitem(METRICS._items, name, one)
