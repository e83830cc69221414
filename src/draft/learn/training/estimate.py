"""Training as `draft train` would run it on a machine: engine, processes, stages and minutes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from draft.errors import counted
from draft.extras import remedy
from draft.learn.engine.machine import KINDS, Machine, minutes, replicas
from draft.learn.task.config import Config
from draft.learn.task.constants import JOINTS
from draft.learn.task.recipes import Recipe


@dataclass(frozen=True)
class Training:
    """Training of a stage.

    Attributes:
        iterations: iterations of the stage.
        environments: number of worlds.
        ground: "flat" or "uneven".
        minutes: expected time on a CPU [min]; None if unknown.
    """

    iterations: int
    environments: int
    ground: str
    minutes: float | None


@dataclass(frozen=True)
class Outlook:
    """Training of some stages on a machine.

    Attributes:
        machine: the machine.
        recipe: name of the recipe.
        processes: number of processes that would share a run; None without an engine.
        stages: training by stage.
    """

    machine: Machine
    recipe: str
    processes: int | None
    stages: Mapping[str, Training]

    def engine_line(self) -> str:
        """Return the engine, the reason for it, and the cores."""
        here, count = self.machine, self.processes
        cores = counted(here.cores, "core")
        if here.engine is None:
            return f"none yet, {here.missing} is not installed ({remedy('learn')}); {cores}"
        words = f"{KINDS[here.engine.name]} ({here.engine.why})"
        if not here.on_cpu:
            return f"{words}, {', '.join(here.devices)}"
        return f"{words}, {cores}, {counted(count or 0, 'process')}"

    def stage_lines(self) -> list[str]:
        """Return a line for each stage."""
        return [f"{stage} {_line(training)}" for stage, training in self.stages.items()]

    def record(self) -> dict[str, object]:
        """Return plain data."""
        here, stages = self.machine, self.stages
        return {
            "devices": here.devices,
            "engine": here.engine and here.engine.name,
            "why": here.engine and here.engine.why,
            "missing": here.missing,
            "cores": here.cores,
            "processes": self.processes,
            "recipe": self.recipe,
            "ground": {stage: training.ground for stage, training in stages.items()},
            "minutes": {stage: training.minutes for stage, training in stages.items()},
        }


def outlook(
    here: Machine,
    recipe: Recipe,
    config: Config | None = None,
    stages: Iterable[str] = (),
    joints: int = JOINTS,
) -> Outlook:
    """Return the training of stages on a machine.

    Args:
        here: the machine.
        recipe: the recipe, which decides the ground of each stage.
        config: numbers of the tasks; by default those of the recipe.
        stages: stages to train; empty for those of the recipe.
        joints: joints of the robot.
    """
    config = config or recipe.config
    worlds, processes = config.learning.environments, None
    if here.engine is not None:
        processes = replicas(None, worlds, here.engine, here.devices)
    trainings = {
        stage: _training(stage, config, recipe, here, processes, joints)
        for stage in stages or recipe.stages()
    }
    return Outlook(here, recipe.name, processes, trainings)


def _training(
    stage: str, config: Config, recipe: Recipe, here: Machine, processes: int | None, joints: int
) -> Training:
    learning, ground = config.learning, recipe.ground(stage)
    count, took = config.iterations(stage), None
    if here.on_cpu and here.engine is not None and processes is not None:
        steps = count * learning.environments * learning.steps
        took = minutes(steps, config.physics.decimation, here.engine, processes, ground, joints)
    return Training(count, learning.environments, ground, took)


def _line(training: Training) -> str:
    words = (
        f"{counted(training.iterations, 'iteration')} of {counted(training.environments, 'world')} "
    )
    words += f"on {training.ground} ground"
    if training.minutes is None:
        return words
    about = f"about {training.minutes:,.0f}" if training.minutes >= 1 else "less than 1"
    return f"{words}, {about} min"
