"""Studies from Python: `run_study` runs, resumes, reports progress, and refuses bad input."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from draft.errors import DraftError
from draft.study import read_study, run_study
from draft.study import running as module
from draft.study.execution import Watch
from draft.study.jobs import Job
from draft.study.options import RunOptions
from draft.study.store import Store
from tests.study.small import SMALL, Fake, jobs

ORDER = list(jobs(SMALL))


@pytest.fixture(autouse=True)
def worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fake:
    """The one worker of every study here; the file `mine.yaml` in an empty folder."""
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(SMALL)
    fake = Fake()
    monkeypatch.setattr(module, "make_workers", lambda study, placement: [fake])
    return fake


class Log(Watch):
    """A watch that keeps what it is told."""

    def __init__(self) -> None:
        self.jobs: list[str] = []
        self.states: list[tuple[str, str]] = []
        self.ticks = 0

    def opened(self, store: Store) -> None:
        self.jobs = list(store.jobs)

    def changed(self, job: Job, state: str, reason: str) -> None:
        self.states.append((job.name, state))

    def tick(self) -> None:
        self.ticks += 1


def test_a_study_runs_prints_nothing_and_says_what_was_done(
    worker: Fake, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    watch = Log()
    outcome = run_study("mine.yaml", watch=watch)
    assert worker.began == watch.jobs == ORDER
    assert watch.states == [(name, state) for name in ORDER for state in ("running", "done")]
    assert watch.ticks >= len(ORDER)
    assert outcome.folder == Path("studies/mine").absolute()
    assert outcome.done
    assert outcome.jobs == dict.fromkeys(ORDER, "done")
    assert (outcome.failures, outcome.minutes_needed) == ({}, None)
    assert outcome.report == outcome.folder / "report/index.html"
    assert capsys.readouterr() == ("", "")
    # A finished study needs no worker.
    monkeypatch.setattr(module, "make_workers", lambda *_: pytest.fail("a worker is made"))
    assert run_study(Path("mine.yaml"), Path("studies/mine")).done


def test_a_study_that_was_read_runs_as_its_file_does(worker: Fake) -> None:
    run_study(read_study(Path("mine.yaml")))
    assert worker.began == ORDER
    toy = run_study(read_study(Path("mine.yaml"), toy=True))
    assert toy.folder == Path("studies/mine-toy").absolute()
    assert run_study("mine.yaml", toy=True).folder == toy.folder
    with pytest.raises(DraftError, match=r"read without its toy\n.*toy=True"):
        run_study(read_study(Path("mine.yaml")), toy=True)


def test_a_failure_is_returned_and_the_next_call_resumes(
    worker: Fake, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing = Fake(lambda name, _: 2 if name == "cheetah-push-0" else None)
    monkeypatch.setattr(module, "make_workers", lambda *_: [failing])
    outcome = run_study("mine.yaml")
    assert (outcome.done, list(outcome.failures)) == (False, ["cheetah-push-0"])
    assert outcome.jobs["cheetah-push-0-nominal"] == "skipped"
    monkeypatch.setattr(module, "make_workers", lambda *_: [worker])
    assert run_study("mine.yaml").done
    assert worker.began[0] == "cheetah-push-0"


def test_the_options_reach_the_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[RunOptions] = []

    def make(study: object, placement: RunOptions) -> list[Fake]:
        found.append(placement)
        return [Fake()]

    monkeypatch.setattr(module, "make_workers", make)
    run_study("mine.yaml", device="cpu", workers=2, engine="native", replicas=3)
    assert found == [RunOptions(device="cpu", workers=2, engine="native", replicas=3)]


def test_too_short_a_time_limit_does_nothing_and_says_what_is_needed(worker: Fake) -> None:
    outcome = run_study("mine.yaml", minutes=0.1)
    assert worker.began == []
    assert (outcome.done, outcome.minutes_needed, outcome.report) == (False, 1, None)


@pytest.mark.parametrize(
    ("file", "options"),
    [
        *(("mine.yaml", {"minutes": minutes}) for minutes in (0.0, -1.0, float("nan"), 1e7)),
        ("mine.yaml", {"workers": 0}),
        ("none.yaml", {}),
    ],
)
def test_bad_options_are_refused_before_anything_is_written(
    file: str, options: dict[str, Any]
) -> None:
    with pytest.raises(DraftError, match=next(iter(options), file)):
        run_study(file, **options)
    assert [path.name for path in Path().iterdir()] == ["mine.yaml"]
