"""Where work is done: in processes of this machine, or on a Ray cluster.

An engine has one verb, `run(tasks, work)`: it calls `work` with each task somewhere and gives the
results as they come. Work whose process or machine dies is done again.
"""

from __future__ import annotations

import os
import signal
import socket
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import chain, islice
from multiprocessing import get_context, parent_process
from typing import Any, Protocol

from draft.errors import DraftError, Problem
from draft.extras import need

Work = Callable[[int], Any]
_AHEAD = 2  # tasks under way for each worker, so that memory is bounded and nobody waits
_DEATHS = 3
_RETRIES = 20
_PATIENCE = 5.0  # seconds
# Workers share the cores: threads of small linear algebra would only stand in each other's way.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Engine(Protocol):
    """What a run needs of an engine."""

    def run(self, tasks: Iterable[int], work: Work) -> Iterator[tuple[int, Any]]:
        """Do all tasks; give each with its result, as they are ready.

        Args:
            tasks: numbers; read only as far ahead as there are workers.
            work: what to do with each; it and its results can travel between processes.

        Raises:
            DraftError: raised by the work, or the work cannot be done.
        """
        ...


@dataclass(frozen=True, slots=True)
class LocalEngine:
    """Processes of this machine; with one worker, this process."""

    workers: int = 2

    def run(self, tasks: Iterable[int], work: Work) -> Iterator[tuple[int, Any]]:
        """Do all tasks; a worker that dies is replaced and its tasks are done again."""
        if self.workers == 1:
            for task in tasks:
                yield task, work(task)
            return
        source = iter(tasks)
        deaths = 0
        running: dict[Future[Any], int] = {}
        while True:
            source = chain(running.values(), source)
            running = {}
            try:
                for result in self._pool(source, work, running):
                    deaths = 0
                    yield result
                return
            except BrokenProcessPool:
                deaths += 1
                if deaths == _DEATHS:
                    cause = f"a worker process died {_DEATHS} times in a row"
                    remedy = "there may be too little memory: use fewer --workers"
                    raise DraftError(Problem(cause, None, remedy)) from None

    def _pool(
        self, source: Iterator[int], work: Work, running: dict[Future[Any], int]
    ) -> Iterator[tuple[int, Any]]:
        """Work with one set of processes, until all is done or one of them dies."""
        # Fresh processes: a fork would share MuJoCo's and NumPy's threads.
        pool = ProcessPoolExecutor(self.workers, get_context("spawn"), _start, (work,))
        before = {name: os.environ.get(name) for name in _THREADS}
        os.environ.update({name: value or "1" for name, value in before.items()})
        try:
            while True:
                for task in islice(source, max(0, self.workers * _AHEAD - len(running))):
                    running[_submit(pool, task)] = task
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    result = future.result()
                    yield running.pop(future), result
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
            for name in (name for name, value in before.items() if value is None):
                os.environ.pop(name, None)


def _submit(pool: ProcessPoolExecutor, task: int) -> Future[Any]:
    try:
        return pool.submit(_do, task)
    except BrokenProcessPool as error:
        # As if it had been accepted: the task is then among those that are done again.
        failed: Future[Any] = Future()
        failed.set_exception(error)
        return failed


_work: list[Work] = []


def _start(work: Work) -> None:
    """Make a worker ready: Ctrl-C is its parent's business, and it ends when its parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _work[:] = [work]
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _do(task: int) -> Any:
    return _work[0](task)


@dataclass(frozen=True, slots=True)
class RayEngine:
    """An existing Ray cluster; `address` as `ray.init` takes it."""

    address: str | None = None

    def run(self, tasks: Iterable[int], work: Work) -> Iterator[tuple[int, Any]]:
        """Do all tasks; those of a node that dies are done again on another."""
        ray = need("ray", "cluster")
        mine = self.join(ray)
        remote = ray.remote(_call).options(max_retries=_RETRIES, num_cpus=1)
        shared = ray.put(work)
        source = iter(tasks)
        running: dict[Any, int] = {}
        try:
            while True:
                ahead = _AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
                for task in islice(source, max(0, ahead - len(running))):
                    running[remote.remote(shared, task)] = task
                if not running:
                    return
                for done in ray.wait(list(running), num_returns=1)[0]:
                    yield running.pop(done), _result(ray, done)
        finally:
            for reference in running:
                ray.cancel(reference)
            if mine:
                ray.shutdown()

    def join(self, ray: Any) -> bool:
        """Join the cluster, unless this process has; say whether it must be left again."""
        if ray.is_initialized():
            return False
        try:
            _knock(self.address)
            ray.init(address=self.address or "auto", log_to_driver=False, logging_level="ERROR")
        except (OSError, ValueError, RuntimeError) as error:
            words = " ".join(str(error).split())[:200]
            where = f"at '{self.address}'" if self.address else "on this machine"
            cause = f"no Ray cluster answers {where}: {words}"
            remedy = "start one with 'ray start --head', or give --address"
            raise DraftError(Problem(cause, None, remedy)) from None
        return True


def _knock(address: str | None) -> None:
    """Fail at once where nobody listens; Ray itself tries for minutes."""
    host, colon, port = (address or "").rpartition(":")
    if colon and port.isdecimal() and "/" not in host:
        with socket.create_connection((host, int(port)), timeout=_PATIENCE):
            pass


def _call(work: Work, task: int) -> Any:
    return work(task)


def _result(ray: Any, reference: Any) -> Any:
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        if isinstance(error.cause, DraftError):
            raise error.cause from None
        raise
    except ray.exceptions.RayError as error:
        cause = f"the Ray cluster lost some work for good: {' '.join(str(error).split())[:200]}"
        remedy = "run the same command again to go on where it stopped"
        raise DraftError(Problem(cause, None, remedy)) from None
