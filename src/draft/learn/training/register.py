"""Registration of tasks for mjlab's own commands; mjlab imports this module by its entry point.

Every shipped design that can be trained has four tasks: `Draft-Base-Cheetah` and so on. The
environment variable DRAFT_DESIGN (a robot's folder, SPEC:DESIGN, a built model) adds those of
another design. mjlab's runner saves and resumes in its own way; `draft train` also restores the
environment.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator

from mjlab.tasks.registry import list_tasks, register_mjlab_task

from draft.design.references import open_designs
from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.task.config import STAGES
from draft.learn.task.mdp.environment import environment
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.agent import agent
from draft.spec.load import load, shipped

VARIABLE = "DRAFT_DESIGN"


def register() -> None:
    """Register the tasks of all designs; one that cannot be opened is reported and skipped."""
    done = set(list_tasks())
    for name, member in _designs():
        for stage in STAGES:
            task_id = f"Draft-{stage.title()}-{_title(name)}"
            if task_id in done:
                continue
            task = Task((member,), stage)
            register_mjlab_task(
                task_id,
                environment(task, task.config.learning.environments),
                environment(task, 1, play=True),
                agent(task.config, stage),
            )


def _designs() -> Iterator[tuple[str, LeggedRobot]]:
    for name in shipped():
        try:
            spec = load(name)
        except DraftError:
            continue  # One of an extension.
        for design in spec.designs:
            try:
                yield design, legged_robot(spec.resolve(design))
            except DraftError:
                continue  # A humanoid, or a hopper.
    reference = os.environ.get(VARIABLE)
    if reference:
        try:
            (design,) = open_designs([reference])
            yield design.name if design.label == "default" else design.label, legged_robot(design)
        except DraftError as error:
            print(f"{VARIABLE}={reference}: {error}", file=sys.stderr)


def _title(name: str) -> str:
    return "-".join(part.title() for part in re.split(r"[\W_]+", name) if part)


register()
