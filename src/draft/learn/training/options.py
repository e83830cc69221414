"""Options of a training, for Python, the command, the file of a study and its workers.

A new option of a training is a field here, and what it does: `TaskOptions` for the numbers and the
ground that all trainings of a study share, `SliceOptions` for what does not change what is learned,
`TrainOptions` for the rest. The command, `draft.train`, the keys of a study's file and the requests
to its workers are drawn from the fields.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field
from pydantic_core import CoreSchema, core_schema

from draft.learn.engine.machine import EngineName
from draft.learn.task.constants import MOST_ITERATIONS
from draft.learn.task.recipes import RecipeName
from draft.learn.task.stages import StageName
from draft.settings import Settings, Shown
from draft.variation.axes import Vary

if TYPE_CHECKING:
    from draft.learn.training.run import Plan

Ground = Literal["flat", "uneven"]


class _ReadLater:
    """Marker of a field that is checked where it is used, with what it is about."""

    def __get_pydantic_core_schema__(self, source: object, handler: object) -> CoreSchema:
        return core_schema.any_schema()


class PolicyOptions(Settings):
    """What distinguishes a training from the others of a study."""

    stage: StageName = "base"
    """Curriculum, such as velocity, terrain or push; all but base start from a base policy."""
    seed: Annotated[int, Field(ge=0, le=2**31 - 1), Shown("N")] = 0
    """Seed of everything random."""
    origin: Annotated[
        str | Path | None,
        Shown("POLICY", "scratch for base, else the base run beside it", "from"),
    ] = None
    """Policy to start from: a run, an ONNX file, or one that ships ('any' for all legs; 'family',
    'family_climb' and 'family_machine' for all quadrupeds), or 'scratch' for none."""
    vary: Annotated[Vary, _ReadLater(), Shown("NAME=LOW:HIGH ...", "none")] = ()
    """Ranges, such as thigh_length=0.2:0.4, from which a number of bodies is drawn."""
    bodies: Annotated[int | None, Field(ge=1, le=4096), Shown("N", "none")] = None
    """Number of designs to draw from the ranges, which need it; with more than worlds, they take
    turns."""
    see_design: bool = False
    """Whether the policy observes the numbers that distinguish designs."""


class TaskOptions(Settings):
    """Numbers and ground of the tasks, which all trainings of a study share."""

    recipe: Annotated[RecipeName | None, Shown(default="laptop on a CPU, paper on a GPU")] = None
    """Numbers of the task: as published, for a hundredth of the steps, to tune a policy that can
    run, such as the one of all quadrupeds that ships, or for a real robot."""
    ground: Annotated[Ground | None, Shown(default="the recipe's")] = None
    """Ground to train on; on a plane no heights are observed."""
    envs: Annotated[int | None, Field(ge=1, le=10**6), Shown("N", "the recipe's")] = None
    """Number of worlds: on each GPU, or on all cores together."""
    values: Annotated[
        Mapping[str, Any] | None,
        Shown("NAME=VALUE ...", "none", "set", expects="a mapping of names to values"),
    ] = None
    """Values that override those of the design (thigh_length=0.3) or of the task, as 'draft learn
    show' lists them (rewards.height=0.4)."""


class SliceOptions(Settings):
    """What does not change what is learned: how far, for how long, and on what."""

    iterations: Annotated[
        int | None, Field(ge=1, le=MOST_ITERATIONS), Shown("N", "the stage's")
    ] = None
    """Iterations in all slices."""
    minutes: Annotated[float | None, Field(gt=0, le=10**6), Shown("M", "no limit")] = None
    """Time limit [min]; repeat the training to resume."""
    device: Annotated[str, Shown("DEVICE")] = "auto"
    """Where to train: auto, cpu, cuda, cuda:1, all, or numbers of GPUs such as 0,1."""
    engine: EngineName = "auto"
    replicas: Annotated[int | None, Field(ge=1, le=10**5), Shown("N", "one per physical core")] = (
        None
    )
    """Number of processes that share the run on a CPU."""
    wandb: Annotated[str | None, Shown("PROJECT", "TensorBoard alone")] = None
    """Project of Weights & Biases to log to as well."""

    def total(self, plan: Plan) -> int:
        """Iterations of a run in all slices: the given number, or that of its stage."""
        return self.iterations or plan.config.iterations(plan.stage)


class TrainOptions(SliceOptions, TaskOptions, PolicyOptions):
    """Options of a training."""
