"""Processes that share a run: torchrunx as on several GPUs, with workers that need none."""

from __future__ import annotations

import fcntl
import importlib.util
import json
import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from draft.learn.engine.multi_process import _Server
from tests.learn.engine.two_processes import ENVIRONMENT, GPUS, ROOT, start
from tests.waiting import alive, until

# Not by importing it, for it brings PyTorch.
pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("torchrunx") is None, reason="torchrunx is not installed"
)


def alone(name: str, address: str) -> subprocess.Popen[str]:
    """Start the second process without torchrunx."""
    code = f"from {start.__module__} import {name}, partial, Path\n"
    code += f"worker = partial({name}, Path())\n"
    code += f"from draft.learn.engine.multi_process import _process\n_process(worker, {address!r})"
    return subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=ENVIRONMENT | {"RANK": "1"},
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_asks_the_processes_to_stop_and_lets_them(tmp_path: Path, number: int) -> None:
    parent = start("stops", tmp_path, GPUS)
    assert parent.stdout is not None
    with parent.stdout:
        told = [json.loads(parent.stdout.readline()) for _ in range(2)]
        told.sort(key=lambda message: message["rank"])
        assert told == [{"rank": rank, "gpus": "4,GPU-5"} for rank in (0, 1)]
        # Ctrl-C reaches every process of a terminal.
        (os.killpg if number == signal.SIGINT else os.kill)(parent.pid, number)
        assert [json.loads(line) for line in parent.stdout] == [{"stopped": True}]
    assert parent.wait() == 0


def test_an_exception_is_reported_in_a_line_and_logged_in_full(tmp_path: Path) -> None:
    with _Server(str(tmp_path), lambda message: None) as server:
        process = alone("breaks", server.address)
        _, log = process.communicate()
    assert process.returncode == 1
    ((cause, _, remedy),) = server.failed
    assert cause == "process 1 failed: ZeroDivisionError: by nothing"
    assert "torchrunx" in remedy
    assert "in breaks" in log


def test_receiving_goes_on_after_an_error_of_the_receiver(tmp_path: Path) -> None:
    def receive(message: dict[str, Any]) -> None:
        raise BrokenPipeError("nobody reads")

    with _Server(str(tmp_path), receive) as server:
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        connection.connect(server.address)
        connection.sendall(b'{"iteration": 1}\n{"failed": [["a cause", null, "a remedy"]]}\n')
        connection.close()
        until(lambda: server.failed)
    assert isinstance(server.error, BrokenPipeError)
    assert server.failed == [["a cause", None, "a remedy"]]


def test_a_process_exits_when_its_connection_is_closed(tmp_path: Path) -> None:
    told: list[dict[str, Any]] = []
    received = threading.Event()

    def receive(message: dict[str, Any]) -> None:
        told.append(message)
        received.set()

    with _Server(str(tmp_path), receive) as server:
        process = alone("lasts", server.address)
        received.wait()
    process.communicate()
    assert told == [{"process": process.pid}]
    assert server.failed == []


def test_a_killed_parent_leaves_no_process_and_no_lock(tmp_path: Path) -> None:
    parent = start("lasts", tmp_path, GPUS)
    assert parent.stdout is not None
    with parent.stdout:
        workers = [json.loads(parent.stdout.readline())["process"] for _ in range(2)]
    parent.kill()
    parent.wait()
    with (tmp_path / ".lock").open("a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # Waits for whoever still holds it.
    until(lambda: not any(map(alive, workers)))
