"""Jobs of a study: what each needs, the request that does it, and when it is done."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from draft.learn import battery, evaluation
from draft.learn import run as runs
from draft.learn.quadruped import Quadruped
from draft.learn.training import SCRATCH, begin
from draft.study.requests import EvaluateRequest, ReportRequest, Request, TrainRequest

BATTERIES = {"base": "walk", "velocity": "speed", "terrain": "stairs", "push": "push"}
REPORT = "report"


class Physics(NamedTuple):
    """How jobs are done; an output that is there counts, whichever way it was made.

    Attributes:
        engine: "auto", "native" or "warp".
        replicas: processes of a training that is begun on a CPU; None for what it chooses.
    """

    engine: str = "auto"
    replicas: int | None = None


AUTO = Physics()


@dataclass(frozen=True)
class Group:
    """What one policy is trained on: a design, or a family.

    Attributes:
        name: in the names of its runs.
        members: the robots.
        designs: each robot's design file as YAML, by the robot's name.
        family: whether the bodies were drawn for the study.
        see_design: whether the policy sees what tells them apart.
    """

    name: str
    members: tuple[Quadruped, ...]
    designs: Mapping[str, str] = field(default_factory=dict)
    family: bool = False
    see_design: bool = False

    def files(self, folder: Path) -> dict[Path, str]:
        """Design files that a study's folder keeps of a family, none of a single design."""
        return {
            folder / "designs" / self.name / f"{name.rpartition(':')[2]}.yaml": text
            for name, text in self.designs.items()
            if self.family
        }


