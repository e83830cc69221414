"""What a study's folder holds: its runs, how they went, and what was measured of them.

What cannot be read is left out and named in `Study.warnings`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from draft.errors import DraftError, Problem
from draft.learn.config import STAGES
from draft.learn.progress import Row, read
from draft.learn.quadruped import Quadruped
from draft.learn.report.checks import ARMS, PROTOCOLS, parse
from draft.learn.run import PROGRESS, RUN, STATE, Run, open_run, robots_digest, safe
from draft.learn.study.store import FAILED
from draft.learn.study.store import STATE as PLAN

Key = tuple[str, str, int]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One arm and protocol of a run's evaluation.

    Attributes:
        folder: where it lies.
        run: the run.
        arm: "nominal" or "perturbed".
        protocol: "walking" or "published".
        data: its summary.json.
    """

    folder: Path
    run: Run
    arm: str
    protocol: str
    data: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Trained:
    """A run and how its training went.

    Attributes:
        run: the run.
        rows: numbers of each iteration.
        seconds: of training; None where it is not noted.
        versions: of the packages that it began with.
    """

    run: Run
    rows: list[Row]
    seconds: float | None
    versions: dict[str, str]

    @property
    def key(self) -> Key:
        """Design, stage and seed."""
        plan = self.run.plan
        return plan.members[0].name, plan.stage, plan.seed

    @property
    def single(self) -> bool:
        """Tell whether it has one design."""
        return len(self.run.plan.members) == 1


@dataclass(frozen=True)
class Planned:
    """What a study is to train, as its study.json tells.

    Attributes:
        name: of the study.
        toy: whether it is the toy of it.
        designs: names of the designs that are trained alone.
        families: names of the families.
        seeds: of each.
        stages: of each.
        arms: of each evaluation.
        protocols: of each evaluation.
        failed: names of jobs that ended in an error.
    """

    name: str
    toy: bool
    designs: tuple[str, ...]
    families: tuple[str, ...]
    seeds: tuple[int, ...]
    stages: tuple[str, ...]
    arms: tuple[str, ...]
    protocols: tuple[str, ...]
    failed: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Study:
    """What a study's folder holds.

    Attributes:
        name: its own, or that of the folder.
        singles: runs of one design.
        families: runs of several designs.
        evaluations: of the runs.
        warnings: what was left out, and why.
        planned: None where no study.json tells, as in a folder of runs made one by one.
    """

    name: str
    singles: tuple[Trained, ...]
    families: tuple[Trained, ...]
    evaluations: tuple[Evaluation, ...]
    warnings: tuple[str, ...]
    planned: Planned | None

    @property
    def members(self) -> dict[str, Quadruped]:
        """Designs that have runs of their own, by name, from the shortest leg to the longest."""
        found = {one.run.plan.members[0].name: one.run.plan.members[0] for one in self.singles}
        return dict(sorted(found.items(), key=lambda item: (item[1].leg_length, item[0])))

    @property
    def titles(self) -> dict[str, str]:
        """What the page calls each design: its name, without the robot's if that is all alike."""
        names = list(self.members)
        robots = {name.partition(":")[0] for name in names}
        if len(robots) == 1 and all(":" in name for name in names):
            return {name: name.partition(":")[2] for name in names}
        return {name: name for name in names}

    @property
    def seeds(self) -> list[int]:
        """Seeds of any run of one design."""
        return sorted({one.run.plan.seed for one in self.singles})

    @property
    def protocol(self) -> str:
        """What most of the report is about: "walking" where it was evaluated so."""
        found = {one.protocol for one in self.evaluations}
        return next((name for name in PROTOCOLS if name in found), PROTOCOLS[0])

    @property
    def arms(self) -> list[str]:
        """Arms of any evaluation."""
        found = {one.arm for one in self.evaluations}
        return [arm for arm in ARMS if arm in found]

    def of(self, design: str, arm: str, protocol: str | None = None) -> Iterator[Evaluation]:
        """Evaluations of a design that has runs of its own, by seed and stage."""
        for one in self.evaluations:
            members = one.run.plan.members
            same = len(members) == 1 and members[0].name == design and one.arm == arm
            if same and one.protocol == (protocol or self.protocol):
                yield one


