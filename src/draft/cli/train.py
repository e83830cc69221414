"""`draft train`: teach a quadruped to walk, in slices of time if need be."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from draft.cli.engine_option import EngineOption
from draft.cli.options import check_folder, parse_values
from draft.cli.page_options import PortOption
from draft.errors import DraftError, Problem
from draft.extras import check
from draft.learn.silence import quiet
from draft.serving.addresses import address, check_free, check_port

if TYPE_CHECKING:
    from draft.learn.recipes import Recipe
    from draft.learn.run import Plan, Run
    from draft.learn.training import Setting

LOOPBACK = "127.0.0.1"


def main(
    designs: Annotated[
        tyro.conf.Positional[tuple[str, ...]],
        tyro.conf.arg(
            metavar="DESIGN",
            help="A shipped design (cheetah), SPEC, SPEC:DESIGN, SPEC:FILE.yaml, a built model's "
            "folder, or a run's to go on with. Several train one policy in one simulation.",
        ),
    ],
    /,
    stage: Annotated[
        Literal["base", "velocity", "terrain", "push"],
        tyro.conf.arg(help="The curriculum; all but base start from a base policy."),
    ] = "base",
    seed: Annotated[int, tyro.conf.arg(metavar="N", help="Of everything random.")] = 0,
    origin: Annotated[
        str | None,
        tyro.conf.arg(
            name="from",
            metavar="RUN",
            help="Run whose policy it starts from, or 'scratch'.",
            help_behavior_hint="(default for later stages: the base run beside it)",
        ),
    ] = None,
    iterations: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Iterations in all slices.",
            help_behavior_hint="(default: the stage's)",
        ),
    ] = None,
    minutes: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="M",
            help="Stop after so long; the same command goes on.",
            help_behavior_hint="(default: no limit)",
        ),
    ] = None,
    envs: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Worlds at once: on each GPU, or on all cores together.",
            help_behavior_hint="(default: the recipe's)",
        ),
    ] = None,
    values: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            name="set",
            metavar="NAME=VALUE",
            help="Values that win: of the design (thigh_length=0.3), or of the task, as "
            "'draft learn show' lists them (rewards.height=0.4).",
            help_behavior_hint="",
        ),
    ] = (),
    vary: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="NAME=LOW:HIGH",
            help="Draw a family of designs, such as thigh_length=0.2:0.4, with --bodies.",
            help_behavior_hint="",
        ),
    ] = (),
    bodies: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N", help="How many designs to draw.", help_behavior_hint="(with --vary)"
        ),
    ] = None,
    recipe: Annotated[
        Literal["paper", "laptop"] | None,
        tyro.conf.arg(
            help="The numbers of the task: published, or for a hundredth of the steps.",
            help_behavior_hint="(default: laptop on a CPU, paper on a GPU)",
        ),
    ] = None,
    ground: Annotated[
        Literal["flat", "uneven"] | None,
        tyro.conf.arg(
            help="The ground; on a plane no heights are observed.",
            help_behavior_hint="(default: the recipe's)",
        ),
    ] = None,
    see_design: Annotated[
        bool, tyro.conf.arg(help="Let the policy see what tells designs apart.")
    ] = False,
    device: Annotated[
        str,
        tyro.conf.arg(help="auto, cpu, cuda, cuda:1, all, or numbers of GPUs such as 0,1."),
    ] = "auto",
    engine: EngineOption = "auto",
    replicas: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Processes that share the run on a CPU.",
            help_behavior_hint="(default: one per physical core)",
        ),
    ] = None,
    view: Annotated[
        bool, tyro.conf.arg(help="Show the newest checkpoint in the browser meanwhile.")
    ] = False,
    port: PortOption = 8080,
    no_review: Annotated[
        bool, tyro.conf.arg(help="End without trying out what was learnt.")
    ] = False,
    wandb: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="PROJECT",
            help="Log to Weights & Biases too.",
            help_behavior_hint="(default: TensorBoard alone)",
        ),
    ] = None,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="The run's folder.",
            help_behavior_hint="(default: runs/DESIGN-STAGE-SEED)",
        ),
    ] = None,
) -> int:
    """Train a quadruped's policy; the same command goes on where it stopped."""
    begun = time.monotonic()
    check_folder(out)
    _check(seed, iterations, minutes, envs)
    from draft.learn import training
    from draft.learn.machine import devices
    from draft.learn.recipes import RECIPES, default
    from draft.learn.run import is_run, open_run

    if view:
        check_port(port)
        check_free(LOOPBACK, port)
    if len(designs) == 1 and is_run(Path(designs[0])):
        run = open_run(Path(designs[0]))
    else:

        def numbers() -> Recipe:
            return RECIPES[recipe] if recipe else default(devices(device))

        texts, plan = _plan(
            designs, (vary, bodies), values, stage, seed, envs, numbers, ground, see_design
        )
        folder = Path(out) if out else Path("runs") / _name(plan, designs)
        # Before anything is written.
        training.check_fits(plan, training.setting(plan, device, engine, replicas))
        run = training.begin(folder, plan, texts, origin)
    where = training.setting_of(run, device, engine, replicas)
    page = _page(run, port) if view else contextlib.nullcontext()
    with page:
        left = None if minutes is None else minutes - (time.monotonic() - begun) / 60.0
        return _train(run, iterations, left, where, wandb, not no_review)


