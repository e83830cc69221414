"""Estimate of the hours of a study, from assumed or measured steps per second."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from draft.errors import DraftError, counted
from draft.learn.engine.machine import KINDS, NATIVE, minutes
from draft.learn.measuring.levels import skill_tests
from draft.learn.training.progress import PROGRESS
from draft.learn.training.run import Plan, Run
from draft.study.capacity import Capacity
from draft.study.jobs import Evaluating, Job, Training
from draft.study.store import DONE, Store

# Steps per second of one GPU: assumed, not measured. `--rate` overrides it.
ASSUMED_RATE = 100_000.0


class Rates:
    """Steps per second of one job, all its worlds together, by stage.

    Attributes:
        measured: median over the iterations of existing runs that last used the same engine.
        capacity: what runs the jobs; None for GPUs.
    """

    def __init__(
        self,
        folder: Path,
        jobs: Mapping[str, Job],
        rate: float | None = None,
        capacity: Capacity | None = None,
    ) -> None:
        """Measure the runs of a study's folder.

        Args:
            folder: folder of the study.
            jobs: jobs of the study.
            rate: steps per second of every stage; None to measure or assume them.
            capacity: what runs the jobs; None for GPUs.
        """
        self._rate, self.capacity = rate, capacity
        self._plans: dict[str, Plan] = {}
        by_stage: dict[str, list[float]] = {}
        for job in jobs.values():
            if isinstance(job, Training):
                stage, output = job.plan.stage, job.output(folder)
                self._plans[stage] = job.plan
                if rate is None and self._alike(Run(output, job.plan).engine()):
                    by_stage.setdefault(stage, []).extend(_rates(output / PROGRESS))
        self.measured = {stage: median(found) for stage, found in by_stage.items() if found}

    @property
    def on_cpu(self) -> bool:
        """Whether the jobs run without a GPU."""
        return self.capacity is not None and self.capacity.on_cpu

    def of(self, stage: str) -> float:
        """Return the rate of a stage: measured, or assumed and corrected by other stages."""
        if self._rate is not None:
            return self._rate
        found = [rate / self._assumed(other) for other, rate in self.measured.items()]
        others = self._assumed(stage) * (median(found) if found else 1.0)
        return self.measured.get(stage, others)

    def words(self) -> str:
        """Return the source of the estimate, in words."""
        if self._rate is not None:
            return f"an estimate, at the {self._rate:,.0f} steps/s of `rate`"
        if self.measured:
            rates = ", ".join(f"{stage} {rate:,.0f}" for stage, rate in self.measured.items())
            return f"an estimate, at steps/s measured in this study: {rates}"
        later = "runs of this study will replace it"
        if self.capacity is not None and self.on_cpu:
            assumed = {plan.ground: self._assumed(stage) for stage, plan in self._plans.items()}
            rates = " and ".join(f"{rate:,.0f} on {ground}" for ground, rate in assumed.items())
            return f"an estimate, at steps/s measured on another CPU: {rates} ground; {later}"
        rates = f"{ASSUMED_RATE:,.0f} steps/s, which is an assumption"
        return f"an estimate, at {rates}; `rate` overrides it, and {later}"

    def _alike(self, engine: str | None) -> bool:
        """Return whether the rate of a run that last used an engine holds for these jobs."""
        name = self.capacity.engine.name if self.capacity is not None else None
        return (engine == NATIVE) == (name == NATIVE)

    def _assumed(self, stage: str) -> float:
        if self.capacity is None or not self.capacity.on_cpu:
            return ASSUMED_RATE
        plan, here = self._plans[stage], self.capacity
        physics = plan.config.physics.decimation
        return 1.0 / (60.0 * minutes(1.0, physics, here.engine, here.processes, plan.ground))


@dataclass(frozen=True)
class Estimate:
    """Hours that are left of a study.

    Attributes:
        hours: hours that are left of each job, by name; of one GPU, or of the CPU.
        unit: "GPU-hours" or "hours".
        source: source of the numbers, in words.
        at_once: number of jobs at once on a CPU; 1 on GPUs, whose hours are not divided.
    """

    hours: dict[str, float]
    unit: str
    source: str
    at_once: int

    @property
    def total(self) -> float:
        """Sum over all jobs."""
        return sum(self.hours.values())


def estimate(store: Store, rate: float | None, capacity: Capacity | None) -> Estimate:
    """Estimate the hours that are left of a study.

    Args:
        store: folder of the study.
        rate: steps per second of a job; None to measure or assume them.
        capacity: what would run the jobs; None for GPUs that are not here.

    Raises:
        DraftError: the rate is not above 0 and finite.
    """
    if rate is not None and not 0 < rate < math.inf:
        raise DraftError(
            f"`rate` {rate} is not above 0 and finite", "omit it to measure or assume it"
        )
    rates = Rates(store.folder, store.jobs, rate, capacity)
    changed = store.changed()
    left = {
        name: 0.0 if store.states[name] == DONE else hours(job, store.folder, rates, job in changed)
        for name, job in store.jobs.items()
    }
    at_once = (capacity.at_once or 1) if capacity is not None and rates.on_cpu else 1
    unit = "hours" if rates.on_cpu else "GPU-hours"
    return Estimate(left, unit, rates.words(), at_once)


def setting(capacity: Capacity) -> str:
    """Return what the jobs run on, in words."""
    words = f"{KINDS[capacity.engine.name]} ({capacity.engine.why})"
    if not capacity.on_cpu:
        return words
    words += f", {counted(capacity.processes, 'process')} for each training"
    count = capacity.at_once
    if count is None:
        return words
    return f"{words}, {counted(count, 'job')} at once"


def hours(job: Job, folder: Path, rates: Rates, anew: bool = False) -> float:
    """Estimate the hours that are left of a job, on one GPU or on a CPU.

    Training: iterations left x worlds x steps per iteration / rate. Evaluation: levels x replicas
    x steps of a roll-out / rate. Loading and compiling are not counted.

    Args:
        job: the job.
        folder: folder of the study.
        rates: steps per second.
        anew: whether iterations that are done do not count.
    """
    if isinstance(job, Training):
        left = max(0, job.iterations - (0 if anew else job.done(folder)))
        steps = left * job.plan.environments * job.plan.config.learning.steps
        return steps / rates.of(job.plan.stage) / 3600.0
    if isinstance(job, Evaluating):
        plan = job.training.plan
        physics = plan.config.physics
        steps = job.options.seconds / (physics.timestep * physics.decimation)
        levels = skill_tests(job.options.test or (), job.options.levels)
        worlds = sum(len(test.levels) for test in levels) * job.options.replicas
        return worlds * steps / rates.of(plan.stage) / 3600.0
    return 0.0


def _rates(path: Path) -> list[float]:
    """Return the steps per second of a run's iterations, without the first, which compiles."""
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