def gather(folder: Path) -> Study:
    """Read a study's folder.

    Raises:
        DraftError: it holds no run that can be read.
    """
    warnings: list[str] = []
    found: dict[str, Trained] = {}
    for path in sorted((folder / "runs").glob("*")):
        # A dot begins what a killed process left of making a run.
        if (path / RUN).is_file() and not path.name.startswith("."):
            try:
                found[path.name] = _trained(open_run(path))
            except DraftError as error:
                warnings += [f"{problem.cause}; it is left out" for problem in error.problems]
    kept = _kept(found, warnings)
    if not kept:
        remedy = "; ".join(warnings) or "'draft study FILE.yaml' makes one"
        raise DraftError(Problem(f"'{folder}' has no run of a study to report on", None, remedy))
    evaluations = [one for trained in kept for one in _evaluations(trained.run, warnings)]
    stages = {stage: i for i, stage in enumerate(STAGES)}
    kept.sort(key=lambda one: (one.key[0], stages[one.key[1]], one.key[2]))
    planned = _planned(folder)
    return Study(
        name=planned.name if planned else folder.resolve().name,
        singles=tuple(one for one in kept if one.single),
        families=tuple(one for one in kept if not one.single),
        evaluations=tuple(evaluations),
        warnings=tuple(warnings),
        planned=planned,
    )


def _planned(folder: Path) -> Planned | None:
    """What study.json says; None where it is not there, or says nothing that can be read."""
    try:
        told = json.loads((folder / PLAN).read_text(encoding="utf-8"))
        groups = told["designs"]
        return Planned(
            name=str(told["name"]),
            toy=bool(told["toy"]),
            designs=tuple(str(g["members"][0]) for g in groups if not g["family"]),
            families=tuple(str(g["name"]) for g in groups if g["family"]),
            seeds=tuple(int(seed) for seed in told["seeds"]),
            stages=tuple(stage for stage in STAGES if stage in told["stages"]),
            arms=(ARMS[0], *ARMS[1:] * bool(told["evaluate"]["perturbed"])),
            protocols=(PROTOCOLS[0], *PROTOCOLS[1:] * bool(told["evaluate"]["published"])),
            failed=tuple(n for n, job in told["jobs"].items() if job["state"] == FAILED),
        )
    except (OSError, ValueError, TypeError, KeyError, IndexError, AttributeError):
        return None


def parameters(run: Run) -> dict[str, dict[str, float]]:
    """Numbers that each member's design file sets, by member; without files that are not read.

    Files are called after their designs, and lie in the folder in no order of their own.
    """
    found = {}
    for member in run.plan.members:
        path = run.folder / "designs" / f"{safe(member.name)}.yaml"
        try:
            values = yaml.safe_load(path.read_text(encoding="utf-8"))["values"]
            found[member.name] = {
                str(name): float(value)
                for name, value in values.items()
                if isinstance(value, (int, float)) and not isinstance(value, bool)
            }
        except (OSError, ValueError, TypeError, KeyError, AttributeError, yaml.YAMLError):
            continue
    return found


def _trained(run: Run) -> Trained:
    record = json.loads((run.folder / RUN).read_text(encoding="utf-8"))
    versions = {str(k): str(v) for k, v in dict(record.get("versions") or {}).items()}
    try:
        state = json.loads((run.folder / STATE).read_text(encoding="utf-8"))
        seconds = float(state["seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        seconds = None
    return Trained(run, read(run.folder / PROGRESS), seconds, versions)


def _kept(found: dict[str, Trained], warnings: list[str]) -> list[Trained]:
    """Runs without a second one of the same design, stage and seed, or of a namesake."""
    kept: list[Trained] = []
    robots: dict[str, str] = {}
    keys: dict[Key, str] = {}
    for folder, one in found.items():
        if one.single:
            digest = robots_digest(one.run.plan.members)
            if robots.setdefault(one.key[0], digest) != digest:
                warnings.append(
                    f"{folder} is of another robot that is also called {one.key[0]}; it is left out"
                )
                continue
            if one.key in keys:
                warnings.append(f"{folder} repeats {keys[one.key]}; it is left out")
                continue
            keys[one.key] = folder
        kept.append(one)
    return kept


def _evaluations(run: Run, warnings: list[str]) -> Iterator[Evaluation]:
    digest = robots_digest(run.plan.members)
    for path in sorted((run.folder / "evaluation").glob("*/summary.json")):
        where = "/".join(path.parts[-4:])
        try:
            data = parse(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            warnings.append(f"{where} cannot be read ({error}); it is left out")
            continue
        if data.get("robots", digest) != digest:
            warnings.append(f"{where} is of other robots than its run; it is left out")
            continue
        yield Evaluation(path.parent, run, data["arm"], data["protocol"], data)


def seeds_in_words(seeds: Sequence[int]) -> str:
    """Seeds as a text says them."""
    listed = ", ".join(map(str, sorted(seeds)))
    return f"seed {listed}" if len(seeds) == 1 else f"seeds {listed}"
