"""A policy of a robot's own, where that of the family is not to be asked."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.measuring.policies import Source, of_run
from draft.learn.task.recipes import LAPTOP, TUNE
from draft.learn.training import session
from draft.learn.training.options import SliceOptions, TaskOptions
from draft.learn.training.progress import Progress
from draft.learn.training.run import Plan, Run

# Share of the robots that learn to withstand kicks, as in the family's training.
_NUMBERS = {"velocity.pushed": 0.3}


def own_policy(
    member: LeggedRobot,
    folder: Path,
    *,
    family: bool,
    seed: int = 0,
    iterations: int | None = None,
    report: Callable[[str, Progress], None] = lambda stage, progress: None,
) -> Source:
    """Train a policy that runs and withstands kicks, or go on with its training.

    Args:
        member: the robot.
        folder: folder of the runs, each in one of its name.
        family: whether it starts from the family's policy; else it learns to walk first.
        seed: seed of everything random.
        iterations: iterations of each training; None for the recipe's.
        report: called with the stage and its progress, after every iteration.

    Raises:
        DraftError: the folder holds something else, or the training fails.
    """
    options = SliceOptions(iterations=iterations)
    recipe = TUNE if family else LAPTOP
    config = recipe.config.with_values(_NUMBERS)

    def learnt(stage: str, origin: str | Path) -> Run:
        plan = Plan.of((member,), TaskOptions(), recipe, config, stage, seed, see_design=family)
        run = session.begin(folder / f"{stage}-{seed}", plan, {}, origin)
        if not session.finished(run, options):
            where = session.setting_of(run, options)
            session.train_on(run, options, where, partial(report, stage))
        return run

    origin = "family" if family else learnt("base", session.SCRATCH).folder
    return of_run(learnt("velocity", origin), blind=True)
