"""How long a study takes: an estimate, from steps per second that are assumed or measured."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from statistics import median

from draft.learn.battery import BATTERIES as GRIDS
from draft.learn.battery import WORDS
from draft.learn.engine import NATIVE, minutes
from draft.learn.machine import KINDS
from draft.learn.run import PROGRESS, Run
from draft.study.capacity import Hands
from draft.study.jobs import BATTERIES, Evaluating, Job, Training

# An assumption of one GPU's steps per second, and no measurement; `--rate` sets another.
ASSUMED_RATE = 100_000.0


class Rates:
    """Steps per second of all worlds together, by stage, of one job.

    Attributes:
        measured: of runs that are there and last ran on the same engine, the median of their
            iterations.
        hands: what does the jobs; None for a GPU.
    """

    def __init__(
        self,
        folder: Path,
        jobs: Mapping[str, Job],
        rate: float | None = None,
        hands: Hands | None = None,
    ) -> None:
        """Measure what is there.

        Args:
            folder: the study's.
            jobs: its jobs.
            rate: steps per second that hold for all instead; None to measure or assume.
            hands: what does the jobs; None for a GPU.
        """
        self._rate, self.hands = rate, hands
        self._grounds: dict[str, str] = {}
        by_stage: dict[str, list[float]] = {}
        for job in jobs.values():
            if isinstance(job, Training):
                stage, output = job.plan.stage, job.output(folder)
                self._grounds[stage] = job.plan.ground
                if rate is None and self._alike(Run(output, job.plan).engine()):
                    by_stage.setdefault(stage, []).extend(_rates(output / PROGRESS))
        self.measured = {stage: median(found) for stage, found in by_stage.items() if found}

    @property
    def on_cpu(self) -> bool:
        """Whether the jobs are done without a GPU."""
        return self.hands is not None and self.hands.on_cpu

    def of(self, stage: str) -> float:
        """Rate of a stage; where none was measured what is assumed, corrected by other stages."""
        if self._rate is not None:
            return self._rate
        found = [rate / self._assumed(other) for other, rate in self.measured.items()]
        others = self._assumed(stage) * (median(found) if found else 1.0)
        return self.measured.get(stage, others)

    def words(self) -> str:
        """Where the estimate comes from."""
        if self._rate is not None:
            return f"an estimate, at {self._rate:,.0f} steps/s as --rate says"
        if self.measured:
            told = ", ".join(f"{stage} {rate:,.0f}" for stage, rate in self.measured.items())
            return f"an estimate, at steps/s measured in this study: {told}"
        later = "runs of this study will replace it"
        if self.hands is not None and self.on_cpu:
            rates = {ground: self._assumed(stage) for stage, ground in self._grounds.items()}
            told = " and ".join(f"{rate:,.0f} on {ground}" for ground, rate in rates.items())
            return f"an estimate, at steps/s as on another CPU: {told} ground; {later}"
        assumed = f"{ASSUMED_RATE:,.0f} steps/s, which is an assumption"
        return f"an estimate, at {assumed}; --rate sets another, and {later}"

    def _alike(self, engine: str | None) -> bool:
        """Whether the speed of a run that was last on an engine tells that of these jobs."""
        name = self.hands.engine.name if self.hands is not None else None
        return (engine == NATIVE) == (name == NATIVE)

    def _assumed(self, stage: str) -> float:
        if self.hands is None or not self.hands.on_cpu:
            return ASSUMED_RATE
        ground = self._grounds.get(stage, "uneven")
        return 1.0 / (60.0 * minutes(1.0, self.hands.engine, self.hands.processes, ground))


def setting(hands: Hands) -> str:
    """On what the jobs are done, in words."""
    words = f"{KINDS[hands.engine.name]} ({hands.engine.why})"
    if not hands.on_cpu:
        return words
    words += f", {hands.processes} process{'es' * (hands.processes > 1)} for each training"
    count = hands.at_once
    if count is None:
        return words
    return f"{words}, {count} job{'s' * (count > 1)} at once"


def hours(job: Job, folder: Path, rates: Rates, anew: bool = False) -> float:
    """Estimated hours that are left of a job, on one GPU or on a CPU; all where it is done anew.

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
