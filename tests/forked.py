"""Processes that are forked from that of the tests: what it has imported, they need not import."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from typing import IO, NoReturn

# What a process says when a function of it raised.
_RAISED = 70


class Forked:
    """A process that runs a function and ends with the exit code that it returns.

    It has the standard input, output and error of a process of its own.

    Attributes:
        pid: its number.
        stdout: what it prints, as text.
        returncode: its exit code once it has ended, negative for a signal.
    """

    def __init__(self, function: Callable[[], object], *, merge: bool = False) -> None:
        """Start it.

        Args:
            function: what it does; returns an exit code, None for 0.
            merge: whether standard error goes to `stdout`; else to a file, see `errors`.
        """
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115
        reads, writes = os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()
        with warnings.catch_warnings():
            # Threads of libraries, none of which holds a lock that the function needs.
            warnings.simplefilter("ignore", DeprecationWarning)
            self.pid = os.fork()
        if not self.pid:
            os.close(reads)
            _become(function, writes, writes if merge else self._errors.fileno())
        os.close(writes)
        self.stdout: IO[str] = os.fdopen(reads, encoding="utf-8")
        self.returncode: int | None = None

    def send_signal(self, number: int) -> None:
        """Send it a signal."""
        os.kill(self.pid, number)

    def wait(self) -> int:
        """Wait until it ends; returns its exit code."""
        if self.returncode is None:
            _, status = os.waitpid(self.pid, 0)
            self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def errors(self) -> str:
        """What it has written to standard error."""
        self._errors.seek(0)
        return self._errors.read().decode()


def run(function: Callable[[], object]) -> subprocess.CompletedProcess[str]:
    """Run a function in a process of its own, and wait for it.

    Args:
        function: what it does; returns an exit code, None for 0.
    """
    process = Forked(function)
    with process.stdout:
        said = process.stdout.read()
    return subprocess.CompletedProcess((), process.wait(), said, process.errors())


def _become(function: Callable[[], object], out: int, err: int) -> NoReturn:
    """Be the new process: nothing of the tests may run in it, not even at its end."""
    code: object = _RAISED
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        nothing = os.open(os.devnull, os.O_RDONLY)
        for old, new in ((nothing, 0), (out, 1), (err, 2)):
            os.dup2(old, new)
        sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stdout = open(1, "w", encoding="utf-8", buffering=1, closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", encoding="utf-8", buffering=1, closefd=False)  # noqa: SIM115
        try:
            code = function()
        except SystemExit as error:
            code = error.code
        except KeyboardInterrupt:
            code = 130
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 0 if code is None else 1)
