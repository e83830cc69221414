"""Processes that do jobs: codes, logs, deaths, and their end when the study is killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from draft.errors import DraftError
from draft.learn.training.run import create
from draft.study import worker
from draft.study.requests import (
    EvaluateRequest,
    ReportRequest,
    Request,
    TrainRequest,
    from_dict,
    to_dict,
)
from draft.study.workers import LocalWorker, Worker
from tests.learn.small import plan
from tests.study.small import write_output
from tests.waiting import alive, until


def wait_for(worker: Worker) -> int:
    while (code := worker.poll()) is None:
        time.sleep(0.02)
    return code


def pid(worker: LocalWorker) -> int:
    assert worker._process is not None
    return worker._process.pid


NOWHERE = ReportRequest(study="nowhere")


def test_one_process_does_one_job_after_the_other(tmp_path: Path) -> None:
    worker = LocalWorker("cpu")
    try:
        worker.start(train(tmp_path / "done", 2), tmp_path / "logs/a.log")
        assert wait_for(worker) == 0
        first = pid(worker)
        worker.start(
            TrainRequest(run="nowhere", iterations=3, device="cpu"), tmp_path / "logs/b.log"
        )
        assert wait_for(worker) == 2
        assert pid(worker) == first
        worker.start(NOWHERE, tmp_path / "logs/c.log", fresh=True)
        assert wait_for(worker) == 2
        assert pid(worker) != first
    finally:
        worker.stop()
    said = (tmp_path / "logs/a.log").read_text()
    assert said.startswith(f"train: run {tmp_path}/done, iterations 2, device cpu, engine warp\n")
    assert said.endswith("2 of 2 iterations are done\n")
    said = (tmp_path / "logs/b.log").read_text()
    assert "error: 'nowhere' is not a run of `draft.train`\n  create one with" in said
    assert "Traceback" not in said
    said = (tmp_path / "logs/c.log").read_text()
    assert said.startswith("report: study nowhere\nerror: ")


def train(folder: Path, done: int) -> TrainRequest:
    """A request for a run of which all is done."""
    pytest.importorskip("torch")
    create(folder, plan(), {})
    request = TrainRequest(run=str(folder), iterations=done, device="cpu", engine="warp")
    write_output(request)
    return request


def test_a_fault_is_logged_with_its_traceback(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fails(*_: object) -> None:
        raise ValueError("out of order")

    monkeypatch.setattr(worker, "do", fails)
    assert worker._exit_code(to_dict(NOWHERE)) == 70
    assert 'in fails\n    raise ValueError("out of order")' in capfd.readouterr().err
    monkeypatch.undo()
    assert worker._exit_code({"kind": "eval", "study": "x"}) == 2
    assert "error: not a request of a study: {'kind': 'eval'" in capfd.readouterr().err


REQUESTS = (
    TrainRequest(run="a", iterations=3, device="cuda", engine="native", replicas=2, minutes=1.5),
    EvaluateRequest(run="a", checkpoint=3, test=("push",), errors="paper", engine="warp"),
    ReportRequest(study="b"),
)


@pytest.mark.parametrize("request_", REQUESTS, ids=lambda one: one.kind)
def test_a_request_travels_as_json(request_: Request) -> None:
    assert from_dict(json.loads(json.dumps(to_dict(request_)))) == request_
    with pytest.raises(DraftError, match=r"not a request .*\n.*train, evaluate, report"):
        from_dict(to_dict(request_) | {"kind": "other"})
    with pytest.raises(DraftError, match=r"not a request|there is no setting 'more'"):
        from_dict(to_dict(request_) | {"more": 1})


def test_a_worker_refuses_invalid_options_as_the_command_does() -> None:
    bad = to_dict(EvaluateRequest(run="a")) | {"replicas": 0}
    with pytest.raises(DraftError, match="`replicas` 0 is not a whole number from 1 to 1000000"):
        from_dict(bad)


def test_every_job_of_a_gpu_has_a_process_of_its_own_that_sees_it_alone(tmp_path: Path) -> None:
    program = tmp_path / "tell.py"
    program.write_text("import os; input(); os._exit(int(os.environ['CUDA_VISIBLE_DEVICES']))")
    worker = LocalWorker("cuda", "7", (sys.executable, str(program)))
    worker.start(NOWHERE, tmp_path / "a.log")
    first = pid(worker)
    assert wait_for(worker) < 0
    assert worker._process is not None
    assert worker._process.returncode == 7
    worker.start(NOWHERE, tmp_path / "a.log")
    assert pid(worker) != first
    worker.stop()


def test_a_process_that_is_killed_is_reported_and_replaced(tmp_path: Path) -> None:
    worker = LocalWorker("cpu", program=(sys.executable, "-c", "import time; time.sleep(999)"))
    worker.start(NOWHERE, tmp_path / "a.log")
    assert worker.poll() is None
    os.kill(pid(worker), signal.SIGKILL)
    assert wait_for(worker) == -signal.SIGKILL
    worker.start(NOWHERE, tmp_path / "a.log")
    assert worker.poll() is None
    worker.stop()
    assert worker.poll() == -1


def test_a_process_ends_when_the_one_that_started_it_is_killed(tmp_path: Path) -> None:
    script = f"""
import time
from pathlib import Path
from draft.study.requests import ReportRequest
from draft.study.workers import LocalWorker
worker = LocalWorker("cpu")
worker.start(ReportRequest(study="nowhere"), Path({str(tmp_path)!r}) / "a.log")
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
    until(lambda: not alive(child))