def _check(seed: int, iterations: int | None, minutes: float | None, envs: int | None) -> None:
    """Refuse numbers that make no sense."""
    for name, value, most in (
        ("iterations", iterations, 10**7),
        ("envs", envs, 10**6),
        ("minutes", minutes, 10**6),
    ):
        if value is not None and not 0 < value <= most:
            cause = f"--{name} {value} is not above 0 and at most {most}"
            raise DraftError(Problem(cause, None, "leave it away for the default"))
    if not 0 <= seed < 2**31:
        raise DraftError(Problem(f"--seed {seed} is not from 0 to 2**31 - 1", None, "such as 0"))


def _plan(
    words: tuple[str, ...],
    varied: tuple[tuple[str, ...], int | None],
    values: tuple[str, ...],
    stage: str,
    seed: int,
    envs: int | None,
    choose_recipe: Callable[[], Recipe],
    ground: str | None,
    see_design: bool,
) -> tuple[dict[str, str], Plan]:
    """What the command line asks for, and the designs as files.

    Designs and numbers are checked before the recipe is chosen, for which PyTorch is asked.
    """
    from draft.learn.bodies import open_bodies
    from draft.learn.config import Config
    from draft.learn.run import Plan
    from draft.model.folder import design_text

    groups = tuple(f"{name}." for name in Config().as_dict())
    numbers = tuple(word for word in values if word.strip().startswith(groups))
    of_design = tuple(word for word in values if word not in numbers)
    changed = parse_values(numbers)
    Config().with_values(changed)
    bodies = open_bodies(words, *varied, parse_values(of_design), seed)
    if bodies.note:
        print(bodies.note, file=sys.stderr)
    family = bodies.members
    _check_worlds(envs, family)
    recipe = choose_recipe()
    config = recipe.config.with_values(changed)
    environments = envs or config.learning.environments
    _check_worlds(environments, family)
    return {m.name: design_text(d) for m, d in zip(family, bodies.designs, strict=True)}, Plan(
        members=family,
        stage=stage,
        seed=seed,
        environments=environments,
        config=config,
        ground=ground or recipe.ground(stage),
        see_design=see_design,
        see_ground=(ground or recipe.ground(stage)) == "uneven",
    )


def _check_worlds(environments: int | None, family: Sequence[Any]) -> None:
    """Refuse fewer worlds than designs."""
    if environments is not None and environments < len(family):
        cause = f"{environments} worlds cannot hold {len(family)} designs"
        raise DraftError(Problem(cause, None, f"give --envs {len(family)} or more"))


def _name(plan: Plan, words: tuple[str, ...]) -> str:
    """Name of a run's folder."""
    count = len(plan.members)
    name = words[0].rstrip("/").rpartition("/")[2].replace(":", "-")
    if count == 1:
        name = plan.members[0].name.rpartition(":")[2]
    elif len(words) > 1:
        name = f"{name}-and-{count - 1}-more"
    else:
        name = f"{name}-{count}-bodies"
    return f"{name}-{plan.stage}-{plan.seed}"


@contextlib.contextmanager
def _page(run: Run, port: int) -> Iterator[None]:
    """Serve the newest checkpoint in a process of its own."""
    quiet()
    check("mjlab", "learn")
    from draft.learn.lab.follow import Follower

    with contextlib.closing(Follower(run.folder, LOOPBACK, port)) as follower:
        print(f"the gait so far, from the first checkpoint on: {address(LOOPBACK, follower.port)}")
        yield


def _train(
    run: Run,
    iterations: int | None,
    minutes: float | None,
    where: Setting,
    wandb: str | None,
    review: bool,
) -> int:
    """Train, show how far it is, and say what was learnt."""
    from draft.cli.display.training import Screen
    from draft.learn import training

    names = ", ".join(member.name for member in run.plan.members[:3])
    names += f" and {len(run.plan.members) - 3} more" if len(run.plan.members) > 3 else ""
    total = training.iterations_of(run, iterations)
    all_done = f"{run.folder}: {total} of {total} iterations are done"
    if training.finished(run, total):
        print(all_done)
        return 0
    print(f"{names}: stage {run.plan.stage}, seed {run.plan.seed}, to {run.folder}")
    print(where.describe(run, total), flush=True)
    again = "the same command resumes them"
    try:
        with Screen(names) as screen:
            done = training.train_on(run, total, where, minutes, screen.tell, wandb)
    except KeyboardInterrupt:
        print(f"{run.done()} of {total} iterations are saved; {again}")
        raise
    if not done:
        print(f"stopped after {run.done()} of {total} iterations; {again}")
    elif review:
        _conclude(run, where)
    else:
        print(all_done)
    return 0


def _conclude(run: Run, where: Setting) -> None:
    """Say what was learnt, and how to see it."""
    from draft.cli.display.training import conclude
    from draft.learn.lab.review import review

    conclude(run, review(run, where.devices[0], where.engine.name))
