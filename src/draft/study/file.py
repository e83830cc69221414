"""A study's file: designs, seeds, stages and numbers, checked, with line and column of errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AliasGenerator,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from draft.errors import DraftError, Location, Problem, SpecError
from draft.laws.residuals import ErrorSource
from draft.learn.measuring.evaluation_options import RollOuts
from draft.learn.task.config import Config
from draft.learn.task.recipes import RECIPES, TUNE
from draft.learn.task.stages import PUBLISHED, STAGES, StageName, one_of
from draft.learn.training.options import TaskOptions, TrainOptions
from draft.learn.training.run import SHIPPED
from draft.settings import expected
from draft.spec.field_types import unknown_keys
from draft.spec.load import validate
from draft.spec.reader import Path_, Source, read_file
from draft.spec.schema import Model

_T = TypeVar("_T")
MOST_SEEDS = 1000
# Keys of the file that are not the names of the options.
_KEYS = {"envs": "environments", "values": "set"}


def _whole(least: int, most: int) -> BeforeValidator:
    def check(value: object) -> int:
        if type(value) is not int or not least <= value <= most:
            words = "expected a whole number from {least} to {most}"
            raise PydanticCustomError("whole", words, {"least": least, "most": most})
        return value

    return BeforeValidator(check)


def _option(name: str) -> BeforeValidator:
    """Check a value as an option of a training, which is not None."""

    def check(value: object) -> object:
        try:
            found = getattr(TrainOptions.model_validate({name: value}), name)
        except ValidationError:
            found = None
        if found is None:
            words = {"words": expected(TrainOptions.model_fields[name])}
            raise PydanticCustomError("expected", "expected {words}", words)
        return found

    return BeforeValidator(check)


def _unique(values: list[_T]) -> list[_T]:
    for value in values:
        if values.count(value) > 1:
            raise PydanticCustomError("unique", "{value} is listed twice", {"value": str(value)})
    return values


def _stages(values: object) -> object:
    if isinstance(values, list) and all(value in STAGES for value in values):
        _unique(values)
        if values != [stage for stage in STAGES if stage in values]:
            order = {"order": ", ".join(STAGES)}
            raise PydanticCustomError("order", "out of order; the order is {order}", order)
    return values


def _kind(one: str, other: str, kind: type) -> Discriminator:
    return Discriminator(lambda value: one if isinstance(value, kind) else other)


Seed = Annotated[int, _option("seed")]
Iterations = Annotated[int, _option("iterations")]
Word = Annotated[str, StringConstraints(min_length=1, max_length=400)]
# Part of file names and of the names of jobs.
Label = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.]*$", max_length=64)]
Seeds = Annotated[
    Annotated[
        list[Seed],
        Field(min_length=1, max_length=MOST_SEEDS),
        BeforeValidator(lambda v: _unique(v) if isinstance(v, list) else v),
        Tag("(list)"),
    ]
    | Annotated[int, _whole(1, MOST_SEEDS), Tag("(count)")],
    _kind("(list)", "(count)", list),
]
Numbers = dict[str, Any]


class Family(Model):
    """Designs drawn around one, which train one policy in one simulation."""

    design: Word
    """Design around which the bodies are drawn."""
    vary: Annotated[list[Word], Field(min_length=1)]
    """Ranges of what is varied, such as thigh_length=0.2:0.3."""
    bodies: Annotated[int, _option("bodies")]
    """Number of bodies that are drawn."""
    seed: Seed = 0
    """Seed of the draws; all seeds of the study train the same bodies."""
    see_design: Annotated[bool, _option("see_design")] = True
    """Whether the policy observes the numbers that distinguish the bodies."""
    name: Label | None = None
    """Name of the family; DESIGN-N-bodies by default."""


class Evaluation(Model, RollOuts):
    """Settings of the evaluation."""

    levels: Annotated[int | None, Field(ge=1, le=100)] = None
    """Levels per skill test, spread over its range; all by default."""
    perturbed: bool = True
    """Whether to evaluate with perturbed inertias too."""
    errors: ErrorSource = "twins"
    """Source of the inertia errors: twins of Go2 and B2, all surveyed quadrupeds, or published."""
    published: bool = False
    """Whether to evaluate by the published protocol too, in which a tenth of the robots stand."""


class Toy(Model):
    """Values of a toy of the study, so small that a laptop's processor needs only minutes."""

    seeds: Seeds = 1
    """Number of seeds, or a list of them."""
    environments: Annotated[int, _option("envs")] = 8
    """Number of worlds of each training."""
    iterations: Iterations = 2
    """Iterations of every stage."""
    set: Numbers = Field(default_factory=lambda: dict(TOY_NUMBERS))
    """Numbers of the tasks, on top of those of the study."""
    evaluate: Evaluation = Evaluation()
    """Settings of the evaluation; of others than these: 4 replicas, 3 levels, 3 seconds."""


