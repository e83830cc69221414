"""Jobs of a study: their needs, requests and outputs, and when each is done."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import ClassVar, NamedTuple

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.machine import EngineName
from draft.learn.measuring import results
from draft.learn.measuring.evaluation_options import Options
from draft.learn.measuring.levels import skill_tests
from draft.learn.measuring.summary import ARMS, Arm, Protocol
from draft.learn.measuring.summary import Request as Asked
from draft.learn.training import run as runs
from draft.learn.training.session import SCRATCH, begin
from draft.study.requests import EvaluateRequest, ReportRequest, Request, TrainRequest

REPORT = "report"


class Physics(NamedTuple):
    """Engine and processes that run jobs; an output counts whichever made it.

    Attributes:
        engine: "auto", "native" or "warp".
        replicas: processes of a training that starts on a CPU; None to choose.
    """

    engine: EngineName = "auto"
    replicas: int | None = None


AUTO = Physics()
_Stamp = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Group:
    """Robots that one policy is trained on: a design, or a family.

    Attributes:
        name: name as it appears in the names of runs.
        members: the robots.
        designs: design file of each robot as YAML, by the robot's name.
        family: whether the robots were drawn for the study.
        see_design: whether the policy observes the numbers that distinguish the robots.
        note: number of draws that were refused, with the reasons; "" if none were.
    """

    name: str
    members: tuple[LeggedRobot, ...]
    designs: Mapping[str, str] = field(default_factory=dict)
    family: bool = False
    see_design: bool = False
    note: str = ""

    def files(self, folder: Path) -> dict[Path, str]:
        """Return the design files that a study's folder keeps, by path; none of a single design."""
        return {
            folder / "designs" / self.name / f"{name.rpartition(':')[2]}.yaml": text
            for name, text in self.designs.items()
            if self.family
        }


