"""`draft train`: teach a quadruped to walk, in slices of time if need be."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.engine_option import EngineOption
from draft.cli.options import check_folder, parse_values
from draft.cli.page_options import PortOption
from draft.extras import check
from draft.learn.silence import quiet
from draft.serving.addresses import address, check_free, check_port

if TYPE_CHECKING:
    from draft.learn.run import Run
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
    if view:
        check_port(port)
        check_free(LOOPBACK, port)
    from draft.learn import training
    from draft.learn.entries import prepare

    run = prepare(
        designs,
        out,
        stage=stage,
        seed=seed,
        origin=origin,
        iterations=iterations,
        minutes=minutes,
        envs=envs,
        values=parse_values(values),
        vary=vary,
        bodies=bodies,
        recipe=recipe,
        ground=ground,
        see_design=see_design,
        device=device,
        engine=engine,
        replicas=replicas,
        report=partial(print, file=sys.stderr),
    )
    where = training.setting_of(run, device, engine, replicas)
    page = _page(run, port) if view else contextlib.nullcontext()
    with page:
        left = None if minutes is None else minutes - (time.monotonic() - begun) / 60.0
        return _train(run, iterations, left, where, wandb, not no_review)


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
    print(where.words(run, total), flush=True)
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
