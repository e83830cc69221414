"""Worker processes of this machine: a pool that replaces dead workers, and a limit on threads."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import chain, islice
from multiprocessing import get_context, parent_process
from typing import Any, TypeVar

from draft.errors import DraftError

Task = TypeVar("Task")
Result = TypeVar("Result")
# Tasks submitted per worker: bounds the memory, and no worker waits for its next task.
AHEAD = 2
_MAX_DEATHS = 3
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def single_threaded(environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment that limits linear algebra to one thread, unless it is set already.

    Workers share the cores, so that threads of small products would only wait for each other.
    """
    return dict.fromkeys(_THREADS, "1") | dict(environment)


def run(
    tasks: Iterable[Task], work: Callable[[Task], Result], workers: int
) -> Iterator[tuple[Task, Result]]:
    """Do tasks in worker processes; a worker that dies is replaced, and its tasks are repeated.

    Args:
        tasks: picklable tasks, read only as far ahead as there are workers.
        work: function of a task; it and its results are picklable.
        workers: processes; with 1, the tasks run in this process.

    Yields:
        Each task with its result, in the order of completion.

    Raises:
        DraftError: workers died several times in a row.
        Exception: whatever `work` raises.
    """
    if workers == 1:
        for task in tasks:
            yield task, work(task)
        return
    source = iter(tasks)
    deaths = 0
    running: dict[Future[Result], Task] = {}
    while True:
        source = chain(running.values(), source)
        running = {}
        try:
            for result in _run_pool(source, work, workers, running):
                deaths = 0
                yield result
            return
        except BrokenProcessPool:
            deaths += 1
            if deaths == _MAX_DEATHS:
                cause = f"a worker process died {_MAX_DEATHS} times in a row"
                remedy = "the memory may be too small: use fewer `workers`"
                raise DraftError(cause, remedy) from None


def _run_pool(
    source: Iterator[Task],
    work: Callable[[Task], Result],
    workers: int,
    running: dict[Future[Result], Task],
) -> Iterator[tuple[Task, Result]]:
    """Do tasks with one set of processes, until all are done or a process dies."""
    # Spawned: a fork would share the threads of MuJoCo and NumPy.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _start, (work,))
    before = dict(os.environ)
    os.environ.update(single_threaded(before))
    try:
        while True:
            for task in islice(source, max(0, workers * AHEAD - len(running))):
                running[_submit(pool, task)] = task
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                result = future.result()
                yield running.pop(future), result
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        for name in set(_THREADS) - before.keys():
            os.environ.pop(name, None)


def _submit(pool: ProcessPoolExecutor, task: object) -> Future[Any]:
    try:
        return pool.submit(_do, task)
    except BrokenProcessPool as error:
        # Handled like an accepted task, so that it is repeated with the others.
        failed: Future[Any] = Future()
        failed.set_exception(error)
        return failed


_work: list[Callable[..., object]] = []


def _start(work: Callable[..., object]) -> None:
    """Prepare a worker: it ignores Ctrl-C, which its parent handles, and ends with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _work[:] = [work]
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _do(task: object) -> object:
    return _work[0](task)