@dataclass(frozen=True)
class Job:
    """One piece of work of a study.

    Attributes:
        kind: "train", "evaluate" or "report".
        name: name of the job.
        key: hash of everything that determines the output.
        needs: names of the jobs that must be done first.
    """

    kind: ClassVar[str]
    name: str
    key: str
    needs: tuple[str, ...]

    def output(self, folder: Path) -> Path:
        """Return the folder of the output, in a study's folder."""
        raise NotImplementedError

    def complete(self, folder: Path) -> bool:
        """Return whether the whole output exists."""
        raise NotImplementedError

    def holds(self, folder: Path, path: Path) -> bool:
        """Return whether a folder holds an output of exactly this job, complete or started.

        Args:
            folder: folder of the study.
            path: folder that may hold the output.
        """
        raise NotImplementedError

    def prepare(self, folder: Path) -> None:
        """Create what the request needs, in a study's folder.

        Raises:
            DraftError: it cannot be created.
        """

    def request(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> Request:
        """Return the request to a worker.

        Args:
            folder: folder of the study.
            device: such as "cpu".
            minutes: time limit [min]; None for no limit. Only a training can be resumed.
            physics: engine and processes.
        """
        raise NotImplementedError

    def record(self) -> dict[str, object]:
        """Return the job as study.json holds it."""
        return {"kind": self.kind, "key": self.key, "needs": list(self.needs)}


@dataclass(frozen=True)
class Training(Job):
    """Training of a run.

    Attributes:
        group: robots that are trained.
        plan: plan of the run.
        iterations: iterations in all slices.
        run_key: key without the iterations; a run with the same one can be trained for longer.
    """

    kind = "train"
    group: Group
    plan: runs.Plan
    iterations: int
    run_key: str

    def output(self, folder: Path) -> Path:
        """See `Job`."""
        return folder / "runs" / self.name

    def done(self, folder: Path) -> int:
        """Return the number of iterations that are done."""
        run = runs.Run(self.output(folder), self.plan)
        return run.done() if runs.is_run(run.folder) else 0

    def complete(self, folder: Path) -> bool:
        """See `Job`."""
        output = self.output(folder)
        kept = dict(runs.Run(output, self.plan).checkpoints())
        enough = self.done(folder) >= self.iterations and self.iterations in kept
        return enough and self.holds(folder, output)

    def holds(self, folder: Path, path: Path) -> bool:
        """See `Job`."""
        return runs.is_run(path) and not self.differing(path)

    def differing(self, path: Path) -> list[str]:
        """Return what differs between the run in a folder and this job's plan."""
        old = runs.read_record(path)
        wanted = self._wanted
        if self.plan.origin is None:  # The run it started from was recorded when it began.
            wanted = wanted | {"origin": old.get("origin")}
        return runs.differences(old, wanted)

    @cached_property
    def _wanted(self) -> dict[str, object]:
        return json.loads(json.dumps(self.plan.record()))

    def prepare(self, folder: Path) -> None:
        """Create the run's folder from this job's plan, so that no design is read again."""
        base = folder / "runs" / self.needs[0] if self.needs else None
        if self.plan.origin is not None:
            base = self.plan.origin.run
        fresh = not runs.is_run(self.output(folder))
        origin = (base or SCRATCH) if fresh else None
        begin(self.output(folder), self.plan, self.group.designs, origin)

    def request(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> TrainRequest:
        """See `Job`."""
        run = runs.Run(self.output(folder), self.plan)
        # A run that was started keeps the number of processes of its state.
        replicas = physics.replicas if run.processes() is None else None
        return TrainRequest.of(
            {
                "run": str(run.folder),
                "iterations": self.iterations,
                "minutes": minutes,
                "device": device,
                "engine": physics.engine,
                "replicas": replicas,
            }
        )

    def record(self) -> dict[str, object]:
        """See `Job`."""
        run = {"design": self.group.name, "stage": self.plan.stage, "seed": self.plan.seed}
        more = {"iterations": self.iterations, "run_key": self.run_key}
        return super().record() | run | more


@dataclass(frozen=True)
class Evaluating(Job):
    """Evaluation of a run by one skill test.

    Attributes:
        training: job that trains the run.
        options: options of the evaluation.
    """

    kind = "evaluate"
    training: Training
    options: Options
    _known: dict[Path, tuple[_Stamp, bool]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def arm(self) -> Arm:
        """Robots as they were trained, or with inertia errors."""
        return ARMS[self.options.errors is not None]

    def output(self, folder: Path) -> Path:
        """See `Job`."""
        name = f"{self.arm}-{self.options.protocol}"
        return self.training.output(folder) / results.FOLDER / name

    def complete(self, folder: Path) -> bool:
        """See `Job`."""
        return self.holds(folder, self.output(folder))

    def holds(self, folder: Path, path: Path) -> bool:
        """See `Job`."""
        run = runs.Run(self.training.output(folder), self.training.plan)
        checkpoint = dict(run.checkpoints()).get(self.training.iterations)
        stamp = checkpoint and _stamp(path, path / results.SUMMARY, checkpoint)
        if not stamp:
            return False
        # Results of families and checkpoints are large, and this is called often.
        if self._known.get(path, ((), False))[0] != stamp:
            summary = results.read(path)
            answered = summary is not None and summary.asked == self.asked(run)
            self._known[path] = stamp, answered
        return self._known[path][1]

    def asked(self, run: runs.Run) -> Asked:
        """Return everything that determines the result."""
        words = self.options.test or ()
        return results.make_request(run, skill_tests(words, self.options.levels), self.options)

    def request(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> EvaluateRequest:
        """See `Job`."""
        how = {"run": str(self.training.output(folder)), "device": device, "engine": physics.engine}
        return EvaluateRequest.of(self.options.model_dump() | how)

    def record(self) -> dict[str, object]:
        """See `Job`."""
        of = self.training
        run = {"design": of.group.name, "stage": of.plan.stage, "seed": of.plan.seed}
        return super().record() | run | {"arm": self.arm, "protocol": self.options.protocol}


@dataclass(frozen=True)
class Reporting(Job):
    """Report on everything that was evaluated."""

    kind = "report"

    def output(self, folder: Path) -> Path:
        """See `Job`."""
        return folder / REPORT

    def complete(self, folder: Path) -> bool:
        """See `Job`."""
        return self.holds(folder, self.output(folder))

    def holds(self, folder: Path, path: Path) -> bool:
        """See `Job`."""
        page = path / "index.html"
        if not page.is_file():
            return False
        # A report is out of date once an evaluation is repeated.
        summaries = folder.glob(f"runs/*/{results.FOLDER}/*/{results.SUMMARY}")
        newest = max((summary.stat().st_mtime_ns for summary in summaries), default=0)
        return page.stat().st_mtime_ns >= newest

    def request(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> ReportRequest:
        """See `Job`."""
        return ReportRequest(study=str(folder))


def evaluation_job(run: str, arm: Arm, protocol: Protocol) -> str:
    """Return the name of the job of an evaluation."""
    return f"{run}-{arm}" + "-published" * (protocol == "published")


def _stamp(*paths: Path) -> _Stamp:
    """Return a value that changes with any of some files or folders; () if one is missing."""
    try:
        found = [path.stat() for path in paths]
    except OSError:
        return ()
    return tuple((one.st_mtime_ns, one.st_size, one.st_ino) for one in found)
