"""Training of designs by their names and a few options, as the command and Python ask for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ParamSpec, Protocol

from draft.design import Design
from draft.errors import DraftError, counted
from draft.learn.bodies.designs import open_bodies
from draft.learn.bodies.generated import BODIES, generate, together
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.machine import devices
from draft.learn.task.config import Config
from draft.learn.task.recipes import ANY, MACHINE, RECIPES, TUNE, default
from draft.learn.training import session as training
from draft.learn.training.options import TrainOptions
from draft.learn.training.progress import Progress
from draft.learn.training.run import Plan, Run, is_run, open_run
from draft.settings import by_keyword
from draft.spec import Spec

Designs = Run | Design | Spec | str | Path | Sequence[Design | Spec | str | Path]
P = ParamSpec("P")


class _Train(Protocol[P]):
    """Type of `train`, with the options of the record as keyword arguments."""

    def __call__(
        self,
        designs: Designs,
        out: str | Path | None = None,
        progress: Callable[[Progress], None] | None = None,
        *args: P.args,
        **options: P.kwargs,
    ) -> Run: ...


def _with_options(record: Callable[P, TrainOptions]) -> Callable[[Callable[..., Run]], _Train[P]]:
    return by_keyword(record)


@_with_options(TrainOptions)
def train(
    designs: Designs,
    out: str | Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    *,
    options: TrainOptions,
) -> Run:
    """Train a legged robot's policy, or resume its training.

    A call that was interrupted, or that `minutes` ended, resumes when it is repeated.

        >>> run = draft.train("cheetah", "walk", iterations=1, envs=4, replicas=1, device="cpu")
        >>> run
        Run('walk', quadruped:cheetah, stage base, 1 iteration)

    Args:
        designs: a quadruped with hip roll, hip pitch and knee per leg, or its reference:
            "cheetah", "quadruped:bear", a folder; or several, which learn one policy in one
            simulation; or a run, or its folder, to resume.
        out: folder of the run; None for `runs/DESIGN-STAGE-SEED`.
        progress: called after every iteration.
        options: fields of `TrainOptions`, by keyword.

    Returns:
        The run: `run.folder`, `run.done()` iterations, `run.checkpoint()`.

    Raises:
        DraftError: an argument is invalid, a design cannot be trained, the folder holds something
            else, another process has the run, or the extra `learn` is not installed.
    """
    run = prepare(designs, out, options)
    if not training.finished(run, options):
        where = training.setting_of(run, options)
        training.train_on(run, options, where, progress or (lambda now: None))
    return run


def prepare(
    designs: Designs,
    out: str | Path | None,
    options: TrainOptions,
    report: Callable[[str], object] = lambda note: None,
) -> Run:
    """Create a run, or open an existing one, without training it.

    `report` is called with a note on designs that were drawn and cannot be trained.

    Raises:
        DraftError: as `train`; nothing is written then.
    """
    if isinstance(designs, Run):
        return designs
    given = [designs] if isinstance(designs, (Design, Spec, str, Path)) else [*designs]
    match given:
        case [str() | Path() as folder] if is_run(Path(folder)):
            return open_run(Path(folder))
    numbers, of_design = _split(options.values or {})
    Config().with_values(numbers)
    if given == [ANY.name]:
        options = _of_any(options)
        found = together(generate(options.bodies or BODIES, options.seed))
    else:
        # Designs and numbers are checked before devices, for which PyTorch is imported.
        found = open_bodies(given, options.vary, options.bodies, of_design, options.seed)
    if found.note:
        report(found.note)
    family = found.members
    drawn = len(options.vary) or given == [ANY.name]
    named = () if drawn else family  # Designs that are drawn take turns.
    _check_worlds(options.envs, named)
    recipe = RECIPES[options.recipe] if options.recipe else default(devices(options.device))
    if given != [ANY.name]:
        recipe = recipe.for_joints(max(len(member.joints) for member in family))
    config = recipe.config.with_values(numbers)
    plan = Plan.of(family, options, recipe, config, options.stage, options.seed, options.see_design)
    _check_worlds(plan.environments, named)
    texts = {m.name: text for m, text in zip(family, found.texts, strict=True)}
    folder = Path(out) if out is not None else Path("runs") / _name(plan, given)
    nothing = options.origin in (None, training.SCRATCH) and not is_run(folder)
    if options.recipe in (TUNE.name, MACHINE.name) and nothing:
        cause = f"recipe {options.recipe} starts from a policy that can run, and none is named"
        remedy = 'add `stage="velocity"` `origin="family"`, or `origin="any"` for other legs'
        raise DraftError(cause, remedy)
    # Before anything is written.
    training.check_fits(plan, training.setting(plan, options))
    return training.begin(folder, plan, texts, options.origin)


def _of_any(options: TrainOptions) -> TrainOptions:
    """Options of a training with bodies of all kinds.

    Raises:
        DraftError: one is of a training with one topology.
    """
    if len(options.vary):
        raise DraftError(f"`vary` and '{ANY.name}': its bodies are drawn already", "omit `vary`")
    if options.stage not in ("base", ANY.name) or options.ground == "uneven":
        raise DraftError(f"'{ANY.name}' has a stage of its own, on flat ground", "omit `stage`")
    return options.model_copy(
        update={"stage": ANY.name, "see_design": True, "recipe": options.recipe or ANY.name}
    )


def _split(values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Values of the task, and values of the design."""
    groups = tuple(f"{name}." for name in Config().as_dict())
    of_task = {name: value for name, value in values.items() if name.startswith(groups)}
    return of_task, {name: value for name, value in values.items() if name not in of_task}


def _check_worlds(environments: int | None, family: Sequence[LeggedRobot]) -> None:
    """Refuse fewer worlds than designs."""
    if environments is not None and environments < len(family):
        cause = f"{counted(environments, 'world')} cannot hold {len(family)} designs"
        raise DraftError(cause, f"give `envs={len(family)}` or more")


def _name(plan: Plan, designs: Sequence[Design | Spec | str | Path]) -> str:
    """Name of a run's folder."""
    first, count = designs[0], len(plan.members)
    reference = first.reference if isinstance(first, Design) else str(first)
    if isinstance(first, Spec):
        reference = first.name
    name = reference.rstrip("/").rpartition("/")[2].replace(":", "-")
    if count == 1:
        robot, _, label = plan.members[0].name.rpartition(":")
        name = f"{robot}_custom" if robot and label == "custom" else label
    elif len(designs) > 1:
        name = f"{name}-and-{count - 1}-more"
    else:
        name = f"{name}-{count}-bodies"
    return f"{name}-{plan.stage}-{plan.seed}"