TOY_EVALUATION: Mapping[str, Any] = {"replicas": 4, "levels": 3, "seconds": 3.0}
TOY_NUMBERS: Mapping[str, Any] = {
    "learning.steps": 8,
    "learning.hidden": [32, 32],
    "observations.map_pitch": 0.1,
    "ground.rows": 4,
    "ground.border": 2.0,
}

Design = Annotated[
    Annotated[Word, Tag("(word)")] | Annotated[Family, Tag("(family)")],
    _kind("(family)", "(word)", dict),
]


class Trainings(TaskOptions):
    """Options that all trainings of a study share, by the keys of the file."""

    model_config = ConfigDict(
        alias_generator=AliasGenerator(validation_alias=lambda name: _KEYS.get(name, name))
    )
    # A narrower type is sound, as the values are frozen.
    recipe: Literal["paper", "laptop", "tune"] = "paper"  # pyright: ignore[reportIncompatibleVariableOverride]
    """Numbers and grounds that the other keys override: as published, for a laptop, or for stages
    that `start` from a policy."""


class StudyFile(Model):
    """Content of a study's file; the keys of `trainings` stand beside the others."""

    designs: Annotated[list[Design], Field(min_length=1)]
    """Designs as `draft.train` takes them, and families."""
    seeds: Seeds = 10
    """Number of seeds, or a list of them."""
    stages: Annotated[list[StageName], Field(min_length=1), BeforeValidator(_stages)] = Field(
        default_factory=lambda: [stage.name for stage in PUBLISHED]
    )
    """Stages that are trained, each after the one that it starts from: base, for all others that
    have no `start`."""
    trainings: Trainings
    """Options that all trainings share."""
    iterations: dict[StageName, Iterations] = Field(default_factory=dict)
    """Iterations of each stage; the recipe's by default."""
    start: dict[StageName, Annotated[str, one_of(SHIPPED)]] = Field(default_factory=dict)
    """Policies that ship and that stages start from, such as family, in place of a stage before."""
    evaluate: Evaluation = Evaluation()
    """Settings of the evaluation."""
    toy: Toy = Toy()
    """Values of a toy of the study."""

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: object) -> object:
        """Gather the options of the trainings, and report unknown keys."""
        if not isinstance(data, dict):
            return data
        shared = [_KEYS.get(name, name) for name in Trainings.model_fields]
        known = [*(name for name in cls.model_fields if name != "trainings"), *shared]
        if not data.keys() <= set(known):
            raise unknown_keys(data, known)
        own = {key: value for key, value in data.items() if key not in shared}
        return own | {"trainings": {key: data[key] for key in shared if key in data}}


