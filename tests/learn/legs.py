"""A policy of all legs with random weights, small enough for a test."""

from __future__ import annotations

from pathlib import Path

import draft
from draft.learn.bodies.generated import generate, together
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.task.recipes import ANY
from draft.learn.training.ppo.legs_onnx import export_legs
from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.run import Plan, open_run
from tests.learn.runs import QUICK, begin
from tests.learn.small import SMALL


def mixed_plan(**more: object) -> Plan:
    """A plan with bodies of all kinds."""
    members = together(generate(10)).members
    config = ANY.config.with_values(SMALL)
    numbers = {"environments": 10, "ground": "flat", "see_design": True, "see_ground": False}
    return Plan(members, "any", config=config, **{**numbers, **more})


def random_legs(folder: Path) -> Path:
    """File of a policy of all legs before its training, made by a run in a folder."""
    run = begin(folder, mixed_plan())
    trainer = Trainer(open_run(run.folder), "cpu", engine=QUICK)
    trainer.keep()
    trainer.close()
    export_legs(run, run.folder / "legs.onnx", 0)
    return run.folder / "legs.onnx"


def robot(name: str) -> LeggedRobot:
    """A shipped robot."""
    return legged_robot(draft.load(name).resolve())
