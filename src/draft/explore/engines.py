"""Engines: where the tasks of a run are done, in processes of this machine or on a Ray cluster."""

from __future__ import annotations

import shlex
import socket
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Protocol

from draft import parallel
from draft.errors import DraftError
from draft.extras import need

Work = Callable[[int], Any]
_RETRIES = 20
_TIMEOUT = 5.0  # [s]
_START = shlex.join(["ray", "start", "--head"])


class Engine(Protocol):
    """Does the tasks of a run."""

    def run(self, tasks: Iterable[int], work: Work) -> Iterator[tuple[int, Any]]:
        """Do all tasks, and those of a process or machine that dies again.

        Args:
            tasks: numbers of the tasks, read only as far ahead as there are workers.
            work: function of a task's number; it and its results are picklable.

        Yields:
            Each task with its result, in the order of completion.

        Raises:
            DraftError: raised by `work`, or the tasks cannot be done.
        """
        ...


@dataclass(frozen=True, slots=True)
class LocalEngine:
    """Processes of this machine; a single worker is this process itself."""

    workers: int

    def run(self, tasks: Iterable[int], work: Work) -> Iterator[tuple[int, Any]]:
        """See `Engine`."""
        return parallel.run(tasks, work, self.workers)


@dataclass(frozen=True, slots=True)
class RayEngine:
    """An existing Ray cluster.

    Attributes:
        address: as `ray.init` takes it; None for the cluster of this machine.
    """

    address: str | None = None

    def run(self, tasks: Iterable[int], work: Work) -> Iterator[tuple[int, Any]]:
        """See `Engine`."""
        ray = need("ray", "cluster")
        joined = self.join(ray)
        remote = ray.remote(_call).options(max_retries=_RETRIES, num_cpus=1)
        shared = ray.put(work)
        source = iter(tasks)
        running: dict[Any, int] = {}
        try:
            while True:
                ahead = parallel.AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
                for task in islice(source, max(0, ahead - len(running))):
                    running[remote.remote(shared, task)] = task
                if not running:
                    return
                for done in ray.wait(list(running), num_returns=1)[0]:
                    yield running.pop(done), _result(ray, done)
        finally:
            for reference in running:
                ray.cancel(reference)
            if joined:
                ray.shutdown()

    def join(self, ray: Any) -> bool:
        """Join the cluster; returns whether this call did, so that the caller must leave it.

        Raises:
            DraftError: no cluster answers.
        """
        if ray.is_initialized():
            return False
        try:
            _check_reachable(self.address)
            ray.init(address=self.address or "auto", log_to_driver=False, logging_level="ERROR")
        except (OSError, ValueError, RuntimeError) as error:
            reason = " ".join(str(error).split())[:200]
            where = f"at '{self.address}'" if self.address else "on this machine"
            cause = f"no Ray cluster answers {where}: {reason}"
            remedy = f"start one with '{_START}', or give `address`"
            raise DraftError(cause, remedy) from None
        return True


def _check_reachable(address: str | None) -> None:
    """Fail at once where nothing listens; Ray itself retries for minutes."""
    host, colon, port = (address or "").rpartition(":")
    if colon and port.isdecimal() and "/" not in host:
        with socket.create_connection((host, int(port)), timeout=_TIMEOUT):
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
        cause = f"the Ray cluster lost a task: {' '.join(str(error).split())[:200]}"
        remedy = "repeat the command to resume"
        raise DraftError(cause, remedy) from None
