"""Records of a study: trainings, evaluations and the plan, as `folder` reads and writes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PlainValidator, model_validator
from pydantic.types import GetPydanticSchema
from pydantic_core import core_schema

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.measuring.summary import ARMS, PROTOCOLS, Arm, Protocol, Summary
from draft.learn.measuring.utilisation import BINS, CELLS
from draft.learn.task.stages import STAGES, StageName
from draft.values import Array

Key = tuple[str, str, int]
Joint = Literal["hip roll", "hip pitch", "knee"]
Quantity = Literal["torque", "speed", "sum"]


def _filled(counts: Sequence[int], length: int) -> Array:
    if len(counts) > length:
        raise ValueError("it counts more bins than there are")
    return np.pad(np.array(counts, dtype=float), (0, length - len(counts)))


def _cut(counts: Array) -> list[int]:
    return [int(count) for count in np.trim_zeros(counts, "b")]


def _cells(rows: Sequence[Sequence[int]]) -> Array:
    return np.array([_filled(row, CELLS) for row in rows]).reshape(CELLS, CELLS)


def _stored(integers: core_schema.CoreSchema, read: Any, write: Any) -> GetPydanticSchema:
    """Array that a file holds as whole numbers, without trailing zeros."""
    text = core_schema.plain_serializer_function_ser_schema(write)
    schema = core_schema.no_info_after_validator_function(read, integers, serialization=text)
    return GetPydanticSchema(lambda *_: schema)


_INTEGERS = core_schema.list_schema(core_schema.int_schema())
Bins = Annotated[Array, _stored(_INTEGERS, lambda counts: _filled(counts, BINS), _cut)]
Cells = Annotated[
    Array,
    _stored(core_schema.list_schema(_INTEGERS), _cells, lambda cells: [*map(_cut, cells)]),
]


class Record(BaseModel):
    """Part of a file of results; unknown keys and infinite numbers are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Samples(Record):
    """Counted samples of a skill test at the level of its utilisation.

    Attributes:
        bins: samples by bin, shape (BINS,), by joint class and quantity.
        plane: samples by cell of torque and speed, shape (CELLS, CELLS), by joint class.
    """

    bins: dict[Joint, dict[Quantity, Bins]] = Field(default_factory=dict)
    plane: dict[Joint, Cells] = Field(default_factory=dict)

    def add(self, other: Samples) -> None:
        """Add the samples of another evaluation."""
        for joint, by_quantity in other.bins.items():
            own = self.bins.setdefault(joint, {})
            for quantity, counts in by_quantity.items():
                own[quantity] = own.get(quantity, 0) + counts
        for joint, cells in other.plane.items():
            self.plane[joint] = self.plane.get(joint, 0) + cells


class Outcome(Record):
    """Summary of an evaluation, with its counted samples by test.

    There are samples of the nominal arm of one design.
    """

    summary: Summary
    samples: dict[str, Samples]

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


class Trained(Record):
    """A run: its training and its evaluations.

    Attributes:
        name: name of its folder.
        design: name of its first robot.
        stage: stage of the training.
        seed: seed of the training.
        robots: hash of its robots.
        planned: iterations that were planned.
        iterations: iterations done.
        seconds: time of training [s]; None if unknown.
        engine: physics engine; None if unknown.
        processes: processes that shared the training; None if unknown.
        versions: versions of the packages at its start.
        curve: curve of its training by column, see `draft.learn.training.progress.thin`.
        evaluations: its evaluations by arm and protocol.
        members: its robots, which have files of their own.
        plan: what all runs of its stage share, see `run.Plan.record`.
    """

    format: Literal[1]
    name: str = Field(alias="run")
    design: str
    stage: StageName
    seed: int
    robots: str
    planned: int = Field(ge=0)
    iterations: int = Field(ge=0)
    seconds: float | None
    engine: str | None
    processes: int | None
    versions: dict[str, str]
    curve: dict[str, list[float | None]]
    evaluations: dict[str, Outcome]
    members: Annotated[tuple[LeggedRobot, ...], PlainValidator(tuple)] = Field((), exclude=True)
    plan: dict[str, Any] = Field({}, exclude=True)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len({len(values) for values in self.curve.values()}) > 1:
            raise ValueError("curve: its columns differ in length")
        for name, one in self.evaluations.items():
            if name != one.name:
                raise ValueError(f"evaluations.{name}: it is of {one.name}")
        return self

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
        return self.design, self.stage, self.seed

    @property
    def place(self) -> tuple[str, int, int]:
        """Place among other runs: by design, stage and seed."""
        return self.design, list(STAGES).index(self.stage), self.seed

    @property
    def single(self) -> bool:
        """Whether it has one design."""
        return len(self.members) == 1


class Evaluation(Outcome):
    """One arm and protocol of a run's evaluation, with the run."""

    run: Trained


def levels_of(summary: Summary) -> dict[str, float]:
    """Return the level of the utilisation by test, of the tests that have one."""
    found = {}
    for test in summary.utilisation:
        level = summary.utilisation_level.get(test)
        if level is None and test == "speed":
            level = summary.scalars.get("peak_command")
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
        runs: its runs.
        warnings: what was omitted, and why.
        planned: plan; None if unknown, as in a folder of single runs.
    """

    name: str
    runs: tuple[Trained, ...]
    warnings: tuple[str, ...]
    planned: Planned | None

    @cached_property
    def singles(self) -> tuple[Trained, ...]:
        """Runs of one design, by design, stage and seed."""
        return tuple(sorted((one for one in self.runs if one.single), key=lambda one: one.place))

    @cached_property
    def families(self) -> tuple[Trained, ...]:
        """Runs of several designs, likewise."""
        many = (one for one in self.runs if not one.single)
        return tuple(sorted(many, key=lambda one: one.place))

    @cached_property
    def evaluations(self) -> tuple[Evaluation, ...]:
        """Evaluations of the runs, by name."""
        return tuple(
            Evaluation(run=run, summary=one.summary, samples=one.samples)
            for run in sorted(self.runs, key=lambda run: run.name)
            for one in run.evaluations.values()
        )

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
        return self.titles.get(run.design, run.design)

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