class Study:
    """A study's file that was read and checked, with its defaults filled in.

    Attributes:
        name: name of the file without its suffix.
        text: content of the file.
        toy: whether the values under `toy` hold.
        designs: references to designs, and families.
        seeds: seeds of everything random.
        stages: stages that are trained, in order.
        trainings: options of all trainings.
        recipe: numbers and grounds that the file overrides.
        environments: number of worlds of each training.
        config: numbers of the tasks.
        changed: numbers of the tasks that the file overrides, by name.
        evaluate: settings of the evaluation.
    """

    def __init__(self, source: Source, name: str, text: str, toy: bool = False) -> None:
        """Check the content of a file.

        Raises:
            SpecError: it is no study; each problem has its line and column.
        """
        file = validate(StudyFile, source)
        self._source = source
        self._iterations: dict[str, int] = {
            str(stage): count for stage, count in file.iterations.items()
        }
        self._start: dict[str, str] = {str(stage): name for stage, name in file.start.items()}
        self.name, self.text, self.toy = name, text, toy
        self.designs, self.stages = tuple(file.designs), tuple(file.stages)
        self.trainings, self.evaluate = file.trainings, file.evaluate
        self.recipe = RECIPES[file.trainings.recipe]
        self.changed: dict[str, Any] = {}
        seeds = file.seeds
        for key, given in (("iterations", self._iterations), ("start", self._start)):
            self._check_stages(key, given)
        self._check_origins()
        self._set(file.trainings.values or {}, ("set",))
        if toy:
            small = file.toy
            seeds = small.seeds
            self.trainings = file.trainings.model_copy(update={"envs": small.environments})
            self._iterations = dict.fromkeys(map(str, self.stages), small.iterations)
            given = {**TOY_EVALUATION, **small.evaluate.model_dump(exclude_unset=True)}
            self.evaluate = file.evaluate.model_copy(update=given)
        # The toy's numbers are checked even if it is not asked for.
        kept = dict(self.changed)
        # Policies that ship have layers of their own.
        small_numbers = dict(file.toy.set)
        if self._start and "set" not in file.toy.model_fields_set:
            del small_numbers["learning.hidden"]  # Policies that ship have layers of their own.
        self._set(small_numbers, ("toy", "set"))
        self.changed = self.changed if toy else kept
        self.config = self.recipe.config.with_values(self.changed)
        self.environments = self.trainings.envs or self.config.learning.environments
        self.seeds = tuple(seeds) if isinstance(seeds, list) else tuple(range(seeds))

    def iterations(self, stage: str) -> int:
        """Return the iterations of a stage."""
        return self._iterations.get(stage) or self.config.iterations(stage)

    def start(self, stage: str) -> str | None:
        """Return the name of the policy that a stage starts from; None for a stage or none."""
        return self._start.get(stage)

    def place(self, *path: str | int) -> Location:
        """Return line and column of a value, by the keys and indices that lead to it."""
        return self._source.at(path)

    def _set(self, values: Mapping[str, Any], path: Path_) -> None:
        for name, value in values.items():
            at_place(
                lambda name=name, value=value: Config().with_values({name: value}),
                self._source.at((*path, name), key=True),
            )
            self.changed[name] = value

    def _check_stages(self, key: str, given: Mapping[str, object]) -> None:
        """Refuse a stage that is not trained as the key of a mapping."""
        for stage in given:
            if stage not in self.stages:
                where = self._source.at((key, stage), key=True)
                remedy = f"stages: {', '.join(self.stages)}"
                raise SpecError(Problem(f"stage '{stage}' is not trained here", where, remedy))

    def _check_origins(self) -> None:
        """Refuse a stage that starts from nothing that it could go on from."""
        for i, stage in enumerate(self.stages):
            origin = STAGES[stage].origin
            if self.start(stage) is None and origin not in (None, *self.stages[:i]):
                cause = f"'{origin}' must come first: '{stage}' starts from it"
                remedy = f"add '{origin}', or a policy that ships: start: {{{stage}: family}}"
                raise SpecError(Problem(cause, self._source.at(("stages",)), remedy))
            if self.recipe is TUNE and self.start(stage) is None and origin is None:
                cause = f"recipe {TUNE.name} starts from a policy that can run: '{stage}' does not"
                remedy = f"start: {{{stage}: family}}"
                raise SpecError(Problem(cause, self._source.at(("recipe",)), remedy))


def at_place(make: Callable[[], _T], where: Location, remedy: str = "") -> _T:
    """Call a function, and give its errors a place in a file and, if one is given, a remedy.

    Raises:
        DraftError: the error that was raised, with the place.
    """
    try:
        return make()
    except DraftError as error:
        problems = [Problem(_cause(p), where, remedy or p.remedy) for p in error.problems]
        raise type(error)(problems) from None


def _cause(problem: Problem) -> str:
    return f"{problem.where}: {problem.cause}" if problem.where else problem.cause


def read(path: Path, toy: bool = False) -> Study:
    """Read a study's file.

    Args:
        path: the file.
        toy: whether to replace numbers by those under `toy`.

    Raises:
        SpecError: the file is missing or is no study; each problem has its line and column.
    """
    source = read_file(path, "name a study's file, such as examples/three_quadrupeds.yaml")
    if not isinstance(source.data, dict):
        where = Location(str(path), 1, 1)
        raise SpecError(Problem("a study is a mapping of keys", where, "designs: [cheetah]"))
    return Study(source, path.stem, path.read_text(encoding="utf-8"), toy)
