"""Running a study: jobs that fail, are killed, wait, and resume."""

from __future__ import annotations

import math
import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from draft.files import lock, locked
from draft.learn.training.run import Origin, Run, create, file_digest, open_run
from draft.study import execution as module
from draft.study.execution import Execution
from draft.study.jobs import Physics, Training
from draft.study.requests import EvaluateRequest, Request, TrainRequest
from draft.study.store import BEGUN, DONE, FAILED, SKIPPED, WAITING
from tests.learn.small import plan
from tests.study.small import (
    SMALL,
    Fake,
    Killed,
    again,
    dying,
    go,
    jobs,
    states,
    store,
    told,
    write_output,
)

CHEETAHS = [name for name in jobs(SMALL) if name.startswith("cheetah")]


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time, which stands still unless a test moves it [s]."""
    at = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: at[0])
    return at


def fails(job: str, code: int | None = 2) -> Fake:
    """A worker of which one job ends at once, with this exit code."""
    return Fake(lambda name, _: code if name == job else None)


def half(request: Request) -> None:
    write_output(request, done=1)


def test_all_jobs_are_done_in_order_and_then_none(tmp_path: Path) -> None:
    assert again(tmp_path) == list(jobs(SMALL))
    assert (tmp_path / "study.yaml").read_text() == SMALL
    assert again(tmp_path) == []


@pytest.mark.parametrize("name", jobs(SMALL))
@pytest.mark.parametrize("when", ["at its start", "half way", "at its end"])
def test_a_study_that_is_killed_resumes_with_any_engine_and_loses_nothing(
    tmp_path: Path, name: str, when: str
) -> None:
    def how(request: Request) -> None:
        if when == "at its end":
            write_output(request)
        elif when == "half way" and isinstance(request, TrainRequest):
            half(request)

    first, second = dying(name, how), Fake()
    first.physics, second.physics = Physics("native", 2), Physics("warp", 1)
    with pytest.raises(Killed):
        go(tmp_path, first)
    go(tmp_path, second)
    order = list(jobs(SMALL))
    assert first.began == order[: order.index(name) + 1]
    at = order.index(name) + (when == "at its end" and name != "report")
    assert second.began == order[at:]
    assert set(states(tmp_path).values()) == {DONE}
    for worker in (first, second):
        engines = {getattr(one, "engine", None) for one in worker.requests.values()}
        assert engines <= {worker.physics.engine, None}
    assert not (tmp_path / "aside").exists()


def test_a_job_that_fails_is_reported_and_its_dependants_alone_are_skipped(
    tmp_path: Path,
) -> None:
    failing = fails("cheetah-base-0")
    execution = go(tmp_path, failing)
    found = states(tmp_path)
    assert (found.pop("cheetah-base-0"), found.pop("report")) == (FAILED, WAITING)
    assert found == {name: SKIPPED if name in CHEETAHS else DONE for name in found}
    log = tmp_path / "logs/cheetah-base-0.log"
    why = execution.failures["cheetah-base-0"]
    assert why == f"exit code 2; {log} ends with\n    cheetah-base-0 says this"
    # The report is of what there is, and is written again when the rest is done.
    assert "report" in failing.began
    assert again(tmp_path) == [*CHEETAHS, "report"]


def test_without_anything_to_report_on_there_is_no_report(tmp_path: Path) -> None:
    failing = Fake(lambda name, _: 2 if "base" in name else None)
    execution = go(tmp_path, failing)
    assert failing.began == ["cheetah-base-0", "bear-base-0"]
    assert states(tmp_path)["report"] == WAITING
    assert len(execution.failures) == 2


def test_a_report_is_written_again_when_what_it_reports_on_is_repeated(tmp_path: Path) -> None:
    again(tmp_path)
    (tmp_path / "runs/bear-push-0/evaluation/nominal-walking/summary.json").unlink()
    assert again(tmp_path) == ["bear-push-0-nominal", "report"]
    # As a call that was killed between both would leave it.
    os.utime(tmp_path / "report/index.html", ns=(0, 0))
    assert again(tmp_path) == ["report"]
    # Without study.json, outputs are known by what they hold.
    (tmp_path / "study.json").unlink()
    assert again(tmp_path) == ["report"]


@pytest.mark.parametrize(
    ("codes", "done", "times", "why"),
    [
        pytest.param([-9, None], False, 2, "", id="a process that dies is replaced once"),
        pytest.param([-9, -9], False, 2, "was ended by SIGKILL", id="and not twice"),
        pytest.param([-9], True, 1, "", id="one that dies after its work was done has done it"),
        pytest.param([0], False, 1, "exited with 0, but", id="one without its output has failed"),
    ],
)
def test_a_job_is_judged_by_its_process_and_its_output(
    tmp_path: Path, codes: list[int | None], done: bool, times: int, why: str
) -> None:
    ends = iter(codes)

    def act(name: str, request: Any) -> int | None:
        if name != "bear-push-0":
            return None
        if done:
            write_output(request)
        return next(ends)

    worker = Fake(act)
    failures = go(tmp_path, worker).failures
    assert worker.began.count("bear-push-0") == times
    assert list(failures) == ["bear-push-0"] * bool(why)
    assert why in failures.get("bear-push-0", "")


@pytest.mark.parametrize("seconds", [module._PATIENCE / 2, module._PATIENCE * 2])
def test_a_run_that_a_dying_process_has_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float, now: list[float]
) -> None:
    with pytest.raises(Killed):
        go(tmp_path, dying("cheetah-base-0", half))
    held = lock(tmp_path / "runs/cheetah-base-0", "draft train")

    def pause(_: float) -> None:
        now[0] += 1.0
        if now[0] >= seconds:
            held.close()

    def act(name: str, request: Any) -> int | None:
        taken = name == "cheetah-base-0" and locked(Path(request.run))
        return 2 if taken else None

    monkeypatch.setattr(module.time, "sleep", pause)
    worker = Fake(act)
    execution = go(tmp_path, worker)
    held.close()
    # Others do not wait for it.
    assert worker.began[0] == "bear-base-0"
    if seconds < module._PATIENCE:
        assert not execution.failures
        assert set(states(tmp_path).values()) == {DONE}
    else:
        assert execution.failures.keys() == {"cheetah-base-0"}


@pytest.mark.usefixtures("now")
def test_training_is_sliced_and_given_the_time_that_is_left(tmp_path: Path) -> None:
    def act(name: str, request: Any) -> int | None:
        if name == "bear-base-0":
            half(request)
            return 0
        return None

    sliced = Fake(act)
    go(tmp_path, sliced, until=135.0)
    assert sliced.requests["cheetah-base-0"].minutes == 2.0
    assert states(tmp_path)["bear-base-0"] == BEGUN
    assert states(tmp_path)["bear-push-0"] == WAITING
    whole = Fake()
    go(tmp_path, whole)
    assert whole.began[0] == "bear-base-0"
    assert whole.requests["bear-base-0"].minutes is None
    assert set(states(tmp_path).values()) == {DONE}


def takes(now: list[float], training: float, evaluation: float) -> Fake:
    """A worker whose jobs take their time [s]."""

    def act(name: str, request: Any) -> None:
        now[0] += evaluation if isinstance(request, EvaluateRequest) else training

    return Fake(act)


def test_nothing_begins_that_would_not_end_in_time(tmp_path: Path, now: list[float]) -> None:
    late = takes(now, 1.0, 100.0)
    # 1 s of training, 100 s of evaluation; then 100 s are left, too few for another.
    go(tmp_path, late, until=201.0)
    push = ["cheetah-push-0", "cheetah-push-0-nominal"]
    assert late.began == ["cheetah-base-0", "cheetah-base-0-nominal", *push]
    nothing = takes(now, 1.0, 100.0)
    go(tmp_path, nothing, until=now[0] + module.LEAST)
    assert nothing.began == []


def test_an_evaluation_that_takes_most_of_a_slice_begins_with_the_next(
    tmp_path: Path, now: list[float]
) -> None:
    began: list[str] = []
    for _ in range(10):
        worker = takes(now, 20.0, 405.0)
        execution = go(tmp_path, worker, until=now[0] + 480.0)
        assert execution.missing_seconds() == 0.0
        began += worker.began
    assert sorted(began) == sorted(jobs(SMALL))


def test_a_job_trains_the_plan_that_the_graph_was_made_of(tmp_path: Path) -> None:
    found: dict[str, Run] = {}

    def act(name: str, request: Any) -> None:
        if isinstance(request, TrainRequest):  # The run is there before it is asked for.
            found[name] = open_run(Path(request.run))

    go(tmp_path, Fake(act))
    assert found.keys() == {name for name, job in jobs(SMALL).items() if job.kind == "train"}
    for name, run in found.items():
        job = jobs(SMALL)[name]
        assert isinstance(job, Training)
        assert replace(run.plan, origin=None) == job.plan
    base, push = found["bear-base-0"], found["bear-push-0"]
    assert base.plan.origin is None
    file = base.folder / "model_3.pt"
    assert push.plan.origin == Origin(str(base.folder), 3, file_digest(file))


@pytest.mark.parametrize("until", [math.inf, 10.0**7])
def test_a_run_that_is_replaced_by_another_meanwhile_is_reported(
    tmp_path: Path, until: float
) -> None:
    def act(name: str, request: Any) -> int | None:
        if name == "cheetah-base-0":
            folder = Path(request.run)
            shutil.rmtree(folder)
            create(folder, plan("giraffe"), {})
            write_output(request)
            return 0
        return None

    execution = go(tmp_path, Fake(act), until=until)
    assert execution.failures["cheetah-base-0"].startswith("its run has other designs, robots")
    assert states(tmp_path)["cheetah-base-0-nominal"] == SKIPPED
    # The run of the other is kept, and not gone on with.
    assert again(tmp_path)[0] == "cheetah-base-0"
    assert (tmp_path / "aside/cheetah-base-0-unknown/run.json").exists()


def test_a_run_that_cannot_be_made_fails_its_job_with_the_reason(tmp_path: Path) -> None:
    def act(name: str, request: Any) -> int | None:
        if name != "cheetah-base-0-perturbed":
            return None
        write_output(request)
        (tmp_path / "runs/cheetah-base-0/members.json").write_text("[")
        return 0

    execution = go(tmp_path, Fake(act))
    # The run that the next stage is to start from is broken.
    why = execution.failures["cheetah-push-0"]
    assert why.startswith("it cannot start; ")
    assert "cheetah-base-0' is broken: run.json or members.json cannot be read" in why
    assert states(tmp_path)["cheetah-push-0-nominal"] == SKIPPED
    assert states(tmp_path)["bear-push-0"] == DONE
    assert not (tmp_path / "runs/cheetah-push-0").exists()


def test_what_an_evaluation_took_is_its_last_attempt_and_training_all_its_slices(
    tmp_path: Path, now: list[float]
) -> None:
    tries = iter([-9, None])

    def act(name: str, request: Any) -> int | None:
        now[0] += 7.0
        if name == "cheetah-base-0" and now[0] < 10.0:
            half(request)
            return -9
        return next(tries) if name == "cheetah-base-0-nominal" else None

    go(tmp_path, Fake(act))
    found = told(tmp_path)["jobs"]
    assert found["cheetah-base-0"]["seconds"] == 14.0
    assert found["cheetah-base-0-nominal"]["seconds"] == 7.0


@pytest.mark.parametrize(("given", "lacking"), [(20.0, 25.0), (60.0, 60.0)])
@pytest.mark.usefixtures("now")
def test_a_slice_too_short_for_anything_says_by_how_much(
    tmp_path: Path, given: float, lacking: float
) -> None:
    def act(name: str, request: Any) -> int | None:
        write_output(request, done=0)  # It had time to load, and no more.
        return 0

    worker = Fake(act)
    execution = go(tmp_path, worker, until=given)
    assert bool(worker.began) == (given > module.LEAST)
    assert execution.missing_seconds() == lacking


class Endless(Fake):
    """A worker whose evaluations do not end."""

    stopped = 0

    def poll(self) -> int | None:
        return None if self.began[-1].endswith("nominal") else super().poll()

    def stop(self) -> None:
        self.stopped += 1


def test_what_does_not_end_in_time_is_ended_and_is_begun_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(range(10**6))
    monkeypatch.setattr(module.time, "monotonic", lambda: float(next(clock)))
    endless = Endless(lambda name, _: 0 if name.endswith("nominal") else None)
    execution = go(tmp_path, endless, until=200.0)
    assert endless.stopped >= 1
    assert execution.late[0] == "cheetah-base-0-nominal"
    assert execution.missing_seconds() == 0.0  # The training was done.
    assert states(tmp_path)["cheetah-base-0-nominal"] == WAITING
    assert not execution.failures


def test_two_workers_share_the_jobs(tmp_path: Path) -> None:
    opened = store(tmp_path, SMALL)
    opened.open()
    one, other = Fake(), Fake()
    assert Execution(opened, [one, other]).run()
    opened.close()
    assert sorted(one.began + other.began) == sorted(jobs(SMALL))
    assert (one.began[0], other.began[0]) == ("cheetah-base-0", "bear-base-0")
