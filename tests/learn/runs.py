"""Small runs that tests train: their folders, slices, weights and exported policies."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import torch

from draft.learn.engine.machine import NATIVE, WARP, obstacle
from draft.learn.training.ppo.onnx import export
from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.run import Plan, Run, create, open_run
from draft.learn.watching.play import Player

QUICK = NATIVE if obstacle() is None else WARP  # Where a test is about no engine.


def begin(folder: Path, of: Plan) -> Run:
    """Create a run whose designs are named."""
    return create(folder, of, {member.name: "values: {}\n" for member in of.members})


def train(run: Run, *slices: int, engine: str = QUICK) -> Trainer:
    """Train to each of these iterations, every time as a new process would.

    Returns:
        The last trainer, closed.
    """
    for total in slices:
        trainer = Trainer(open_run(run.folder), "cpu", engine=engine)
        assert trainer.train(total)
        trainer.close()
    return trainer  # pyright: ignore[reportPossiblyUnboundVariable]


def trained(folder: Path, of: Plan) -> Run:
    """A run of one iteration."""
    run = begin(folder, of)
    train(run, 1)
    return run


def exported(run: Run, **shown: Any) -> Path:
    """The last policy of a run as a file in its folder.

    Args:
        run: the run.
        shown: which of its designs, and where, as `Player` takes them.
    """
    with contextlib.closing(Player(run, "cpu", engine=QUICK, **shown)) as player:
        export(player, run, run.folder / "policy.onnx")
    return run.folder / "policy.onnx"


def weights(trainer: Trainer) -> dict[str, Any]:
    """Weights and statistics of actor and critic by name."""
    state = trainer.runner.alg.save()
    return state["actor_state_dict"] | {f"v.{k}": v for k, v in state["critic_state_dict"].items()}


def same(a: dict[str, Any], b: dict[str, Any]) -> bool:
    """Whether they have the same names and tensors, bit by bit."""
    return a.keys() == b.keys() and all(torch.equal(a[k], b[k]) for k in a)
