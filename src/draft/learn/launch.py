"""Start training in this process, or in several by torchrunx, mjlab's launcher.

Several share a run: one per GPU, or one per core of a CPU.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from draft.learn.devices import visible
from draft.learn.engine import WARP
from draft.learn.multi_process import Say, together
from draft.learn.progress import Progress
from draft.learn.run import Run, open_run
from draft.learn.silence import quiet
from draft.parallel import single_threaded

Tell = Callable[[Progress], None]
# One process per core, and no GPU.
THREADS = single_threaded({"CUDA_VISIBLE_DEVICES": ""})


def train(
    run: Run,
    chosen: Sequence[str],
    total: int,
    until: float,
    tell: Tell,
    wandb: str | None = None,
    engine: str = WARP,
    replicas: int = 1,
) -> bool:
    """Train a run for a slice of time.

    Args:
        run: the run; it goes on where it stopped.
        chosen: devices; several share the work, each with as many worlds as the run has.
        total: iterations in all slices.
        until: `time.monotonic()` to be done at.
        tell: called after every iteration; on several GPUs from another thread.
        wandb: project of Weights & Biases; None for none.
        engine: "native" or "warp".
        replicas: processes on a CPU.

    Returns:
        Whether all iterations are done.

    Raises:
        DraftError: see `draft.learn.lab.trainer` and `draft.learn.multi_process`.
    """
    on_cpu = list(chosen) == ["cpu"]
    if len(chosen) == 1 and replicas == 1:
        return work(run.folder, chosen[0], total, until, tell, wandb, engine=engine)
    share = partial(_share, run.folder, total, until, wandb, on_cpu, engine)
    environment = THREADS if on_cpu else {"CUDA_VISIBLE_DEVICES": ",".join(visible(chosen))}
    count = replicas if on_cpu else len(chosen)
    logs = run.folder / "torchrunx"
    return together(share, count, environment, logs, lambda told: tell(Progress(**told)))


def _share(
    folder: Path,
    total: int,
    until: float,
    wandb: str | None,
    on_cpu: bool,
    engine: str,
    rank: int,
    say: Say,
) -> bool:
    """What one of several processes does."""
    quiet()
    device, replicas = ("cpu", int(os.environ["WORLD_SIZE"])) if on_cpu else (f"cuda:{rank}", 1)
    told = lambda progress: say(asdict(progress))  # noqa: E731
    done = work(folder, device, total, until, told, wandb, rank, engine, replicas)
    # Only where all went well: others may wait for a process that fails.
    from torch import distributed

    distributed.destroy_process_group()
    return done


def work(
    folder: Path,
    device: str,
    total: int,
    until: float,
    tell: Tell,
    wandb: str | None,
    rank: int = 0,
    engine: str = WARP,
    replicas: int = 1,
) -> bool:
    """One process's share of a slice; see `train`."""
    # Here, since they take seconds, and a process that only starts others does not need them.
    import torch
    from mjlab.utils.torch import configure_torch_backends

    from draft.learn.lab.trainer import Trainer
    from draft.learn.lab.writers import Writers

    configure_torch_backends()
    if device == "cpu":
        # Its many small products cost a hundred times as much where threads wait for each other.
        torch.set_num_threads(1)
    run = open_run(folder)
    # mjlab and rsl-rl print the environment and the networks as tables, at length.
    with _quiet(folder / "environment.txt" if rank == 0 else None):
        trainer = Trainer(run, device, rank, engine, replicas)
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
