"""Jobs of a study: what each needs, the command that does it, and when it is done."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from draft.learn import battery, evaluation
from draft.learn import run as runs
from draft.learn.quadruped import Quadruped

BATTERIES = {"base": "walk", "velocity": "speed", "terrain": "stairs", "push": "push"}
REPORT = "report"


class Physics(NamedTuple):
    """How jobs are done; an output that is there counts, whichever way it was made.

    Attributes:
        engine: as `--engine` of the commands takes it: "auto", "native" or "warp".
        replicas: processes of a training that is begun on a CPU; None for what it chooses.
    """

    engine: str = "auto"
    replicas: int | None = None

    def words(self) -> list[str]:
        """Of every command."""
        return [] if self.engine == "auto" else ["--engine", self.engine]


AUTO = Physics()


@dataclass(frozen=True)
class Group:
    """What one policy is trained on: a design, or a family.

    Attributes:
        name: in the names of its runs.
        word: as `draft train` reads it; of a family the robot.
        members: the robots.
        files: design files of a family, by name; none for a single design.
        see_design: whether the policy sees what tells them apart.
    """

    name: str
    word: str
    members: tuple[Quadruped, ...]
    files: dict[str, str] = field(default_factory=dict)
    see_design: bool = False

    def words(self, folder: Path) -> list[str]:
        """Designs as `draft train` reads them, in a study's folder."""
        return [f"{self.word}:{self.file(folder, name)}" for name in self.files] or [self.word]

    def file(self, folder: Path, name: str) -> Path:
        """A design file of a family."""
        return folder / "designs" / self.name / f"{name}.yaml"


@dataclass(frozen=True)
class Job:
    """One command of a study.

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

    def command(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> list[str]:
        """Arguments of `draft`.

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
    """A run of `draft train`.

    Attributes:
        group: what is trained.
        plan: of the run.
        iterations: in all slices.
        run_key: the key but for the iterations: a run of that key can be trained for longer.
        recipe: name of the one that the numbers start from.
        values: numbers of the task that are given to the command.
    """

    kind = "train"
    group: Group
    plan: runs.Plan
    iterations: int
    run_key: str
    recipe: str
    values: tuple[str, ...]

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

    def command(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> list[str]:
        """See `Job`."""
        words = ["train", *self.group.words(folder)]
        words += ["--stage", self.plan.stage, "--seed", str(self.plan.seed)]
        words += ["--recipe", self.recipe, "--ground", self.plan.ground]
        words += ["--envs", str(self.plan.environments), "--iterations", str(self.iterations)]
        # What was learnt is evaluated by jobs of their own.
        words += ["--no-review", "--device", device, *physics.words()]
        words += ["--out", str(self.output(folder))]
        # A run that was begun goes on with as many processes as its state is of.
        run = runs.Run(self.output(folder), self.plan)
        if physics.replicas is not None and run.processes() is None:
            words += ["--replicas", str(physics.replicas)]
        if self.values:
            words += ["--set", *self.values]
        if self.group.see_design:
            words.append("--see-design")
        # What a run started from is settled when it begins.
        if self.needs and not runs.is_run(self.output(folder)):
            words += ["--from", str(folder / "runs" / self.needs[0])]
        return words if minutes is None else [*words, "--minutes", f"{minutes:.3f}"]

    def record(self) -> dict[str, Any]:
        """See `Job`."""
        told = {"design": self.group.name, "stage": self.plan.stage, "seed": self.plan.seed}
        more = {"iterations": self.iterations, "run_key": self.run_key}
        return super().record() | told | more


@dataclass(frozen=True)
class Evaluating(Job):
    """A battery of `draft evaluate` for a run.

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

    def command(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> list[str]:
        """See `Job`."""
        words = ["evaluate", str(self.training.output(folder))]
        words += ["--battery", BATTERIES[self.training.plan.stage]]
        words += ["--checkpoint", str(self.training.iterations)]
        words += ["--replicas", str(self.replicas), "--seconds", str(self.seconds)]
        words += ["--seed", str(self.seed)]
        words += [] if self.errors is None else ["--perturbed", "--errors", self.errors]
        words += ["--published"] * (self.protocol == "published")
        words += [] if self.levels is None else ["--levels", str(self.levels)]
        return [*words, "--device", device, *physics.words()]

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

    def command(
        self, folder: Path, device: str, minutes: float | None, physics: Physics = AUTO
    ) -> list[str]:
        """See `Job`."""
        return ["study", "report", str(folder)]


def _stamp(*paths: Path) -> tuple[tuple[int, ...], ...]:
    """What changes when one of some files or folders does; nothing where one is missing."""
    try:
        found = [path.stat() for path in paths]
    except OSError:
        return ()
    return tuple((one.st_mtime_ns, one.st_size, one.st_ino) for one in found)
