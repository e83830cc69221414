"""Launch of a training in this process, or in several with torchrunx, mjlab's launcher.

Several processes share a run: one per GPU, or one per core of a CPU.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from draft.errors import DraftError
from draft.learn.engine.machine import WARP, visible
from draft.learn.engine.multi_process import Send, asked_to_stop, run_processes
from draft.learn.engine.stopping import stopping
from draft.learn.silence import quiet
from draft.learn.task.terms import TERMS
from draft.learn.training.progress import Progress
from draft.learn.training.run import Run, open_run
from draft.parallel import single_threaded

Report = Callable[[Progress], None]
# One process per core, and no GPU.
THREADS = single_threaded({"CUDA_VISIBLE_DEVICES": ""})


def train_slice(
    run: Run,
    devices: Sequence[str],
    total: int,
    until: float,
    report: Report,
    wandb: str | None = None,
    engine: str = WARP,
    replicas: int = 1,
) -> bool:
    """Train a run for a slice of time.

    Args:
        run: the run; it resumes where it stopped.
        devices: devices; several share the work, each with as many worlds as the run has.
        total: iterations in all slices.
        until: time limit, as `time.monotonic()` gives it [s].
        report: called after every iteration; with several processes from another thread.
        wandb: project of Weights & Biases; None for none.
        engine: "native" or "warp".
        replicas: processes on a CPU.

    Returns:
        Whether all iterations are done.

    Raises:
        DraftError: see `draft.learn.training.ppo.trainer` and `draft.learn.engine.multi_process`.
        KeyboardInterrupt: on Ctrl-C or SIGTERM, after the current iteration, which is kept.
    """
    on_cpu = list(devices) == ["cpu"]
    if len(devices) == 1 and replicas == 1:
        return train_process(run.folder, devices[0], total, until, report, wandb, engine=engine)
    modules = _modules(run)
    worker = partial(_worker, run.folder, total, until, wandb, on_cpu, engine, modules)
    environment = THREADS if on_cpu else {"CUDA_VISIBLE_DEVICES": ",".join(visible(devices))}
    if modules:
        # A script's folder is on the path of its own process alone.
        environment = {**environment, "PYTHONPATH": os.pathsep.join(sys.path)}
    count = replicas if on_cpu else len(devices)
    logs = run.folder / "torchrunx"
    return run_processes(worker, count, environment, logs, lambda sent: report(Progress(**sent)))


def _modules(run: Run) -> tuple[str, ...]:
    """Modules of the terms of a run, which each of several processes imports.

    Raises:
        DraftError: a term is of the script that runs, which no process can import.
    """
    found = {TERMS[name].function.__module__: name for name, _ in run.plan.config.terms}
    if "__main__" in found:
        cause = f"several processes cannot import '{found['__main__']}' from the script that runs"
        raise DraftError(cause, "move it to a module, or pass `replicas=1`")
    return tuple(found)


def _worker(
    folder: Path,
    total: int,
    until: float,
    wandb: str | None,
    on_cpu: bool,
    engine: str,
    modules: Sequence[str],
    rank: int,
    send: Send,
) -> bool:
    """Train in one of several processes; see `train_slice`."""
    quiet()
    for module in modules:
        importlib.import_module(module)
    device, replicas = ("cpu", int(os.environ["WORLD_SIZE"])) if on_cpu else (f"cuda:{rank}", 1)

    def report(progress: Progress) -> None:
        send(asdict(progress))

    mine = (rank, engine, replicas, asked_to_stop)
    done = train_process(folder, device, total, until, report, wandb, *mine)
    # Only after success: other processes may wait for one that fails.
    from torch import distributed

    distributed.destroy_process_group()
    return done


def train_process(
    folder: Path,
    device: str,
    total: int,
    until: float,
    report: Report,
    wandb: str | None,
    rank: int = 0,
    engine: str = WARP,
    replicas: int = 1,
    stop: Callable[[], bool] | None = None,
) -> bool:
    """Train one process's share of a run for a slice of time; see `train_slice`.

    `stop` returns whether the process that started this one asks it to stop; None for none.
    """
    # Imported here, as they take seconds, and a process that only starts others needs none.
    import torch
    from mjlab.utils.torch import configure_torch_backends

    from draft.learn.training.ppo.log import Writers
    from draft.learn.training.ppo.trainer import Trainer

    configure_torch_backends()
    if device == "cpu":
        # Many small products: they take a hundred times as long if threads wait for each other.
        torch.set_num_threads(1)
    run = open_run(folder)
    # mjlab and rsl-rl print the environment and the networks as long tables.
    with _redirected(folder / "environment.txt" if rank == 0 else None):
        trainer = Trainer(run, device, rank, engine, replicas)
    writers = Writers(folder, trainer.iteration, run.plan.record(), wandb) if rank == 0 else None

    def write(progress: Progress) -> None:
        if writers is not None:
            writers.add(progress.row)
            report(progress)

    try:
        with contextlib.nullcontext(stop) if stop is not None else stopping() as asked:
            return trainer.train(total, until, write, asked)
    finally:
        trainer.close()
        if writers is not None:
            writers.close()


@contextlib.contextmanager
def _redirected(log: Path | None) -> Iterator[None]:
    """Write standard output to a file; None to drop it."""
    with open(log or os.devnull, "w", encoding="utf-8") as file, contextlib.redirect_stdout(file):
        yield
