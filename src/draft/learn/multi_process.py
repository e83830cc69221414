"""Processes that share a run, one per GPU or per core, started by torchrunx as mjlab starts them.

Each has a line home, a Unix socket over which it sends lines of JSON: progress, and what went
wrong. It is a lifeline too: a process ends as soon as the one that started them is gone, so that
none writes to a run that nobody holds any more.
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

Say = Callable[[dict[str, Any]], None]
Share = Callable[[int, Say], bool]

_HOST = "localhost"
# The first import of all that a process needs may take minutes from a slow disk [s].
_PATIENCE = 600
_FAILED = "failed"


def together(
    share: Share, count: int, environment: Mapping[str, str], logs: Path, hear: Say
) -> bool:
    """Let each of several processes do its share, and wait for all.

    Args:
        share: a function of a module, or a `partial` of one, of the rank and of how to tell
            something. Returns what the first process's returns.
        count: how many processes.
        environment: variables that they have besides this process's.
        logs: folder for what the processes print.
        hear: called with what they tell, in a thread.

    Raises:
        DraftError: a process failed, which ends the others, or they could not be started.
    """
    import torchrunx

    with tempfile.TemporaryDirectory(prefix="draft-") as place, _Line(place, hear) as line:
        launcher = torchrunx.Launcher(
            hostnames=[_HOST],
            workers_per_host=count,
            backend=None,  # rsl-rl starts the process group.
            agent_timeout=_PATIENCE,
            extra_env_vars=dict(environment),
        )
        launcher.set_logging_handlers(partial(_handlers, str(logs), count))
        try:
            done = launcher.run(_process, share, line.address).rank(0)
        except (torchrunx.WorkerFailedError, torchrunx.AgentFailedError) as error:
            cause = f"a process of the {count} was ended: {str(error).partition(chr(10))[0]}"
            raise _error(line, Problem(cause, None, f"their logs are in {logs}")) from None
        except (RuntimeError, OSError) as error:
            cause = f"torchrunx cannot run {count} processes: {error}"
            raise _error(
                line,
                Problem(cause, None, "one process works: --device 0, or --replicas 1 on a CPU"),
            ) from None
        if line.error is not None:
            raise line.error
        return done


def _error(line: _Line, otherwise: Problem) -> DraftError:
    """What the first process that failed said of it, or something else where none did."""
    return DraftError([Problem(*words) for words in line.failed] or otherwise)


def _process(share: Share, address: str) -> bool:
    """What each process does; a failure ends it at once, and torchrunx ends the others."""
    rank = int(os.environ["RANK"])
    say = _connect(address)
    try:
        return share(rank, say)
    except DraftError as error:
        problems = error.problems
    except Exception as error:
        # What is printed comes to the log through a thread, too late.
        logging.getLogger().error(traceback.format_exc())
        words = str(error).partition("\n")[0].partition(". ")[0]
        cause = f"process {rank} failed: {type(error).__name__}: {words}"
        problems = (Problem(cause, None, "its log, in the run's folder torchrunx, tells where"),)
    with contextlib.suppress(OSError):
        say({_FAILED: [(p.cause, None, p.remedy) for p in problems]})
    # An exception would only be noted until the others are done, and they wait for this one.
    os._exit(1)


def _connect(address: str) -> Say:
    """Take up the line home, and end when it is cut."""
    line = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    line.connect(address)

    def hold() -> None:
        with contextlib.suppress(OSError):
            line.recv(1)
        os._exit(1)

    threading.Thread(target=hold, daemon=True).start()
    return lambda message: line.sendall(json.dumps(message).encode() + b"\n")


def _handlers(logs: str, count: int) -> list[logging.Handler]:
    """Where torchrunx writes what processes print: to files alone.

    Called in its process for logs, a fork of this one. It would outlive this one where that is
    killed, and hold the lock on the run; so it ends with it.
    """
    from torchrunx.utils.log_handling import file_handlers

    parent = multiprocessing.parent_process()

    def leave() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=leave, daemon=True).start()
    return file_handlers([_HOST], [count], logs, logging.INFO)


class _Line(socketserver.ThreadingUnixStreamServer):
    """This end of the lines; leaving it waits until all processes are gone.

    Attributes:
        address: of the socket.
        failed: cause, place and remedy of each problem of the first process that failed.
        error: the first of what is called with what they tell.
    """

    def __init__(self, place: str, hear: Say) -> None:
        self.address = f"{place}/line"
        self.failed: list[tuple[str, None, str]] = []
        self.error: Exception | None = None
        self.hear = hear
        self.lines: list[socket.socket] = []
        super().__init__(self.address, _Listener)

    def __enter__(self) -> _Line:
        threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()
        for line in self.lines:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_WR)
        self.server_close()


class _Listener(socketserver.StreamRequestHandler):
    """Hears one process until it is gone."""

    server: _Line  # pyright: ignore[reportIncompatibleVariableOverride]

    def setup(self) -> None:
        super().setup()
        self.server.lines.append(self.request)

    def handle(self) -> None:
        for text in self.rfile:
            message = json.loads(text)
            if _FAILED not in message:
                self._hear(message)
            elif not self.server.failed:
                self.server.failed = message[_FAILED]

    def _hear(self, message: dict[str, Any]) -> None:
        # A terminal that is gone is no reason to leave the processes unheard, which ends them.
        try:
            self.server.hear(message)
        except Exception as error:
            self.server.error = self.server.error or error
