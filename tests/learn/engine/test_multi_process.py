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
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from draft.errors import DraftError, Problem
from draft.files import lock
from draft.learn.engine.multi_process import Send, _Server, asked_to_stop, run_processes
from tests.waiting import alive, until

# Not by importing it, for it brings PyTorch, and the processes import this module.
pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("torchrunx") is None, reason="torchrunx is not installed"
)
ROOT = Path(__file__).parents[3]
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}


def fails(folder: Path, rank: int, send: Send) -> bool:
    """The second process finds something wrong; the first would wait for it for ever."""
    send({"rank": rank, "gpus": os.environ["CUDA_VISIBLE_DEVICES"]})
    begun = folder / "begun"
    if rank == 1:
        until(begun.exists)
        raise DraftError(Problem("the second has had enough", None, "give it a rest"))
    begun.touch()
    time.sleep(3600)
    return True


def breaks(folder: Path, rank: int, send: Send) -> bool:
    raise ZeroDivisionError("by nothing\nat all")


def lasts(folder: Path, rank: int, send: Send) -> bool:
    send({"process": os.getpid()})
    time.sleep(3600)
    return True


def stops(folder: Path, rank: int, send: Send) -> bool:
    """Work until asked to stop."""
    send({"rank": rank})
    until(asked_to_stop)
    return False


GPUS = {"CUDA_VISIBLE_DEVICES": "4,GPU-5"}


def main(name: str, folder: str) -> None:
    """Run a function of this module as `draft train` does, in a folder that it holds."""

    def receive(message: dict[str, Any]) -> None:
        # In one piece: `print` writes the end of a line apart, and there are two threads.
        sys.stdout.write(json.dumps(message) + "\n")
        sys.stdout.flush()

    place = Path(folder)
    # Whoever runs the tests in the background may have them ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with lock(place, "test"):
        try:
            run_processes(partial(globals()[name], place), 2, GPUS, place / "logs", receive)
        except DraftError as error:
            print(json.dumps({"problem": str(error)}))
        except KeyboardInterrupt:
            print(json.dumps({"stopped": True}))


def start(name: str, folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", f"from {__name__} import main; main({name!r}, {str(folder)!r})"],
        cwd=ROOT,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def alone(name: str, address: str) -> subprocess.Popen[str]:
    """Start the second process without torchrunx."""
    code = f"from {__name__} import {name}, partial, Path\nworker = partial({name}, Path())\n"
    code += f"from draft.learn.engine.multi_process import _process\n_process(worker, {address!r})"
    return subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=ENVIRONMENT | {"RANK": "1"},
        stderr=subprocess.PIPE,
        text=True,
    )


def test_an_error_of_one_process_ends_all(tmp_path: Path) -> None:
    said, _ = start("fails", tmp_path).communicate()
    *told, last = [json.loads(line) for line in said.splitlines()]
    told.sort(key=lambda message: message["rank"])
    assert told == [{"rank": 0, "gpus": "4,GPU-5"}, {"rank": 1, "gpus": "4,GPU-5"}]
    assert last == {"problem": "the second has had enough\n  give it a rest"}
    assert len(list((tmp_path / "logs").glob("*/localhost*.log"))) == 3


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_asks_the_processes_to_stop_and_lets_them(tmp_path: Path, number: int) -> None:
    parent = start("stops", tmp_path)
    assert parent.stdout is not None
    with parent.stdout:
        assert {json.loads(parent.stdout.readline())["rank"] for _ in range(2)} == {0, 1}
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
    parent = start("lasts", tmp_path)
    assert parent.stdout is not None
    with parent.stdout:
        workers = [json.loads(parent.stdout.readline())["process"] for _ in range(2)]
    parent.kill()
    parent.wait()
    with (tmp_path / ".lock").open("a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # Waits for whoever still holds it.
    until(lambda: not any(map(alive, workers)))
