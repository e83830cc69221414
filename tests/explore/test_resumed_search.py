"""Searches that were stopped, at any trial and in any way, and end as one that was not."""

from __future__ import annotations

import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design import Design
from draft.explore import search
from draft.explore.storage import FILE, STUDY, SqliteLog
from draft.metrics import METRICS, Metric
from tests.explore import small  # noqa: F401  (skips without the extra)

TRIALS, POPULATION = 95, 10
LENGTHS = {"thigh_length": (0.15, 0.6), "shank_length": (0.15, 0.6)}
VARIED = LENGTHS | {
    "actuators.leg.peak_torque": (40, 150),
    "actuators.leg.no_load_speed": [15.0, 20.0, 30.0, 45.0],
}


@dataclass(frozen=True)
class Kind:
    """What is searched for, and how."""

    sampler: Any = "nsga2"
    minimise: tuple[str, ...] = ("mass",)
    maximise: tuple[str, ...] = ("jump_height",)
    subject_to: tuple[str, ...] = ()

    def run(self, trials: int, out: Path) -> None:
        draft.optimise(
            "quadruped",
            vary=VARIED,
            out=out,
            minimise=self.minimise,
            maximise=self.maximise,
            subject_to=self.subject_to,
            trials=trials,
            sampler=self.sampler,
        )


REQUIRED = ("accepted", "payload_rated > 20")
KINDS = [
    Kind(sampler, minimise, maximise, subject_to)
    for sampler in ("nsga2", "tpe")
    for minimise, maximise in ((("mass",), ("jump_height",)), (("mass",), ()), (("crowd",), ()))
    for subject_to in ((), REQUIRED)
]


def crowd(subject: Any) -> Any:
    """A value that depends on the designs beside it, as with a policy, and fails for some."""
    design: Design = subject
    mass = design.mass * (1 + (design.count or 1) / 1000)
    return np.where(np.asarray(design.parameters["thigh_length"]) > 0.45, np.nan, mass)


@pytest.fixture(scope="module", autouse=True)
def small_generations() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "POPULATION", POPULATION)
        one = Metric("crowd", "kg", "M.", "m", "a test", "less", "design", crowd)
        patch.setitem(METRICS._items, "crowd", one)
        yield


def outcome(out: Path) -> tuple[list[Any], dict[str, bytes]]:
    """All trials of a study, and the files of its front."""
    optuna = pytest.importorskip("optuna")
    storage = optuna.storages.JournalStorage(SqliteLog(out / FILE))
    study = optuna.load_study(study_name=STUDY, storage=storage)
    trials = [(t.params, t.state.name, t.values, t.user_attrs) for t in study.trials]
    files = {
        str(path.relative_to(out)): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.suffix in (".csv", ".json", ".yaml")
    }
    assert "front.csv" in files
    return trials, files


@pytest.fixture(scope="module")
def scratch() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder)


@cache
def whole(kind: Kind, scratch: Path) -> tuple[list[Any], dict[str, bytes], Path]:
    """Outcome of an uninterrupted search, and its folder."""
    out = scratch / f"whole{KINDS.index(kind)}"
    kind.run(TRIALS, out)
    trials, files = outcome(out)
    assert len(trials) == TRIALS
    return trials, files, out


def check(kind: Kind, out: Path, scratch: Path) -> None:
    trials, files, _ = whole(kind, scratch)
    resumed, resumed_files = outcome(out)
    assert len(resumed) == len(trials)
    different = [
        i for i, (a, b) in enumerate(zip(resumed, trials, strict=True)) if repr(a) != repr(b)
    ]
    assert different == []
    assert resumed_files == files


