"""Records of a study: trainings, evaluations and the plan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.measuring.summary import ARMS, PROTOCOLS, Arm, Protocol, Summary
from draft.learn.measuring.utilisation import BINS, CELLS
from draft.learn.task.stages import STAGES
from draft.learn.training.members import robots_digest
from draft.learn.training.progress import Row
from draft.values import Array

Key = tuple[str, str, int]


@dataclass(frozen=True, eq=False)
class Samples:
    """Counted samples of a skill test at the level of its utilisation.

    Attributes:
        counts: samples by bin, shape (BINS,), by joint class and quantity.
        plane: samples by cell of torque and speed, shape (CELLS, CELLS), by joint class.
    """

    counts: dict[tuple[str, str], Array] = field(default_factory=dict)
    plane: dict[str, Array] = field(default_factory=dict)

    def add(self, other: Samples) -> None:
        """Add the samples of another evaluation."""
        for key, counts in other.counts.items():
            self.counts[key] = self.counts.get(key, np.zeros(BINS)) + counts
        for joint, cells in other.plane.items():
            self.plane[joint] = self.plane.get(joint, np.zeros((CELLS, CELLS))) + cells


@dataclass(frozen=True, eq=False)
class Trained:
    """A run and its training.

    Attributes:
        name: name of its folder.
        members: its robots.
        plan: record of its plan, see `run.Plan.record`, without robots and origin.
        planned: iterations that were planned.
        iterations: iterations done.
        seconds: time of training [s]; None if unknown.
        engine: physics engine; None if unknown.
        processes: processes that shared the training; None if unknown.
        versions: versions of the packages at its start.
        rows: curve of its training, see `draft.learn.training.progress.thin`.
    """

    name: str
    members: tuple[LeggedRobot, ...]
    plan: Mapping[str, Any]
    planned: int
    iterations: int
    seconds: float | None
    engine: str | None
    processes: int | None
    versions: Mapping[str, str]
    rows: Sequence[Row]

    @property
    def stage(self) -> str:
        """Stage of the training."""
        return self.plan["stage"]

    @property
    def seed(self) -> int:
        """Seed of the training."""
        return self.plan["seed"]

    @property
    def environments(self) -> int:
        """Number of worlds."""
        return self.plan["environments"]

    @property
    def steps(self) -> int:
        """Steps of each world in an iteration."""
        return self.plan["config"]["learning"]["steps"]

    @property
    def total_steps(self) -> int:
        """Steps of all worlds in all iterations."""
        return self.iterations * self.environments * self.steps

    @property
    def key(self) -> Key:
        """Design, stage and seed."""
        return self.members[0].name, self.stage, self.seed

    @property
    def place(self) -> tuple[str, int, int]:
        """Place among other runs: by design, stage and seed."""
        return self.members[0].name, list(STAGES).index(self.stage), self.seed

    @property
    def single(self) -> bool:
        """Whether it has one design."""
        return len(self.members) == 1

    @cached_property
    def robots(self) -> str:
        """Hash of its robots."""
        return robots_digest(self.members)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One arm and protocol of a run's evaluation.

    Attributes:
        run: the run.
        summary: its summary.
        samples: its counted samples by test, if it is of the nominal arm and one design.
    """

    run: Trained
    summary: Summary
    samples: Mapping[str, Samples] = field(default_factory=dict)

    @property
    def arm(self) -> Arm:
        """Arm: "nominal" or "perturbed"."""
        return self.summary.arm

    @property
    def protocol(self) -> Protocol:
        """Protocol: "walking" or "published"."""
        return self.summary.protocol

    @property
    def name(self) -> str:
        """Name of its folder within the run."""
        return f"{self.arm}-{self.protocol}"

    @property
    def levels(self) -> dict[str, float]:
        """Level of the utilisation by test, of the tests that have one."""
        found = {}
        for test in self.summary.utilisation:
            level = self.summary.utilisation_level.get(test)
            if level is None and test == "speed":
                level = self.summary.scalars.get("peak_command")
            if level is not None:
                found[test] = level
        return found


@dataclass(frozen=True)
class Planned:
    """Plan of a study.

    Attributes:
        name: name of the study.
        toy: whether it is a toy study.
        designs: names of the designs that are trained alone.
        families: names of the families.
        seeds: seeds of each.
        stages: stages of each.
        arms: arms of each evaluation.
        protocols: protocols of each evaluation.
        failed: names of jobs that failed.
        recipe: name of the recipe; None if unknown.
        iterations: iterations by stage; empty if unknown.
        seconds: time of each finished job, its start included [s].
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
    recipe: str | None = None
    iterations: Mapping[str, int] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Study:
    """Records of a study.

    Attributes:
        name: name of the study, or of its folder.
        singles: runs of one design.
        families: runs of several designs.
        evaluations: evaluations of the runs.
        warnings: what was omitted, and why.
        planned: plan; None if unknown, as in a folder of single runs.
    """

    name: str
    singles: tuple[Trained, ...]
    families: tuple[Trained, ...]
    evaluations: tuple[Evaluation, ...]
    warnings: tuple[str, ...]
    planned: Planned | None

    @property
    def members(self) -> dict[str, LeggedRobot]:
        """Designs that were trained alone, by name, from the shortest leg to the longest."""
        found = {one.members[0].name: one.members[0] for one in self.singles}
        return dict(sorted(found.items(), key=lambda item: (item[1].leg_length, item[0])))

    @property
    def titles(self) -> dict[str, str]:
        """Title of each design: its name, without the robot's if all are of one robot."""
        names = list(self.members)
        robots = {name.partition(":")[0] for name in names}
        if len(robots) == 1 and all(":" in name for name in names):
            return {name: name.partition(":")[2] for name in names}
        return {name: name for name in names}

    def title(self, run: Trained) -> str:
        """Return the title of a run's design, or "family of N"."""
        if not run.single:
            return f"family of {len(run.members)}"
        return self.titles.get(run.key[0], run.key[0])

    @property
    def seeds(self) -> list[int]:
        """Seeds of any run of one design."""
        return sorted({one.seed for one in self.singles})

    @property
    def protocol(self) -> str:
        """Protocol of most of the report: "walking" if any evaluation used it."""
        found = {one.protocol for one in self.evaluations}
        return next((name for name in PROTOCOLS if name in found), PROTOCOLS[0])

    @property
    def arms(self) -> list[str]:
        """Arms of any evaluation."""
        found = {one.arm for one in self.evaluations}
        return [arm for arm in ARMS if arm in found]

    def of(self, design: str, arm: str, protocol: str | None = None) -> Iterator[Evaluation]:
        """Yield the evaluations of a design that was trained alone, by seed and stage."""
        for one in self.evaluations:
            members = one.run.members
            same = len(members) == 1 and members[0].name == design and one.arm == arm
            if same and one.protocol == (protocol or self.protocol):
                yield one


def seeds_in_words(seeds: Sequence[int]) -> str:
    """Return seeds in words: "seed 0", "seeds 0, 1"."""
    listed = ", ".join(map(str, sorted(seeds)))
    return f"seed {listed}" if len(seeds) == 1 else f"seeds {listed}"
