"""Processes that share a run: torchrunx as on several GPUs, with shares that need none."""

from __future__ import annotations

import fcntl
import importlib.util
import json
import os
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
from draft.learn.multi_process import Say, _Line, together

# Not by importing it, for it brings PyTorch, and the processes import this module.
pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("torchrunx") is None, reason="torchrunx is not installed"
)
ROOT = Path(__file__).parents[2]
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}


def fails(folder: Path, rank: int, say: Say) -> bool:
    """The second process finds something wrong; the first would wait for it for ever."""
    say({"rank": rank, "gpus": os.environ["CUDA_VISIBLE_DEVICES"]})
    begun = folder / "begun"
    if rank == 1:
        while not begun.exists():
            time.sleep(0.01)
        raise DraftError(Problem("the second has had enough", None, "give it a rest"))
    begun.touch()
    time.sleep(3600)
    return True


def breaks(folder: Path, rank: int, say: Say) -> bool:
    raise ZeroDivisionError("by nothing\nat all")


def lasts(folder: Path, rank: int, say: Say) -> bool:
    say({"process": os.getpid()})
    time.sleep(3600)
    return True


GPUS = {"CUDA_VISIBLE_DEVICES": "4,GPU-5"}


def main(name: str, folder: str) -> None:
    """Start a share of this module as `draft train` does, in a folder that it holds."""

    def hear(message: dict[str, Any]) -> None:
        print(json.dumps(message), flush=True)

    place = Path(folder)
    with lock(place, "test"):
        try:
            together(partial(globals()[name], place), 2, GPUS, place / "logs", hear)
        except DraftError as error:
            print(json.dumps({"problem": str(error)}))


def start(name: str, folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", f"from {__name__} import main; main({name!r}, {str(folder)!r})"],
        cwd=ROOT,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        text=True,
    )


def alone(name: str, address: str) -> subprocess.Popen[str]:
    """Start the second process without torchrunx."""
    code = f"from {__name__} import {name}, partial, Path\nshare = partial({name}, Path())\n"
    code += f"from draft.learn.multi_process import _process\n_process(share, {address!r})"
    return subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=ENVIRONMENT | {"RANK": "1"},
        stderr=subprocess.PIPE,
        text=True,
    )


def test_what_one_finds_wrong_ends_all(tmp_path: Path) -> None:
    said, _ = start("fails", tmp_path).communicate(timeout=600)
    *told, last = [json.loads(line) for line in said.splitlines()]
    told.sort(key=lambda message: message["rank"])
    assert told == [{"rank": 0, "gpus": "4,GPU-5"}, {"rank": 1, "gpus": "4,GPU-5"}]
    assert last == {"problem": "the second has had enough\n  give it a rest"}
    assert len(list((tmp_path / "logs").glob("*/localhost*.log"))) == 3


def test_a_fault_is_told_in_a_line_and_logged_whole(tmp_path: Path) -> None:
    with _Line(str(tmp_path), lambda message: None) as line:
        process = alone("breaks", line.address)
        _, log = process.communicate(timeout=600)
    assert process.returncode == 1
    ((cause, _, remedy),) = line.failed
    assert cause == "process 1 failed: ZeroDivisionError: by nothing"
    assert "torchrunx" in remedy
    assert "in breaks" in log


def test_what_is_heard_may_fail_and_the_process_is_heard_on(tmp_path: Path) -> None:
    def hear(message: dict[str, Any]) -> None:
        raise BrokenPipeError("nobody reads")

    with _Line(str(tmp_path), hear) as line:
        speaks = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        speaks.connect(line.address)
        speaks.sendall(b'{"iteration": 1}\n{"failed": [["a cause", null, "a remedy"]]}\n')
        speaks.close()
        while not line.failed:
            time.sleep(0.01)
    assert isinstance(line.error, BrokenPipeError)
    assert line.failed == [["a cause", None, "a remedy"]]


def test_a_process_ends_when_its_line_is_cut(tmp_path: Path) -> None:
    told: list[dict[str, Any]] = []
    heard = threading.Event()

    def hear(message: dict[str, Any]) -> None:
        told.append(message)
        heard.set()

    with _Line(str(tmp_path), hear) as line:
        process = alone("lasts", line.address)
        assert heard.wait(600)
    process.communicate(timeout=600)
    assert told == [{"process": process.pid}]
    assert line.failed == []


def test_a_killed_parent_leaves_no_process_and_no_lock(tmp_path: Path) -> None:
    parent = start("lasts", tmp_path)
    assert parent.stdout is not None
    with parent.stdout:
        workers = [json.loads(parent.stdout.readline())["process"] for _ in range(2)]
    parent.kill()
    parent.wait()
    with (tmp_path / ".lock").open("a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # Waits for whoever still holds it.
    for worker in workers:
        while Path(f"/proc/{worker}").exists() and "Z (zombie)" not in status(worker):
            time.sleep(0.1)


def status(process: int) -> str:
    try:
        return Path(f"/proc/{process}/status").read_text()
    except OSError:
        return ""
