"""A study's file: which designs, seeds, stages and numbers, typed and checked with their places."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BeforeValidator, Discriminator, Field, StringConstraints, Tag
from pydantic_core import PydanticCustomError

from draft.errors import DraftError, Location, Problem, SpecError
from draft.learn.config import STAGES, Config
from draft.learn.recipes import RECIPES
from draft.spec.load import validate
from draft.spec.reader import Path_, Source, read_file
from draft.spec.schema import Model

_T = TypeVar("_T")
MOST_SEEDS = 1000


def _whole(least: int, most: int) -> Any:
    def check(value: Any) -> int:
        if type(value) is not int or not least <= value <= most:
            words = "expected a whole number from {least} to {most}"
            raise PydanticCustomError("whole", words, {"least": least, "most": most})
        return value

    return BeforeValidator(check)


def _seconds(value: Any) -> float:
    if type(value) not in (int, float) or not 0.5 <= value <= 3600:
        raise PydanticCustomError("seconds", "expected seconds from 0.5 to 3600")
    return float(value)


def _yes_no(value: Any) -> bool:
    if type(value) is not bool:
        raise PydanticCustomError("yes_no", "expected true or false")
    return value


def _unique(values: list[_T]) -> list[_T]:
    for value in values:
        if values.count(value) > 1:
            raise PydanticCustomError("unique", "{value} stands twice", {"value": str(value)})
    return values


def _stages(values: Any) -> Any:
    if isinstance(values, list) and all(value in STAGES for value in values):
        _unique(values)
        if values[:1] != ["base"]:
            raise PydanticCustomError("base", "'base' must come first: the others start from it")
        if values != [stage for stage in STAGES if stage in values]:
            order = {"order": ", ".join(STAGES)}
            raise PydanticCustomError("order", "out of order; the order is {order}", order)
    return values


def _kind(one: str, other: str, kind: type) -> Discriminator:
    return Discriminator(lambda value: one if isinstance(value, kind) else other)


Seed = Annotated[int, _whole(0, 2**31 - 1)]
Worlds = Annotated[int, _whole(1, 10**6)]
Iterations = Annotated[int, _whole(1, 10**7)]
Replicas = Annotated[int, _whole(1, 10**5)]
Switch = Annotated[bool, BeforeValidator(_yes_no)]
Seconds = Annotated[float, BeforeValidator(_seconds)]
Stage = Literal["base", "velocity", "terrain", "push"]
Errors = Literal["twins", "survey", "paper"]
RecipeName = Literal["paper", "laptop"]
Word = Annotated[str, StringConstraints(min_length=1, max_length=400)]
# As a file's name and in the names of jobs.
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
    """The design around which they are drawn."""
    vary: Annotated[list[Word], Field(min_length=1)]
    """What is varied, such as thigh_length=0.2:0.3."""
    bodies: Annotated[int, _whole(1, 4096)]
    """How many are drawn."""
    seed: Seed = 0
    """Of the draws; all seeds of the study train the same bodies."""
    see_design: Switch = True
    """Whether the policy sees what tells them apart."""
    name: Label | None = None
    """How it is called; DESIGN-N-bodies where it is left away."""


class Evaluation(Model):
    """How policies are evaluated."""

    replicas: Replicas = 256
    """Worlds per level."""
    levels: Annotated[int, _whole(1, 100)] | None = None
    """Levels per battery, spread over its range; all where it is left away."""
    seconds: Seconds = 12.0
    """Of a roll-out."""
    perturbed: Switch = True
    """Also with perturbed inertias."""
    errors: Errors = "twins"
    """Whose errors those have: the twins of Go2 and B2, all surveyed quadrupeds, or published."""
    published: Switch = False
    """Also by the published protocol, where a tenth stand."""
    seed: Seed = 0
    """Of everything random in it."""


class ToyEvaluation(Model):
    """What a toy study evaluates otherwise."""

    replicas: Replicas = 4
    """Worlds per level."""
    levels: Annotated[int, _whole(1, 100)] = 3
    """Levels per battery."""
    seconds: Seconds = 3.0
    """Of a roll-out."""
    perturbed: Switch | None = None
    """As the study where it is left away."""
    published: Switch | None = None
    """As the study where it is left away."""


class Toy(Model):
    """What --toy replaces: everything so small that a laptop's processor does it in minutes."""

    seeds: Seeds = 1
    """How many, or which."""
    environments: Worlds = 8
    """Worlds at once."""
    iterations: Annotated[int, _whole(1, 10**7)] = 2
    """Of every stage."""
    set: Numbers = Field(default_factory=lambda: dict(TOY_NUMBERS))
    """Numbers of the tasks besides those of the study."""
    evaluate: ToyEvaluation = ToyEvaluation()
    """How policies are evaluated."""


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


