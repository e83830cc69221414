"""Start training on the CPU, on one GPU, or on several by torchrunx, mjlab's launcher."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

import torch
from mjlab.utils.torch import configure_torch_backends

from draft.learn.devices import visible
from draft.learn.lab.trainer import Progress, Trainer
from draft.learn.lab.writers import Writers
from draft.learn.quiet import quiet
from draft.learn.run import Run, open_run
from draft.learn.several import Say, together

Tell = Callable[[Progress], None]


def train(
    run: Run,
    chosen: Sequence[str],
    total: int,
    until: float,
    tell: Tell,
    wandb: str | None = None,
) -> bool:
    """Train a run for a slice of time.

    Args:
        run: the run; it goes on where it stopped.
        chosen: devices; several share the work, each with as many worlds as the run has.
        total: iterations in all slices.
        until: `time.monotonic()` to be done at.
        tell: called after every iteration; on several GPUs from another thread.
        wandb: project of Weights & Biases; None for none.

    Returns:
        Whether all iterations are done.

    Raises:
        DraftError: see `draft.learn.lab.trainer` and `draft.learn.several`.
    """
    if len(chosen) == 1:
        return work(run.folder, chosen[0], total, until, tell, wandb)
    share = partial(_share, run.folder, total, until, wandb)
    logs = run.folder / "torchrunx"
    return together(share, visible(chosen), logs, lambda told: tell(Progress(**told)))


def _share(folder: Path, total: int, until: float, wandb: str | None, rank: int, say: Say) -> bool:
    """What one of several processes does."""
    quiet()
    done = work(folder, f"cuda:{rank}", total, until, lambda p: say(asdict(p)), wandb, rank)
    # Only where all went well: others may wait for a process that fails.
    torch.distributed.destroy_process_group()
    return done


def work(
    folder: Path,
    device: str,
    total: int,
    until: float,
    tell: Tell,
    wandb: str | None,
    rank: int = 0,
) -> bool:
    """One process's share of a slice; see `train`."""
    configure_torch_backends()
    if device == "cpu":
        # Its many small products cost a hundred times as much where threads wait for each other.
        torch.set_num_threads(1)
    run = open_run(folder)
    # mjlab and rsl-rl print the environment and the networks as tables, at length.
    with _quiet(folder / "environment.txt" if rank == 0 else None):
        trainer = Trainer(run, device, rank)
    writers = Writers(folder, trainer.iteration, run.plan.record(), wandb) if rank == 0 else None

    def told(progress: Progress) -> None:
        if writers is not None:
            writers.add(progress.row)
            tell(progress)

    try:
        return trainer.train(total, until, told)
    finally:
        trainer.close()
        if writers is not None:
            writers.close()


@contextlib.contextmanager
def _quiet(log: Path | None):
    with open(log or os.devnull, "w", encoding="utf-8") as file, contextlib.redirect_stdout(file):
        yield


def until(minutes: float | None, begun: float) -> float:
    """When to be done, for `train`.

    Args:
        minutes: for how long; None for no limit.
        begun: `time.monotonic()` when the command began.
    """
    return float("inf") if minutes is None else begun + 60.0 * minutes


def now() -> float:
    """The clock of `until`."""
    return time.monotonic()
