"""Small studies, and workers that write what jobs would, without learning anything."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from draft.learn.engine import machine
from draft.learn.engine.machine import Machine
from draft.learn.measuring import results
from draft.learn.measuring.evaluation import prepare
from draft.learn.measuring.summary import FORMAT
from draft.learn.training.run import create, is_run, open_run, versions
from draft.spec.reader import read_text
from draft.study import capacity, placement
from draft.study.execution import Execution
from draft.study.file import Study
from draft.study.graph import graph
from draft.study.jobs import Group, Job, Physics, Training
from draft.study.requests import EvaluateRequest, Request, TrainRequest
from draft.study.store import DONE, Store
from tests.learn.small import member

TEXT = """\
designs: [cheetah, bear]
seeds: 2
stages: [base, push]
iterations: {base: 3, push: 2}
environments: 4
evaluate: {replicas: 2, levels: 2}
"""
SMALL = TEXT.replace("seeds: 2", "seeds: 1")
LARGE = TEXT.replace("environments: 4", "environments: 64")


def study(text: str = TEXT, toy: bool = False) -> Study:
    return Study(read_text(text, "small.yaml"), "small", text, toy)


def groups(*names: str) -> list[Group]:
    return [Group(name, (member(name),)) for name in names or ("cheetah", "bear")]


def jobs(text: str = TEXT, *names: str) -> dict[str, Job]:
    return graph(study(text), groups(*names))


def store(folder: Path, text: str = TEXT, *names: str) -> Store:
    chosen = groups(*names)
    return Store(folder, study(text), chosen, graph(study(text), chosen))


def machine_of(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this machine have some cores and no GPU, and native MuJoCo be of use."""
    for place in (capacity, machine):
        monkeypatch.setattr(place, "cores", lambda: cores)
    monkeypatch.setattr(machine, "obstacle", lambda: None)
    cpu = Machine(["cpu"], machine.choose("auto", ["cpu"]), None, cores)
    monkeypatch.setattr(placement, "this_machine", lambda: cpu)
    monkeypatch.setattr(placement, "_devices", lambda word: ["cpu"])


class Killed(BaseException):
    """The study's own process is killed."""


def write_output(request: Request, done: int | None = None) -> None:
    """Write what a request asks for.

    Args:
        request: of a job that was prepared.
        done: iterations of a training that are done; None for all.
    """
    if isinstance(request, TrainRequest):
        _train(request, done)
    elif isinstance(request, EvaluateRequest):
        _evaluate(request)
    else:
        folder = Path(request.study) / "report"
        folder.mkdir(exist_ok=True)
        (folder / "index.html").write_text("report")


def _train(request: TrainRequest, done: int | None) -> None:
    run = open_run(Path(request.run))
    count = request.iterations if done is None else done
    (run.folder / f"model_{count}.pt").write_text(f"{count} iterations")
    (run.folder / "state.json").write_text(json.dumps({"iteration": count}))


def _evaluate(request: EvaluateRequest) -> None:
    """Write parts of a result; of the summary only what tells whose it is."""
    question = prepare(open_run(Path(request.run)), request)
    question.folder.mkdir(parents=True, exist_ok=True)
    for name in results.PARTS:
        (question.folder / name).write_text("")
    asked = question.request.as_dict()
    told = {name: asked[name] for name in ("arm", "protocol")}
    told |= {"format": FORMAT, "asked": asked, "versions": versions()}
    (question.folder / results.SUMMARY).write_text(json.dumps(told))


def request_of(job: Job, folder: Path) -> Any:
    """What a worker is asked to do for a job, which is prepared, and so is its base."""
    if isinstance(job, Training) and job.plan.stage != "base":
        base = folder / "runs" / job.needs[0]
        if not is_run(base):
            create(base, replace(job.plan, stage="base"), {})
            (base / "model_1.pt").write_text("1 iteration")
    job.prepare(folder)
    return job.request(folder, "cpu", None)


class Fake:
    """A worker that does a job as soon as it begins.

    Attributes:
        began: logs' names, which are the jobs', in the order in which they were begun.
        requests: what each was asked.
    """

    device = "cpu"
    physics = Physics()

    def __init__(self, act: Callable[[str, Any], int | None] | None = None) -> None:
        """Note what it does.

        Args:
            act: called with a job's name and request; gives an exit code, or None to go on
                and write the output.
        """
        self._act = act or (lambda name, request: None)
        self.began: list[str] = []
        self.requests: dict[str, Any] = {}
        self._code: int | None = None

    def start(self, request: Request, log: Path, fresh: bool = False) -> None:
        self.began.append(log.stem)
        self.requests[log.stem] = request
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("a") as file:
            file.write(f"{log.stem} says this\n")
        self._code = self._act(log.stem, request)
        if self._code is None:
            write_output(request)
            self._code = 0

    def poll(self) -> int | None:
        return self._code

    def stop(self) -> None:
        self._code = None


def go(folder: Path, worker: Fake, text: str = SMALL, *names: str, **more: Any) -> Execution:
    """One call of the study."""
    opened = store(folder, text, *names)
    try:
        opened.open()
        execution = Execution(opened, [worker], **more)
        execution.run()
    finally:
        opened.close()
    return execution


def states(folder: Path) -> dict[str, str]:
    return {n: job["state"] for n, job in told(folder)["jobs"].items()}


def told(folder: Path) -> dict:
    return json.loads((folder / "study.json").read_text())


def again(folder: Path, text: str = SMALL, *names: str) -> list[str]:
    """Jobs that one more call does, after which all are done."""
    worker = Fake()
    go(folder, worker, text, *names)
    assert set(states(folder).values()) == {DONE}
    return worker.began


def dying(name: str, how: Callable[[Any], None]) -> Fake:
    """A worker during whose job the study is killed."""

    def act(job: str, request: Request) -> None:
        if job == name:
            how(request)
            raise Killed

    return Fake(act)
