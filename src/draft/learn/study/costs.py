"""How long a study takes: an estimate, from steps per second that are assumed or measured."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from statistics import median

from draft.learn.battery import BATTERIES as GRIDS
from draft.learn.battery import WORDS
from draft.learn.run import PROGRESS
from draft.learn.study.jobs import BATTERIES, Evaluating, Job, Training

# An assumption of one GPU's steps per second, and no measurement; `--rate` sets another.
ASSUMED_RATE = 100_000.0


class Rates:
    """Steps per second of all worlds together, by stage.

    Attributes:
        measured: of runs that are there, the median of their iterations.
    """

    def __init__(self, folder: Path, jobs: Mapping[str, Job], rate: float | None = None) -> None:
        """Measure what is there.

        Args:
            folder: the study's.
            jobs: its jobs.
            rate: steps per second that hold for all instead; None to measure or assume.
        """
        self._rate = rate
        by_stage: dict[str, list[float]] = {}
        for job in jobs.values():
            if rate is None and isinstance(job, Training):
                found = _rates(job.output(folder) / PROGRESS)
                by_stage.setdefault(job.plan.stage, []).extend(found)
        self.measured = {stage: median(found) for stage, found in by_stage.items() if found}

    def of(self, stage: str) -> float:
        """Rate of a stage; where none was measured that of another, then what is assumed."""
        if self._rate is not None:
            return self._rate
        others = median(self.measured.values()) if self.measured else ASSUMED_RATE
        return self.measured.get(stage, others)

    def words(self) -> str:
        """Where the estimate comes from."""
        if self._rate is not None:
            return f"an estimate, at {self._rate:,.0f} steps/s as --rate says"
        if not self.measured:
            return (
                f"an estimate, at {ASSUMED_RATE:,.0f} steps/s, which is an assumption; "
                "--rate sets another, and runs of this study will replace it"
            )
        told = ", ".join(f"{stage} {rate:,.0f}" for stage, rate in self.measured.items())
        return f"an estimate, at steps/s measured in this study: {told}"


def hours(job: Job, folder: Path, rates: Rates, anew: bool = False) -> float:
    """Estimated hours that are left of a job, on one device; all of it where it is done anew.

    Training: iterations left x worlds x steps per iteration / rate. Evaluation: levels x replicas
    x steps of a roll-out / rate; loading and compiling are not counted.
    """
    if isinstance(job, Training):
        left = max(0, job.iterations - (0 if anew else job.done(folder)))
        steps = left * job.plan.environments * job.plan.config.learning.steps
        return steps / rates.of(job.plan.stage) / 3600.0
    if isinstance(job, Evaluating):
        plan = job.training.plan
        physics = plan.config.physics
        steps = job.seconds / (physics.timestep * physics.decimation)
        worlds = _levels(job) * job.replicas
        return worlds * steps / rates.of(plan.stage) / 3600.0
    return 0.0


def _levels(job: Evaluating) -> int:
    battery = BATTERIES[job.training.plan.stage]
    most = sum(len(GRIDS[name].levels) for name in WORDS[battery])
    asked = most if job.levels is None else job.levels * (2 if battery == "stairs" else 1)
    return min(most, asked)


def _rates(path: Path) -> list[float]:
    """Steps per second of the iterations of a run, but for the first, which loads and compiles."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = [row.get("steps_per_s") for row in csv.DictReader(file)]
    except OSError:
        return []
    found = []
    for text in rows[1:]:
        try:
            found.append(float(text or "nan"))
        except ValueError:
            continue
    return [rate for rate in found if rate > 0.0]
