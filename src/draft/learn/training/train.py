"""Training of designs by their names and a few arguments, as the command and Python ask for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from draft.design import Design
from draft.errors import DraftError, counted, suggest
from draft.explore.vary import Vary
from draft.learn.bodies.designs import open_bodies
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.machine import devices
from draft.learn.task.config import STAGES, Config
from draft.learn.task.recipes import RECIPES, TUNE, default
from draft.learn.training import session as training
from draft.learn.training.progress import Progress
from draft.learn.training.run import Plan, Run, is_run, open_run
from draft.spec import Spec

GROUNDS = ("flat", "uneven")
Designs = Run | Design | Spec | str | Path | Sequence[Design | Spec | str | Path]
Values = Mapping[str, float | str | None]


def train(
    designs: Designs,
    out: str | Path | None = None,
    *,
    stage: str = "base",
    seed: int = 0,
    origin: str | Path | None = None,
    iterations: int | None = None,
    minutes: float | None = None,
    envs: int | None = None,
    values: Values | None = None,
    vary: Vary = (),
    bodies: int | None = None,
    recipe: str | None = None,
    ground: str | None = None,
    see_design: bool = False,
    device: str = "auto",
    engine: str = "auto",
    replicas: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    wandb: str | None = None,
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
        stage: "base" (walking), "velocity", "terrain" or "push".
        seed: seed of everything random.
        origin: run or ONNX file whose policy a later stage starts from, "family" for the one that
            ships, or "scratch"; None for the base run beside `out`.
        iterations: iterations in all, those of earlier calls included; None for the stage's.
        minutes: time limit of this call [min]; None for no limit.
        envs: simulated worlds: on each GPU, or on all cores together; None for the recipe's.
        values: values by name that override those of the design ("thigh_length") or of the task
            ("rewards.height", as `draft learn show` lists them).
        vary: ranges by name, as `draft.screen` takes them, to draw a family of designs.
        bodies: number of designs to draw with `vary`.
        recipe: "paper" (published numbers), "laptop" or "tune" (of a policy that can run); None for
            "laptop" on a CPU.
        ground: "flat" or "uneven"; None for the recipe's.
        see_design: whether the policy observes the numbers in which designs differ.
        device: "auto", "cpu", "cuda", "cuda:1", "all", or numbers of GPUs such as "0,1".
        engine: "auto", "native" (MuJoCo) or "warp" (MuJoCo Warp).
        replicas: processes that share the run on a CPU; None for one per physical core.
        progress: called after every iteration.
        wandb: project of Weights & Biases; None for TensorBoard alone.

    Returns:
        The run: `run.folder`, `run.done()` iterations, `run.checkpoint()`.

    Raises:
        DraftError: an argument is invalid, a design cannot be trained, the folder holds something
            else, another process has the run, or the extra `learn` is not installed.
    """
    run = prepare(
        designs,
        out,
        stage=stage,
        seed=seed,
        origin=origin,
        iterations=iterations,
        minutes=minutes,
        envs=envs,
        values=values,
        vary=vary,
        bodies=bodies,
        recipe=recipe,
        ground=ground,
        see_design=see_design,
        device=device,
        engine=engine,
        replicas=replicas,
    )
    if not training.finished(run, iterations):
        where = training.setting_of(run, device, engine, replicas)
        total = training.iterations_of(run, iterations)
        training.train_on(run, total, where, minutes, progress or (lambda now: None), wandb)
    return run


def prepare(
    designs: Designs,
    out: str | Path | None = None,
    *,
    stage: str = "base",
    seed: int = 0,
    origin: str | Path | None = None,
    iterations: int | None = None,
    minutes: float | None = None,
    envs: int | None = None,
    values: Values | None = None,
    vary: Vary = (),
    bodies: int | None = None,
    recipe: str | None = None,
    ground: str | None = None,
    see_design: bool = False,
    device: str = "auto",
    engine: str = "auto",
    replicas: int | None = None,
    report: Callable[[str], object] = lambda note: None,
) -> Run:
    """Create a run, or open an existing one, without training it.

    The arguments are those of `train`; `report` is called with a note on designs that were drawn
    and cannot be trained.

    Raises:
        DraftError: as `train`; nothing is written then.
    """
    _check(stage, seed, iterations, minutes, envs, recipe, ground)
    if isinstance(designs, Run):
        return designs
    given = [designs] if isinstance(designs, (Design, Spec, str, Path)) else [*designs]
    match given:
        case [str() | Path() as folder] if is_run(Path(folder)):
            return open_run(Path(folder))
    numbers, of_design = _split(values or {})
    Config().with_values(numbers)
    # Designs and numbers are checked before devices, for which PyTorch is imported.
    found = open_bodies(given, vary, bodies, of_design, seed)
    if found.note:
        report(found.note)
    family = found.members
    named = () if len(vary) else family  # Designs that are drawn take turns.
    _check_worlds(envs, named)
    chosen = RECIPES[recipe] if recipe else default(devices(device))
    config = chosen.config.with_values(numbers)
    environments = envs or config.learning.environments
    _check_worlds(environments, named)
    plan = Plan(
        members=family,
        stage=stage,
        seed=seed,
        environments=environments,
        config=config,
        ground=ground or chosen.ground(stage),
        see_design=see_design,
        see_ground=(ground or chosen.ground(stage)) == "uneven",
    )
    texts = {m.name: text for m, text in zip(family, found.texts, strict=True)}
    folder = Path(out) if out is not None else Path("runs") / _name(plan, given)
    if recipe == TUNE.name and origin in (None, training.SCRATCH) and not is_run(folder):
        cause = "recipe tune is for policies that can run, and there is none to start from"
        raise DraftError(cause, 'add `stage="velocity"` `origin="family"`, or `origin=RUN`')
    # Before anything is written.
    training.check_fits(plan, training.setting(plan, device, engine, replicas))
    return training.begin(folder, plan, texts, origin)


def _split(values: Values) -> tuple[dict[str, float | str | None], dict[str, float | str | None]]:
    """Values of the task, and values of the design."""
    groups = tuple(f"{name}." for name in Config().as_dict())
    of_task = {name: value for name, value in values.items() if name.startswith(groups)}
    return of_task, {name: value for name, value in values.items() if name not in of_task}


def _check(
    stage: str,
    seed: int,
    iterations: int | None,
    minutes: float | None,
    envs: int | None,
    recipe: str | None,
    ground: str | None,
) -> None:
    """Refuse numbers out of range, and unknown names."""
    for name, value, most in (
        ("iterations", iterations, 10**7),
        ("envs", envs, 10**6),
        ("minutes", minutes, 10**6),
    ):
        if value is not None and not 0 < value <= most:
            cause = f"`{name}` {value} is not above 0 and at most {most}"
            raise DraftError(cause, "omit it for the default")
    if not 0 <= seed < 2**31:
        raise DraftError(f"`seed` {seed} is not from 0 to 2**31 - 1", "such as 0")
    for what, name, known in (
        ("stage", stage, STAGES),
        ("recipe", recipe, tuple(RECIPES)),
        ("ground", ground, GROUNDS),
    ):
        if name is not None and name not in known:
            raise DraftError(f"there is no {what} '{name}'", suggest(name, known))


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
