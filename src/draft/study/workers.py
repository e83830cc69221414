"""Workers of a study: processes of this machine, each on its device, or tasks of Ray.

A job is a request that `draft.study.worker` runs in a process of its own. The process ends when
the one that started it ends, however that happens, so that no two ever work on one run.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from draft.errors import DraftError
from draft.extras import need_posix
from draft.parallel import single_threaded
from draft.study.jobs import AUTO, Physics
from draft.study.requests import Request, from_dict, to_dict

PROGRAM = (sys.executable, "-m", "draft.study.worker")
DIED = -1
_POLL = 0.2  # [s]


class Worker(Protocol):
    """Interface of what runs one job after another.

    Attributes:
        device: as `draft.learn.train` takes it.
        physics: engine and processes of its jobs.
    """

    device: str
    physics: Physics

    def start(self, request: Request, log: Path, fresh: bool = False) -> None:
        """Start a job.

        Args:
            request: the job.
            log: file to which its output is appended.
            fresh: whether to run it in a new process.
        """
        ...

    def poll(self) -> int | None:
        """Return the exit code of the job: None while it runs, negative if its process died."""
        ...

    def stop(self) -> None:
        """Kill the current job."""
        ...


class LocalWorker:
    """Worker that runs its jobs in a process of this machine."""

    def __init__(
        self,
        device: str,
        gpu: str | None = None,
        program: Sequence[str] = (),
        physics: Physics = AUTO,
    ) -> None:
        """Prepare; the process starts with the first job.

        Args:
            device: device as requests name it.
            gpu: the one GPU that the process sees; None for the CPU. On a CPU one process runs
                many jobs, because libraries take longer to load than a small job takes.
            program: command of the process; empty for `draft.study.worker`.
            physics: engine and processes of its jobs.

        Raises:
            DraftError: this is Windows, which cannot wait for several pipes.
        """
        need_posix("a study on this machine", "use WSL, or a Ray cluster")
        self.device, self.physics = device, physics
        self._gpu, self._program = gpu, tuple(program) or PROGRAM
        self._process: subprocess.Popen[bytes] | None = None
        self._received = b""

    def start(self, request: Request, log: Path, fresh: bool = False) -> None:
        """See `Worker`.

        Raises:
            DraftError: the log cannot be written.
        """
        if fresh or self._gpu is not None:
            self.stop()
        process = self._process
        if process is None or process.poll() is not None:
            process = self._begin(log)
        line = json.dumps({"request": to_dict(request), "log": str(log)}) + "\n"
        # If the process has died, `poll` reports it.
        with contextlib.suppress(BrokenPipeError):
            if process.stdin is not None:
                os.write(process.stdin.fileno(), line.encode())

    def poll(self) -> int | None:
        """See `Worker`."""
        process = self._process
        if process is None or process.stdout is None:
            return DIED
        if select.select([process.stdout], [], [], 0.0)[0]:
            chunk = os.read(process.stdout.fileno(), 4096)
            self._received += chunk
            line, newline, rest = self._received.partition(b"\n")
            if newline:
                self._received = rest
                return int(line)
            if not chunk:
                return min(process.wait(), DIED)
        return None

    def stop(self) -> None:
        """See `Worker`."""
        process, self._process, self._received = self._process, None, b""
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()

    def _begin(self, log: Path) -> subprocess.Popen[bytes]:
        self.stop()
        environment = dict(os.environ)
        if self._gpu is None:
            environment = single_threaded(environment)
        else:
            environment["CUDA_VISIBLE_DEVICES"] = self._gpu
        try:
            log.parent.mkdir(parents=True, exist_ok=True)
            with log.open("ab") as file:
                # In a session of its own, so that Ctrl-C reaches only the study.
                process = subprocess.Popen(
                    self._program,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=file,
                    env=environment,
                    start_new_session=True,
                )
        except OSError as error:
            cause = f"cannot start {self._program[0]} or write {log}: {error.strerror}"
            raise DraftError(cause, "repeat the command to resume") from None
        self._process = process
        return process


class RayWorker:
    """Worker that runs its jobs as Ray tasks, on any node that shares the study's folder."""

    def __init__(self, ray: Any, gpus: int = 1, physics: Physics = AUTO) -> None:
        """Prepare; nothing is started yet.

        Args:
            ray: the `ray` module, connected to a cluster.
            gpus: GPUs of each job; 0 for the CPU.
            physics: engine and processes of its jobs.
        """
        self.device, self.physics = "cuda" if gpus else "cpu", physics
        self._ray, self._task = ray, None
        cpus = 1 if gpus else physics.replicas or 1
        options = {"num_gpus": gpus, "num_cpus": cpus, "max_retries": 0}
        self._remote = ray.remote(do_job).options(**options)

    def start(self, request: Request, log: Path, fresh: bool = False) -> None:
        """See `Worker`."""
        self._task = self._remote.remote(to_dict(request), str(log))

    def poll(self) -> int | None:
        """See `Worker`."""
        if self._task is None:
            return DIED
        if not self._ray.wait([self._task], timeout=0)[0]:
            return None
        task, self._task = self._task, None
        try:
            return int(self._ray.get(task))
        except self._ray.exceptions.RayError:
            return DIED

    def stop(self) -> None:
        """See `Worker`."""
        if self._task is not None:
            self._ray.cancel(self._task, force=True)
            self._task = None


def do_job(request: dict[str, object], log: str) -> int:
    """Run a job in a process of this node; return its exit code."""
    gpu = os.environ.get("CUDA_VISIBLE_DEVICES")
    worker = LocalWorker("", gpu or None)
    try:
        worker.start(from_dict(request), Path(log))
        while (code := worker.poll()) is None:
            time.sleep(_POLL)
        return code
    finally:
        worker.stop()
