"""`draft train`: train a legged robot to walk, in slices of time if need be."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.interrupted import AGAIN, if_interrupted
from draft.cli.options import (
    DESIGN_FORMS,
    EngineOption,
    PortOption,
    check_folder,
    parse_values,
)
from draft.cli.spelling import spelt
from draft.errors import counted, listed
from draft.extras import check
from draft.learn.silence import quiet
from draft.learn.task.stages import STAGES
from draft.serving.addresses import address, check_free, check_port

if TYPE_CHECKING:
    from draft.learn.training.run import Run
    from draft.learn.training.session import Setting

    StageName = str
else:
    StageName = Literal[tuple(STAGES)]  # tyro reads the names from the type.

LOOPBACK = "127.0.0.1"


def main(
    designs: Annotated[
        tyro.conf.Positional[tuple[str, ...]],
        tyro.conf.arg(
            metavar="DESIGN ...",
            help=f"Designs that train one policy in one simulation, each {DESIGN_FORMS}; or the "
            "folder of one run to resume.",
            help_behavior_hint="(required)",
        ),
    ],
    /,
    stage: Annotated[
        StageName,
        tyro.conf.arg(help="Curriculum; all but base start from a base policy."),
    ] = "base",
    seed: Annotated[int, tyro.conf.arg(metavar="N", help="Seed of everything random.")] = 0,
    origin: Annotated[
        str | None,
        tyro.conf.arg(
            name="from",
            metavar="POLICY",
            help="Policy to start from: a run, an ONNX file, 'family' for the one of all "
            "quadrupeds that ships, or 'scratch' for none.",
            help_behavior_hint="(default: scratch for base, else the base run beside it)",
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
            help="Time limit [min]; repeat the command to resume.",
            help_behavior_hint="(default: no limit)",
        ),
    ] = None,
    envs: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Number of worlds: on each GPU, or on all cores together.",
            help_behavior_hint="(default: the recipe's)",
        ),
    ] = None,
    values: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            name="set",
            metavar="NAME=VALUE ...",
            help="Values that override those of the design (thigh_length=0.3) or of the task, as "
            "'draft learn show' lists them (rewards.height=0.4).",
            help_behavior_hint="(default: none)",
        ),
    ] = (),
    vary: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="NAME=LOW:HIGH ...",
            help="Ranges, such as thigh_length=0.2:0.4, from which --bodies designs are drawn.",
            help_behavior_hint="(default: none)",
        ),
    ] = (),
    bodies: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Number of designs to draw; with more than worlds, they take turns.",
            help_behavior_hint="(required with --vary)",
        ),
    ] = None,
    recipe: Annotated[
        Literal["paper", "laptop", "tune"] | None,
        tyro.conf.arg(
            metavar="{paper,laptop,tune}",
            help="Numbers of the task: as published, for a hundredth of the steps, or to tune a "
            "policy that can run, such as --from family.",
            help_behavior_hint="(default: laptop on a CPU, paper on a GPU)",
        ),
    ] = None,
    ground: Annotated[
        Literal["flat", "uneven"] | None,
        tyro.conf.arg(
            metavar="{flat,uneven}",
            help="Ground; on a plane no heights are observed.",
            help_behavior_hint="(default: the recipe's)",
        ),
    ] = None,
    see_design: Annotated[
        bool, tyro.conf.arg(help="Let the policy observe the numbers that distinguish designs.")
    ] = False,
    device: Annotated[
        str,
        tyro.conf.arg(
            metavar="DEVICE", help="auto, cpu, cuda, cuda:1, all, or numbers of GPUs such as 0,1."
        ),
    ] = "auto",
    engine: EngineOption = "auto",
    replicas: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Number of processes that share the run on a CPU.",
            help_behavior_hint="(default: one per physical core)",
        ),
    ] = None,
    view: Annotated[
        bool, tyro.conf.arg(help="Show the newest checkpoint in the browser meanwhile.")
    ] = False,
    port: PortOption = 8080,
    no_review: Annotated[bool, tyro.conf.arg(help="Do not test the policy at the end.")] = False,
    wandb: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="PROJECT",
            help="Project of Weights & Biases to log to as well.",
            help_behavior_hint="(default: TensorBoard alone)",
        ),
    ] = None,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder of the run.",
            help_behavior_hint="(default: runs/DESIGN-STAGE-SEED)",
        ),
    ] = None,
) -> int:
    """Train a robot's policy; the same command resumes it."""
    start = time.monotonic()
    check_folder(out)
    if view:
        check_port(port)
        check_free(LOOPBACK, port)
    from draft.learn.training import session as training
    from draft.learn.training.train import prepare

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
        left = None if minutes is None else minutes - (time.monotonic() - start) / 60.0
        return _train(run, iterations, left, where, wandb, not no_review)


@contextlib.contextmanager
def _page(run: Run, port: int) -> Iterator[None]:
    """Serve the newest checkpoint in a process of its own."""
    quiet()
    check("mjlab", "learn")
    from draft.learn.watching.follow import Follower

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
    """Train a run, show its progress, and print what the policy can do."""
    from draft.cli.display.training import Screen
    from draft.learn.training import session as training

    names = listed(member.name for member in run.plan.members)
    total = training.iterations_of(run, iterations)
    all_done = f"{run.folder}: {total} of {counted(total, 'iteration')} are done"
    if training.finished(run, total):
        print(all_done)
        return 0
    print(f"{names}: stage {run.plan.stage}, seed {run.plan.seed}, to {run.folder}")
    if (base := training.origin_line(run.plan, run.folder.parent)) is not None:
        print(spelt(base))
    print(where.describe(run, total), flush=True)

    def kept() -> str:
        checkpoints = run.checkpoints()
        policy = f"with a policy of iteration {checkpoints[-1][0]}" if checkpoints else "no policy"
        done = f"{run.done()} of {counted(total, 'iteration')} are kept, {policy}"
        return f"{done}; {AGAIN}"

    with if_interrupted(kept), Screen(names) as screen:
        done = training.train_on(run, total, where, minutes, screen.tell, wandb)
    if not done:
        print(f"stopped: {kept()}")
    elif review:
        _conclude(run, where)
    else:
        print(all_done)
    return 0


def _conclude(run: Run, where: Setting) -> None:
    """Test the policy, and print what it can do and how to see it."""
    from draft.cli.display.training import conclude
    from draft.learn.measuring.rollout.review import before, review

    device, engine = where.devices[0], where.engine.name
    conclude(run, review(run, device, engine), before(run, device, engine))
