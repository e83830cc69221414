"""Tasks as mjlab's own commands see them; mjlab imports this module by its entry point.

Every shipped design that can be trained has four: `Draft-Base-Cheetah` and so on. With
DRAFT_DESIGN in the environment (a robot's folder, SPEC:DESIGN, a built model) its four are there
too. mjlab's runner saves and resumes as mjlab does; `draft train` does more.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator

from mjlab.tasks.registry import list_tasks, register_mjlab_task

from draft.design.references import open_designs
from draft.errors import DraftError
from draft.learn.config import STAGES
from draft.learn.lab.agent import agent
from draft.learn.lab.env_cfg import Task, environment
from draft.learn.quadruped import Quadruped, quadruped
from draft.spec.load import load, shipped

VARIABLE = "DRAFT_DESIGN"


def register() -> None:
    """Register the tasks of all designs at hand; one that cannot be opened is told and left out."""
    done = set(list_tasks())
    for name, member in _designs():
        for stage in STAGES:
            task_id = f"Draft-{stage.title()}-{_title(name)}"
            if task_id in done:
                continue
            task = Task((member,), stage)
            config = task.config.learning
            register_mjlab_task(
                task_id,
                environment(task, config.environments),
                environment(task, 1, play=True),
                agent(config, stage),
            )


def _designs() -> Iterator[tuple[str, Quadruped]]:
    for name in shipped():
        spec = load(name)
        for design in spec.designs:
            try:
                yield design, quadruped(spec.resolve(design))
            except DraftError:
                continue  # A humanoid, or a hopper.
    word = os.environ.get(VARIABLE)
    if word:
        try:
            (design,) = open_designs([word])
            yield design.name if design.label == "default" else design.label, quadruped(design)
        except DraftError as error:
            print(f"{VARIABLE}={word}: {error}", file=sys.stderr)


def _title(name: str) -> str:
    return "-".join(part.title() for part in re.split(r"[\W_]+", name) if part)


register()
