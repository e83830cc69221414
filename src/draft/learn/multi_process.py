"""Processes that share a run, one per GPU or per core, started by torchrunx as in mjlab.

Each process is connected to the one that started it by a Unix socket, over which it sends lines of
JSON: progress and errors. It exits as soon as the connection is closed, so that no process writes
to a run after the one that holds its lock is gone.
"""

from __future__ import annotations

import contextlib
import json
import logging
import multiprocessing
import os
import socket
import socketserver
import tempfile
import threading
import traceback
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Problem
from draft.extras import need_posix

Send = Callable[[dict[str, Any]], None]  # A message of JSON values.
Worker = Callable[[int, Send], bool]

_HOST = "localhost"
# The first import of all libraries may take minutes from a slow disk [s].
_START_TIMEOUT = 600
_FAILED = "failed"


def run_processes(
    worker: Worker, count: int, environment: Mapping[str, str], logs: Path, receive: Send
) -> bool:
    """Run a function in several processes, and wait for all.

    Args:
        worker: a function of a module, or a `partial` of one: takes the rank and a function that
            sends a message.
        count: number of processes.
        environment: environment variables for them, in addition to those of this process.
        logs: folder for the output of the processes.
        receive: called with each message, in a thread.

    Returns:
        The result of the first process.

    Raises:
        DraftError: a process failed, which ends the others, or they could not be started.
    """
    need_posix("training in several processes", "add --replicas 1, or use WSL")
    import torchrunx

    with tempfile.TemporaryDirectory(prefix="draft-") as folder, _Server(folder, receive) as server:
        launcher = torchrunx.Launcher(
            hostnames=[_HOST],
            workers_per_host=count,
            backend=None,  # rsl-rl starts the process group.
            agent_timeout=_START_TIMEOUT,
            extra_env_vars=dict(environment),
        )
        launcher.set_logging_handlers(partial(_handlers, str(logs), count))
        try:
            done = launcher.run(_process, worker, server.address).rank(0)
        except (torchrunx.WorkerFailedError, torchrunx.AgentFailedError) as error:
            cause = f"one of {count} processes was ended: {str(error).partition(chr(10))[0]}"
            raise _error(server, Problem(cause, None, f"see their logs in {logs}")) from None
        except (RuntimeError, OSError) as error:
            cause = f"torchrunx cannot run {count} processes: {error}"
            remedy = "use one process: --device 0, or --replicas 1 on a CPU"
            raise _error(server, Problem(cause, None, remedy)) from None
        if server.error is not None:
            raise server.error
        return done


def _error(server: _Server, otherwise: Problem) -> DraftError:
    """Error of the first process that failed, or another problem if none reported one."""
    return DraftError([Problem(*parts) for parts in server.failed] or otherwise)


def _process(worker: Worker, address: str) -> bool:
    """Run a worker in its process; a failure ends it at once, and torchrunx ends the others."""
    rank = int(os.environ["RANK"])
    send = _connect(address)
    try:
        return worker(rank, send)
    except DraftError as error:
        problems = error.problems
    except Exception as error:
        # Printed output reaches the log through a thread, too late.
        logging.getLogger().error(traceback.format_exc())
        text = str(error).partition("\n")[0].partition(". ")[0]
        cause = f"process {rank} failed: {type(error).__name__}: {text}"
        problems = (Problem(cause, None, "see its log in the run's folder torchrunx"),)
    with contextlib.suppress(OSError):
        send({_FAILED: [(p.cause, None, p.remedy) for p in problems]})
    # torchrunx would hold an exception until the others are done, and they wait for this process.
    os._exit(1)


def _connect(address: str) -> Send:
    """Connect to the parent process, and exit when the connection is closed."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.connect(address)

    def exit_with_parent() -> None:
        with contextlib.suppress(OSError):
            connection.recv(1)
        os._exit(1)

    threading.Thread(target=exit_with_parent, daemon=True).start()
    return lambda message: connection.sendall(json.dumps(message).encode() + b"\n")


def _handlers(logs: str, count: int) -> list[logging.Handler]:
    """Handlers with which torchrunx writes the output of processes to files only.

    Called in torchrunx's logging process, a fork of this one. It exits with its parent; otherwise
    it would outlive a parent that is killed, and hold the lock on the run.
    """
    from torchrunx.utils.log_handling import file_handlers

    parent = multiprocessing.parent_process()

    def exit_with_parent() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=exit_with_parent, daemon=True).start()
    return file_handlers([_HOST], [count], logs, logging.INFO)


class _Server(socketserver.ThreadingUnixStreamServer):
    """The parent's end of the connections; leaving it waits until all processes have exited.

    Attributes:
        address: path of the socket.
        failed: cause, place and remedy of each problem of the first process that failed.
        error: first exception that `receive` raised.
    """

    def __init__(self, folder: str, receive: Send) -> None:
        self.address = f"{folder}/socket"
        self.failed: list[tuple[str, None, str]] = []
        self.error: Exception | None = None
        self.receive = receive
        self.connections: list[socket.socket] = []
        super().__init__(self.address, _Handler)

    def __enter__(self) -> _Server:
        threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()
        for connection in self.connections:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_WR)
        self.server_close()


class _Handler(socketserver.StreamRequestHandler):
    """Receives the messages of one process until it exits."""

    # socketserver declares it as BaseServer, whatever server makes the handler.
    server: _Server  # pyright: ignore[reportIncompatibleVariableOverride]

    def setup(self) -> None:
        super().setup()
        self.server.connections.append(self.request)

    def handle(self) -> None:
        for text in self.rfile:
            message = json.loads(text)
            if _FAILED not in message:
                self._receive(message)
            elif not self.server.failed:
                self.server.failed = message[_FAILED]

    def _receive(self, message: dict[str, Any]) -> None:
        # An error here, as of a closed terminal, must not close the connection: that would end
        # the process.
        try:
            self.server.receive(message)
        except Exception as error:
            self.server.error = self.server.error or error