@pytest.mark.parametrize("first", [POPULATION, 4])
@pytest.mark.parametrize(
    "kind", [KINDS[0], *(pytest.param(one, marks=pytest.mark.slow) for one in KINDS[1:])], ids=str
)
def test_a_search_in_steps_of_one_generation_is_a_whole_one(
    kind: Kind, first: int, scratch: Path
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for trials in (*range(first, TRIALS, POPULATION), TRIALS):
            kind.run(trials, Path(folder))
        check(kind, Path(folder), scratch)


@pytest.mark.slow
@given(kind=st.sampled_from(KINDS), stops=st.sets(st.integers(1, TRIALS), max_size=3))
def test_a_search_that_ends_at_any_trials_goes_on_as_a_whole_one(
    kind: Kind, stops: set[int], scratch: Path
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for trials in (*sorted(stops), TRIALS):
            kind.run(trials, Path(folder))
        check(kind, Path(folder), scratch)


@pytest.mark.slow
@given(kind=st.sampled_from(KINDS), data=st.data())
def test_a_log_that_ends_after_any_entry_goes_on_as_a_whole_one(
    kind: Kind, data: st.DataObject, scratch: Path
) -> None:
    _, _, source = whole(kind, scratch)
    with tempfile.TemporaryDirectory() as folder:
        for path in source.glob(f"{FILE}*"):
            shutil.copy(path, folder)
        with sqlite3.connect(Path(folder, FILE)) as log:
            (entries,) = log.execute("SELECT COUNT(*) FROM log").fetchone()
            kept = data.draw(st.integers(0, entries), label="entries")
            log.execute("DELETE FROM log WHERE number >= ?", (kept,))
        log.close()
        kind.run(TRIALS, Path(folder))
        check(kind, Path(folder), scratch)


@pytest.mark.slow
def test_a_search_of_many_generations_resumes_without_a_call_for_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "POPULATION", 2)
    Kind().run(400, tmp_path)
    depth, frame = 0, sys._getframe()
    while frame is not None:
        depth, frame = depth + 1, frame.f_back
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(depth + 350)
    try:
        Kind().run(402, tmp_path)
    finally:
        sys.setrecursionlimit(limit)
    assert len(outcome(tmp_path)[0]) == 402


@pytest.mark.slow
def test_real_generations_resume_wherever_the_search_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "POPULATION", 50)
    words = [
        *("optimise", "quadruped", "--vary", "thigh_length=0.15:0.6", "shank_length=0.15:0.6"),
        *("actuators.leg.peak_torque=40:150", "actuators.leg.no_load_speed=15:45"),
        *("--minimise", "mass", "--maximise", "jump_height", "--trials", "800", "--out"),
    ]
    command = [sys.executable, "-m", "draft", *words]
    subprocess.run([*command, str(tmp_path / "whole")], check=True, capture_output=True)
    rng, killed = np.random.default_rng(0), 0
    for until in sorted(rng.integers(1, 800, 6)):
        process = subprocess.Popen(
            [*command, str(tmp_path / "parts")],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        while process.poll() is None and _stored(tmp_path / "parts") < until:
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
    assert killed >= 3
    subprocess.run([*command, str(tmp_path / "parts")], check=True, capture_output=True)
    resumed, files = outcome(tmp_path / "parts")
    trials, whole_files = outcome(tmp_path / "whole")
    assert resumed == trials
    assert files == whole_files


def _stored(out: Path) -> int:
    """Number of the entries that a search has written so far."""
    try:
        with sqlite3.connect(f"file:{out / FILE}?mode=ro", uri=True) as log:
            return log.execute("SELECT COUNT(*) FROM log").fetchone()[0]
    except sqlite3.OperationalError:
        return 0


@pytest.mark.slow
@pytest.mark.parametrize("stop", [50, 300, 600, 650, 657, 700])
def test_a_search_with_more_trials_is_a_whole_one(
    stop: int, scratch: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "POPULATION", 50)
    kind = Kind(subject_to=REQUIRED)
    if not (scratch / "800").exists():
        kind.run(800, scratch / "800")
    with tempfile.TemporaryDirectory() as folder:
        kind.run(stop, Path(folder))
        kind.run(800, Path(folder))
        assert outcome(Path(folder)) == outcome(scratch / "800")