@dataclass(frozen=True)
class Job:
    """One piece of work of a study.

    Attributes:
        kind: train, evaluate or report.
        name: of the job.
        key: hash of all that decides its output.
        needs: names of the jobs that must be done before.
    """

    kind: ClassVar[str]
    name: str
    key: str
    needs: tuple[str, ...]

    def output(self, folder: Path) -> Path:
        """Folder of its output, in a study's folder."""
        raise NotImplementedError

    def complete(self, folder: Path) -> bool:
        """Whether all its output is there."""
        raise NotImplementedError

    def holds(self, folder: Path, path: Path) -> bool:
        """Whether a folder holds an output of this job, whole or begun, and of none else.

        Args:
            folder: the study's.
            path: where the output may be.
        """
        raise NotImplementedError

    def prepare(self, folder: Path) -> None:
        """Make what must be there before the request, in a study's folder.

        Raises:
            DraftError: it cannot be made.
        """

    def request(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> Request:
        """What a process is asked to do.

        Args:
            folder: the study's.
            device: such as "cpu".
            minutes: for how long; None for no limit. Only training can go on later.
            physics: how.
        """
        raise NotImplementedError

    def record(self) -> dict[str, Any]:
        """What study.json tells of it."""
        return {"kind": self.kind, "key": self.key, "needs": list(self.needs)}


@dataclass(frozen=True)
class Training(Job):
    """A run.

    Attributes:
        group: what is trained.
        plan: of the run.
        iterations: in all slices.
        run_key: the key but for the iterations: a run of that key can be trained for longer.
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
        """Iterations done."""
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
        """What a run's folder has other than this job's plan."""
        old = runs.read_record(path)
        # What it started from was settled when it began.
        return runs.differences(old, self._wanted | {"origin": old.get("origin")})

    @cached_property
    def _wanted(self) -> dict[str, Any]:
        return json.loads(json.dumps(self.plan.record()))

    def prepare(self, folder: Path) -> None:
        """Make the run's folder of this job's plan, so that no design is read again."""
        # What a run started from is settled when it begins.
        base = folder / "runs" / self.needs[0] if self.needs else None
        fresh = not runs.is_run(self.output(folder))
        origin = (base or SCRATCH) if fresh else None
        begin(self.output(folder), self.plan, self.group.designs, origin)

    def request(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> TrainRequest:
        """See `Job`."""
        run = runs.Run(self.output(folder), self.plan)
        # A run that was begun goes on with as many processes as its state is of.
        replicas = physics.replicas if run.processes() is None else None
        return TrainRequest(
            str(run.folder), self.iterations, device, physics.engine, replicas, minutes
        )

    def record(self) -> dict[str, Any]:
        """See `Job`."""
        told = {"design": self.group.name, "stage": self.plan.stage, "seed": self.plan.seed}
        more = {"iterations": self.iterations, "run_key": self.run_key}
        return super().record() | told | more


@dataclass(frozen=True)
class Evaluating(Job):
    """A battery for a run.

    Attributes:
        training: of the run.
        arm: nominal or perturbed.
        errors: whose inertia errors the perturbed arm has; None in the nominal arm.
        protocol: walking or published.
        replicas: worlds per level.
        levels: per battery; None for all.
        seconds: of a roll-out.
        seed: of everything random in it.
    """

    kind = "evaluate"
    training: Training
    arm: str
    errors: str | None
    protocol: str
    replicas: int
    levels: int | None
    seconds: float
    seed: int
    _known: dict[Path, tuple[Any, bool]] = field(default_factory=dict, repr=False, compare=False)

    def output(self, folder: Path) -> Path:
        """See `Job`."""
        return self.training.output(folder) / "evaluation" / f"{self.arm}-{self.protocol}"

    def complete(self, folder: Path) -> bool:
        """See `Job`."""
        return self.holds(folder, self.output(folder))

    def holds(self, folder: Path, path: Path) -> bool:
        """See `Job`."""
        run = runs.Run(self.training.output(folder), self.training.plan)
        checkpoint = dict(run.checkpoints()).get(self.training.iterations)
        stamp = checkpoint and _stamp(path, path / evaluation.SUMMARY, checkpoint)
        if not stamp:
            return False
        # Results of families and checkpoints are large, and this is asked often.
        if self._known.get(path, (None, False))[0] != stamp:
            summary = evaluation.read(path)
            answered = summary is not None and evaluation.answers(summary, self.asked(run))
            self._known[path] = stamp, answered
        return self._known[path][1]

    def asked(self, run: runs.Run) -> evaluation.Asked:
        """All that decides the result."""
        words = (BATTERIES[self.training.plan.stage],)
        return evaluation.asked(
            run,
            battery.batteries(words, None if self.levels is None else str(self.levels)),
            self.training.iterations,
            self.arm,
            self.protocol,
            replicas=self.replicas,
            seconds=self.seconds,
            settle=battery.settle(self.seconds),
            evaluation_seed=self.seed,
            errors=self.errors,
        )

    def request(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> EvaluateRequest:
        """See `Job`."""
        return EvaluateRequest(
            run=str(self.training.output(folder)),
            checkpoint=self.training.iterations,
            battery=BATTERIES[self.training.plan.stage],
            levels=self.levels,
            replicas=self.replicas,
            seconds=self.seconds,
            seed=self.seed,
            errors=self.errors,
            protocol=self.protocol,
            device=device,
            engine=physics.engine,
        )

    def record(self) -> dict[str, Any]:
        """See `Job`."""
        of = self.training
        told = {"design": of.group.name, "stage": of.plan.stage, "seed": of.plan.seed}
        return super().record() | told | {"arm": self.arm, "protocol": self.protocol}


@dataclass(frozen=True)
class Reporting(Job):
    """The report of all that was evaluated."""

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
        # Evaluations that were done again are not in it.
        summaries = folder.glob(f"runs/*/{evaluation.FOLDER}/*/{evaluation.SUMMARY}")
        newest = max((summary.stat().st_mtime_ns for summary in summaries), default=0)
        return page.stat().st_mtime_ns >= newest

    def request(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> ReportRequest:
        """See `Job`."""
        return ReportRequest(str(folder))


def _stamp(*paths: Path) -> tuple[tuple[int, ...], ...]:
    """What changes when one of some files or folders does; nothing where one is missing."""
    try:
        found = [path.stat() for path in paths]
    except OSError:
        return ()
    return tuple((one.st_mtime_ns, one.st_size, one.st_ino) for one in found)
