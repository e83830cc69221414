"""`draft train`: train a legged robot to walk, in slices of time if need be."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Annotated

import tyro

from draft.cli.interrupted import AGAIN, if_interrupted
from draft.cli.options import (
    DESIGN_FORMS,
    PortOption,
    check_folder,
    parse_values,
)
from draft.cli.settings_options import with_options
from draft.cli.spelling import spelt
from draft.cli.stage_choice import StageChoice
from draft.errors import counted, listed
from draft.extras import check
from draft.learn.silence import quiet
from draft.learn.training.options import TrainOptions
from draft.learn.training.progress import PROGRESS, gained
from draft.serving.addresses import address, check_free, check_port

if TYPE_CHECKING:
    from draft.learn.training.run import Run
    from draft.learn.training.session import Setting

LOOPBACK = "127.0.0.1"


def _words(words: tuple[str, ...]) -> tuple[str, ...]:
    """Read the words of --vary, which the library reads."""
    return words


def _values(words: tuple[str, ...]) -> dict[str, float | str | None]:
    """Read the words of --set."""
    return parse_values(words)


def _stage(word: StageChoice) -> str:
    """Read the word of --stage."""
    return word


@with_options(TrainOptions, read={"stage": _stage, "values": _values, "vary": _words})
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
    *,
    options: TrainOptions,
    view: Annotated[
        bool, tyro.conf.arg(help="Show the newest checkpoint in the browser meanwhile.")
    ] = False,
    port: PortOption = 8080,
    no_review: Annotated[bool, tyro.conf.arg(help="Do not test the policy at the end.")] = False,
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

    run = prepare(designs, out, options, partial(print, file=sys.stderr))
    where = training.setting_of(run, options)
    page = _page(run, port) if view else contextlib.nullcontext()
    with page:
        if options.minutes is not None:
            left = options.minutes - (time.monotonic() - start) / 60.0
            options = options.model_copy(update={"minutes": left})
        return _train(run, options, where, not no_review)


@contextlib.contextmanager
def _page(run: Run, port: int) -> Iterator[None]:
    """Serve the newest checkpoint in a process of its own."""
    quiet()
    check("mjlab", "learn")
    from draft.learn.watching.follow import Follower

    with contextlib.closing(Follower(run.folder, LOOPBACK, port)) as follower:
        print(f"the gait so far, from the first checkpoint on: {address(LOOPBACK, follower.port)}")
        yield


def _train(run: Run, options: TrainOptions, where: Setting, review: bool) -> int:
    """Train a run, show its progress, and print what the policy can do."""
    from draft.cli.display.training import Screen
    from draft.learn.training import session as training

    names = listed(member.name for member in run.plan.members)
    total = options.total(run.plan)
    all_done = f"{run.folder}: {total} of {counted(total, 'iteration')} are done"
    if training.finished(run, options):
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
        done = training.train_on(run, options, where, screen.tell)
    if not done:
        print(f"stopped: {kept()}")
    elif review:
        _conclude(run, where)
    else:
        print(all_done)
    if done and run.plan.origin and (gain := gained(run.folder / PROGRESS)):
        print(gain)
    return 0


def _conclude(run: Run, where: Setting) -> None:
    """Test the policy, and print what it can do and how to see it."""
    from draft.cli.display.training import conclude, conclude_mixed
    from draft.learn.measuring.rollout.review import before, review, review_mixed

    device, engine = where.devices[0], where.engine.name
    if run.plan.mixed:
        conclude_mixed(run, review_mixed(run, device, engine))
        return
    conclude(run, review(run, device, engine), before(run, device, engine))
