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
from typing import TYPE_CHECKING

from draft.errors import DraftError
from draft.learn.engine.machine import visible
from draft.learn.engine.multi_process import Send, asked_to_stop, run_processes
from draft.learn.engine.stopping import stopping
from draft.learn.silence import quiet
from draft.learn.task.terms import TERMS
from draft.learn.training.progress import Progress
from draft.learn.training.run import Run, open_run
from draft.parallel import single_threaded

if TYPE_CHECKING:
    from draft.learn.training.options import SliceOptions
    from draft.learn.training.session import Setting

Report = Callable[[Progress], None]
# One process per core, and no GPU.
THREADS = single_threaded({"CUDA_VISIBLE_DEVICES": ""})


def train_slice(
    run: Run, options: SliceOptions, where: Setting, until: float, report: Report
) -> bool:
    """Train a run for a slice of time.

    Args:
        run: the run; it resumes where it stopped.
        options: options of this call.
        where: devices, engine and processes; several devices share the work, each with as many
            worlds as the run has.
        until: time limit, as `time.monotonic()` gives it [s].
        report: called after every iteration; with several processes from another thread.

    Returns:
        Whether all iterations are done.

    Raises:
        DraftError: see `draft.learn.training.ppo.trainer` and `draft.learn.engine.multi_process`.
        KeyboardInterrupt: on Ctrl-C or SIGTERM, after the current iteration, which is kept.
    """
    engine = where.engine.name
    if where.processes == 1:
        return train_process(run.folder, where.devices[0], engine, options, until, report)
    modules = _modules(run)
    worker = partial(_worker, run.folder, where.on_cpu, engine, options, until, modules)
    environment = THREADS
    if not where.on_cpu:
        environment = {"CUDA_VISIBLE_DEVICES": ",".join(visible(where.devices))}
    if modules:
        # A script's folder is on the path of its own process alone.
        environment = {**environment, "PYTHONPATH": os.pathsep.join(sys.path)}
    logs = run.folder / "torchrunx"
    count = where.processes
    return run_processes(worker, count, environment, logs, lambda sent: report(Progress(**sent)))


def _modules(run: Run) -> tuple[str, ...]:
    """Modules of the terms of a run, which each of several processes imports.

    Raises:
        DraftError: a term is of the script that runs, which no process can import.
    """
    terms = run.plan.config.of_stage(run.plan.stage).terms
    found = {TERMS[name].function.__module__: name for name, _ in terms}
    if "__main__" in found:
        cause = f"several processes cannot import '{found['__main__']}' from the script that runs"
        remedy = 'move it to a module, or use one process: `replicas=1`, or one GPU: `device="0"`'
        raise DraftError(cause, remedy)
    return tuple(found)


def _worker(
    folder: Path,
    on_cpu: bool,
    engine: str,
    options: SliceOptions,
    until: float,
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

    mine = (rank, replicas, asked_to_stop)
    done = train_process(folder, device, engine, options, until, report, *mine)
    # Only after success: other processes may wait for one that fails.
    from torch import distributed

    distributed.destroy_process_group()
    return done


def train_process(
    folder: Path,
    device: str,
    engine: str,
    options: SliceOptions,
    until: float,
    report: Report,
    rank: int = 0,
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
    plan = run.plan.record()
    writers = Writers(folder, trainer.iteration, plan, options.wandb) if rank == 0 else None

    def write(progress: Progress) -> None:
        if writers is not None:
            writers.add(progress.row)
            report(progress)

    try:
        with contextlib.nullcontext(stop) if stop is not None else stopping() as asked:
            return trainer.train(options.total(run.plan), until, write, asked)
    finally:
        trainer.close()
        if writers is not None:
            writers.close()


@contextlib.contextmanager
def _redirected(log: Path | None) -> Iterator[None]:
    """Write standard output to a file; None to drop it."""
    with open(log or os.devnull, "w", encoding="utf-8") as file, contextlib.redirect_stdout(file):
        yield
