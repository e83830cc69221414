"""Processes that share a run, one per GPU or per core, started by torchrunx as in mjlab.

Each process is connected to the one that started it by a Unix socket, over which it sends lines of
JSON: progress and errors. It exits as soon as the connection is closed, so that no process writes
to a run after the one that holds its lock is gone. A byte on it asks the process to stop.
"""

from __future__ import annotations

import contextlib
import json
import logging
import multiprocessing
import os
import signal
import socket
import socketserver
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Problem
from draft.extras import need_posix
from draft.learn.engine.stopping import stopping

Send = Callable[[dict[str, Any]], None]  # A message of JSON values.
Worker = Callable[[int, Send], bool]

_HOST = "localhost"
# The first import of all libraries may take minutes from a slow disk [s].
_START_TIMEOUT = 600
_FAILED = "failed"
# Signals for which PyTorch ends its processes: its own, without SIGINT.
_NO_INTERRUPTS = {"TORCHELASTIC_SIGNALS_TO_HANDLE": "SIGTERM,SIGHUP,SIGQUIT"}
_stop = threading.Event()


def asked_to_stop() -> bool:
    """Return whether the parent process has asked this one to stop."""
    return _stop.is_set()


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
        KeyboardInterrupt: on Ctrl-C or SIGTERM: once all have stopped as `asked_to_stop` asks them
            to, or at once if none has sent a message yet.
    """
    need_posix("training in several processes", "add `replicas=1`, or use WSL")
    import torchrunx

    with tempfile.TemporaryDirectory(prefix="draft-") as folder, _Server(folder, receive) as server:
        launcher = torchrunx.Launcher(
            hostnames=[_HOST],
            workers_per_host=count,
            backend=None,  # rsl-rl starts the process group.
            agent_timeout=_START_TIMEOUT,
            extra_env_vars={**environment, **_NO_INTERRUPTS},
        )
        launcher.set_logging_handlers(partial(_handlers, str(logs), count))
        try:
            with _ignoring_interrupts(), stopping(server.stop):
                done = launcher.run(_process, worker, server.address).rank(0)
        except (torchrunx.WorkerFailedError, torchrunx.AgentFailedError) as error:
            cause = f"one of {count} processes was ended: {str(error).partition(chr(10))[0]}"
            raise _error(server, Problem(cause, None, f"see their logs in {logs}")) from None
        except (RuntimeError, OSError) as error:
            cause = f"torchrunx cannot run {count} processes: {error}"
            remedy = 'use one process: `device="0"`, or `replicas=1` on a CPU'
            raise _error(server, Problem(cause, None, remedy)) from None
        if server.error is not None:
            raise server.error
        return done


@contextlib.contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    """Let the processes that torchrunx starts ignore Ctrl-C, which reaches all of a terminal's.

    A process that is started ignores the signals that the shell ignores which starts it.
    """
    import torchrunx.launcher

    launcher: Any = torchrunx.launcher  # It does not export the function.
    execute = launcher.execute_command

    def ignoring(command: str, *args: Any, **kwargs: Any) -> tuple[str, str]:
        return execute(f"trap '' INT; {command}", *args, **kwargs)

    launcher.execute_command = ignoring
    try:
        yield
    finally:
        launcher.execute_command = execute


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
    """Connect to the parent process; stop when it asks, exit when the connection is closed."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.connect(address)

    def exit_with_parent() -> None:
        with contextlib.suppress(OSError):
            while connection.recv(1):
                _stop.set()
        os._exit(1)

    threading.Thread(target=exit_with_parent, daemon=True).start()
    return lambda message: connection.sendall(json.dumps(message).encode() + b"\n")


def _handlers(logs: str, count: int) -> list[logging.Handler]:
    """Handlers with which torchrunx writes the output of processes to files only.

    Called in torchrunx's logging process, a fork of this one. It exits with its parent; otherwise
    it would outlive a parent that is killed, and hold the lock on the run.
    """
    from torchrunx.utils.log_handling import file_handlers

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
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
        heard: whether a process has sent a message.
    """

    def __init__(self, folder: str, receive: Send) -> None:
        self.address = f"{folder}/socket"
        self.failed: list[tuple[str, None, str]] = []
        self.error: Exception | None = None
        self.heard = False
        self.receive = receive
        self.connections: list[socket.socket] = []
        super().__init__(self.address, _Handler)

    def stop(self) -> bool:
        """Ask the processes to stop; return whether they have begun, and so can."""
        for connection in self.connections if self.heard else ():
            with contextlib.suppress(OSError):
                connection.sendall(b"s")
        return self.heard

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
            self.server.heard = True
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