class StudyFile(Model):
    """A study as it is written."""

    designs: Annotated[list[Design], Field(min_length=1)]
    """Each a word as 'draft train' reads it, or a family."""
    seeds: Seeds = 10
    """How many, or which."""
    stages: Annotated[list[Stage], Field(min_length=1), BeforeValidator(_stages)] = Field(
        default_factory=lambda: list(STAGES)
    )
    """What is trained; all but base start from base."""
    recipe: RecipeName = "paper"
    """Numbers and grounds that the others change, on any machine: published, or a laptop's."""
    environments: Worlds | None = None
    """Worlds at once, of each training; the recipe's where it is left away."""
    iterations: dict[Stage, Iterations] = Field(default_factory=dict)
    """Of a stage; the recipe's where it is left away."""
    set: Numbers = Field(default_factory=dict)
    """Numbers of the tasks, as 'draft learn show' lists them."""
    evaluate: Evaluation = Evaluation()
    """How policies are evaluated."""
    toy: Toy = Toy()
    """What --toy replaces."""


class Study:
    """A study that was read and checked, as it is to be run.

    Attributes:
        name: of its file.
        text: the file.
        toy: whether it is the toy of it.
        designs: words and families.
        seeds: of everything random.
        stages: what is trained.
        recipe: numbers and grounds that the file starts from.
        environments: worlds at once.
        config: the numbers of the tasks.
        changed: those that the file changes, by name.
        evaluate: how policies are evaluated.
    """

    def __init__(self, source: Source, name: str, text: str, toy: bool = False) -> None:
        """Check what a file says.

        Raises:
            SpecError: it is no study; each problem has its place.
        """
        file = validate(StudyFile, source)
        self._source = source
        self._iterations: dict[str, int] = {
            str(stage): count for stage, count in file.iterations.items()
        }
        self.name, self.text, self.toy = name, text, toy
        self.designs, self.stages = tuple(file.designs), tuple(file.stages)
        self.recipe, self.evaluate = RECIPES[file.recipe], file.evaluate
        environments = file.environments
        self.changed: dict[str, Any] = {}
        seeds = file.seeds
        self._check_iterations()
        self._set(file.set, ("set",))
        if toy:
            small = file.toy
            seeds, environments = small.seeds, small.environments
            self._iterations = dict.fromkeys(map(str, self.stages), small.iterations)
            told = small.evaluate.model_dump(exclude_none=True)
            self.evaluate = file.evaluate.model_copy(update=told)
        # The toy's numbers are checked even where it is not asked for.
        kept = dict(self.changed)
        self._set(file.toy.set, ("toy", "set"))
        self.changed = self.changed if toy else kept
        self.config = self.recipe.config.with_values(self.changed)
        self.environments = environments or self.config.learning.environments
        self.seeds = tuple(seeds) if isinstance(seeds, list) else tuple(range(seeds))

    def iterations(self, stage: str) -> int:
        """Iterations of a stage."""
        return self._iterations.get(stage) or self.config.learning.iterations(stage)

    def place(self, *path: str | int) -> Location:
        """Where the file says something."""
        return self._source.at(path)

    def _set(self, values: Mapping[str, Any], path: Path_) -> None:
        for name, value in values.items():
            at_place(
                lambda name=name, value=value: Config().with_values({name: value}),
                self._source.at((*path, name), key=True),
            )
            self.changed[name] = value

    def _check_iterations(self) -> None:
        for stage in self._iterations:
            if stage not in self.stages:
                where = self._source.at(("iterations", stage), key=True)
                remedy = f"stages: {', '.join(self.stages)}"
                raise SpecError(Problem(f"stage '{stage}' is not trained here", where, remedy))


def at_place(make: Callable[[], _T], where: Location) -> _T:
    """Do something whose errors are told at a place of a file.

    Raises:
        DraftError: as it was raised, with the place.
    """
    try:
        return make()
    except DraftError as error:
        problems = [Problem(_cause(p), where, p.remedy) for p in error.problems]
        raise type(error)(problems) from None


def _cause(problem: Problem) -> str:
    return f"{problem.where}: {problem.cause}" if problem.where else problem.cause


def read(path: Path, toy: bool = False) -> Study:
    """Read a study's file.

    Args:
        path: the file.
        toy: read it as the toy of it.

    Raises:
        SpecError: there is none, or it is no study; each problem has its place.
    """
    source = read_file(path, "name a study's file, such as examples/three_quadrupeds.yaml")
    if not isinstance(source.data, dict):
        where = Location(str(path), 1, 1)
        raise SpecError(Problem("a study is a mapping of keys", where, "designs: [cheetah]"))
    return Study(source, path.stem, path.read_text(encoding="utf-8"), toy)
