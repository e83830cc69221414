"""Processes that do jobs: codes, logs, deaths, and their end when the study is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from draft.learn.study.workers import LocalWorker, RayWorker, Worker

PATIENCE = 120.0


def wait_for(worker: Worker) -> int:
    end = time.monotonic() + PATIENCE
    while (code := worker.poll()) is None:
        assert time.monotonic() < end
        time.sleep(0.02)
    return code


def pid(worker: LocalWorker) -> int:
    assert worker._process is not None
    return worker._process.pid


def test_one_process_does_one_command_after_the_other(tmp_path: Path) -> None:
    worker = LocalWorker("cpu")
    try:
        worker.start(["list"], tmp_path / "logs/a.log")
        assert wait_for(worker) == 0
        first = pid(worker)
        worker.start(["show", "nothing"], tmp_path / "logs/b.log")
        assert wait_for(worker) == 2
        worker.start(["show", "--nothing"], tmp_path / "logs/b.log")
        assert wait_for(worker) == 2
        assert pid(worker) == first
        worker.start(["--version"], tmp_path / "logs/c.log", fresh=True)
        assert wait_for(worker) == 0
        assert pid(worker) != first
    finally:
        worker.stop()
    said = (tmp_path / "logs/a.log").read_text()
    assert said.startswith("$ draft list\n")
    assert "quadruped" in said
    assert "error: " in (tmp_path / "logs/b.log").read_text()
    assert "quadruped" not in (tmp_path / "logs/c.log").read_text()


def test_every_job_of_a_gpu_has_a_process_of_its_own_that_sees_it_alone(tmp_path: Path) -> None:
    program = tmp_path / "tell.py"
    program.write_text("import os; input(); os._exit(int(os.environ['CUDA_VISIBLE_DEVICES']))")
    worker = LocalWorker("cuda", "7", (sys.executable, str(program)))
    worker.start([], tmp_path / "a.log")
    first = pid(worker)
    assert wait_for(worker) < 0
    assert worker._process is not None
    assert worker._process.returncode == 7
    worker.start([], tmp_path / "a.log")
    assert pid(worker) != first
    worker.stop()


def test_a_process_that_is_killed_is_told_and_replaced(tmp_path: Path) -> None:
    worker = LocalWorker("cpu", program=(sys.executable, "-c", "import time; time.sleep(999)"))
    worker.start([], tmp_path / "a.log")
    assert worker.poll() is None
    os.kill(pid(worker), signal.SIGKILL)
    assert wait_for(worker) == -signal.SIGKILL
    worker.start([], tmp_path / "a.log")
    assert worker.poll() is None
    worker.stop()
    assert worker.poll() == -1


def test_a_process_ends_when_the_one_that_started_it_is_killed(tmp_path: Path) -> None:
    script = f"""
import time
from pathlib import Path
from draft.learn.study.workers import LocalWorker
worker = LocalWorker("cpu")
worker.start(["list"], Path({str(tmp_path)!r}) / "a.log")
while worker.poll() is None:
    time.sleep(0.02)
print(worker._process.pid, flush=True)
time.sleep(999)
"""
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    os.kill(child, 0)
    parent.kill()
    parent.wait()
    parent.stdout.close()
    end = time.monotonic() + PATIENCE
    while _alive(child):
        assert time.monotonic() < end
        time.sleep(0.05)


def _alive(number: int) -> bool:
    try:
        state = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_does_jobs_too(tmp_path: Path) -> None:
    ray = pytest.importorskip("ray")
    ray.init(num_cpus=1, log_to_driver=False, logging_level="ERROR", include_dashboard=False)
    try:
        worker = RayWorker(ray, gpus=0)
        worker.start(["show", "nothing"], tmp_path / "a.log")
        assert wait_for(worker) == 2
        worker.stop()
        assert worker.poll() == -1
    finally:
        ray.shutdown()
    assert "error: " in (tmp_path / "a.log").read_text()
