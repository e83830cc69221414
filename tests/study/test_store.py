"""A study's folder: what is put aside and comes back, and what is no study."""

from __future__ import annotations

import contextlib
import json
import math
import os
from pathlib import Path

import pytest

from draft.errors import DraftError
from draft.study import execution as module
from draft.study.store import DONE
from tests.study.small import (
    SMALL,
    Fake,
    Killed,
    dying,
    go,
    jobs,
    request_of,
    states,
    store,
    write_output,
)


def test_a_number_that_changes_puts_outputs_aside_and_brings_them_back(tmp_path: Path) -> None:
    go(tmp_path, Fake(), SMALL)
    changed, back = Fake(), Fake()
    go(tmp_path, changed, SMALL + "set: {rewards.height: 0.5}\n")
    assert changed.began == list(jobs(SMALL))
    # Runs and evaluations lie side by side, so that each comes back by itself.
    assert len(list((tmp_path / "aside").iterdir())) == 4 + 8
    go(tmp_path, back, SMALL)
    assert back.began == ["report"]
    go(tmp_path, back, SMALL + "set: {rewards.height: 0.5}\n")
    assert back.began == ["report", "report"]


def test_evaluations_that_change_leave_their_runs_and_come_back(tmp_path: Path) -> None:
    go(tmp_path, Fake(), SMALL)
    text = SMALL.replace("replicas: 2", "replicas: 3")
    changed, back = Fake(), Fake()
    go(tmp_path, changed, text)
    expected = [n for n, job in jobs(SMALL).items() if job.kind != "train"]
    assert changed.began == expected
    go(tmp_path, back, SMALL)
    assert back.began == ["report"]


def replicas(folder: Path) -> set[int]:
    """What the evaluations at their places were asked for."""
    found = folder.glob("runs/*/evaluation/*/summary.json")
    return {json.loads(path.read_text())["asked"]["replicas"] for path in found}


def test_evaluations_of_several_files_do_not_get_mixed_up(tmp_path: Path) -> None:
    a, b = SMALL, SMALL.replace("replicas: 2", "replicas: 7")
    c = b + "set: {rewards.height: 0.4}\n"
    for text, count in ((a, 2), (b, 7), (c, 7), (a, 2), (c, 7), (b, 7), (a, 2)):
        worker = Fake()
        go(tmp_path, worker, text)
        assert replicas(tmp_path) == {count}
        assert set(states(tmp_path).values()) == {DONE}
    assert worker.began == ["report"]
    assert not list(tmp_path.glob("aside/*unknown*"))


def test_an_evaluation_in_the_way_of_one_that_comes_back_makes_room(tmp_path: Path) -> None:
    b = SMALL.replace("replicas: 2", "replicas: 7")
    go(tmp_path, Fake(), SMALL)
    go(tmp_path, Fake(), b)
    # As if a call had been killed between its moves and its note of them.
    record = (tmp_path / "study.json").read_text()
    go(tmp_path, Fake(), SMALL)
    (tmp_path / "study.json").write_text(record)
    back = Fake()
    go(tmp_path, back, b)
    assert back.began == []
    assert replicas(tmp_path) == {7}
    assert len(list(tmp_path.glob("aside/*-unknown"))) == 8


@pytest.mark.parametrize("moves", [1, 4, 7, 11, 12, 13, 16])
@pytest.mark.parametrize("change", ["replicas: 3", "replicas: 2}\nset: {rewards.height: 0.5"])
def test_a_kill_among_the_moves_mixes_nothing_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moves: int, change: str
) -> None:
    a = SMALL.replace("replicas: 2, levels: 2", "levels: 2, replicas: 2")
    b = a.replace("replicas: 2", change)
    for text in (a, b):
        go(tmp_path, Fake(), text)
    real, count = os.rename, iter(range(1, 100))

    def rename(source: Path, target: Path) -> None:
        if next(count) == moves:
            raise Killed
        real(source, target)

    monkeypatch.setattr(os, "rename", rename)
    with contextlib.suppress(Killed):
        go(tmp_path, Fake(), a)
    monkeypatch.undo()
    for text in (a, b):
        go(tmp_path, Fake(), text)
        assert set(states(tmp_path).values()) == {DONE}
        opened = store(tmp_path, text)
        assert all(job.complete(tmp_path) for job in opened.jobs.values())


def test_the_run_of_fewer_iterations_is_not_gone_on_with_where_the_longer_is_kept(
    tmp_path: Path,
) -> None:
    longer = SMALL.replace("push: 2", "push: 5")
    for text in (longer, SMALL, longer):
        worker = Fake()
        go(tmp_path, worker, text)
    assert worker.began == ["report"]
    go(tmp_path, worker, SMALL)
    assert worker.began == ["report", "report"]


def test_more_iterations_continue_a_run_and_fewer_start_another(tmp_path: Path) -> None:
    go(tmp_path, Fake(), SMALL)
    more, fewer = Fake(), Fake()
    go(tmp_path, more, SMALL.replace("push: 2", "push: 5"))
    assert more.began == [name for name in jobs(SMALL) if "push" in name or name == "report"]
    assert (tmp_path / "runs/bear-push-0/model_2.pt").exists()
    go(tmp_path, fewer, SMALL.replace("push: 2", "push: 1"))
    assert fewer.began == more.began
    assert not (tmp_path / "runs/bear-push-0/model_2.pt").exists()


def test_designs_that_leave_the_study_are_put_aside_and_others_stay(tmp_path: Path) -> None:
    go(tmp_path, Fake(), SMALL)
    alone = Fake()
    go(tmp_path, alone, SMALL.replace("[cheetah, bear]", "[bear]"), "bear")
    assert alone.began == ["report"]
    assert {path.name for path in (tmp_path / "runs").iterdir()} == {"bear-base-0", "bear-push-0"}


def test_an_evaluation_that_is_not_the_studys_is_put_aside(tmp_path: Path) -> None:
    with pytest.raises(Killed):
        go(tmp_path, dying("cheetah-base-0-nominal", lambda _: None), SMALL)
    # As 'draft evaluate' by hand leaves it, with whatever options.
    asked = request_of(jobs(SMALL)["cheetah-base-0-perturbed"], tmp_path)
    write_output(asked.model_copy(update={"levels": None, "replicas": 256}))
    later = Fake()
    go(tmp_path, later, SMALL)
    assert later.began == list(jobs(SMALL))[1:]
    assert (tmp_path / "aside/cheetah-base-0-perturbed-unknown/summary.json").exists()


def test_a_folder_with_something_else_is_kept(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(DraftError, match=r"holds no study, but mine.txt"):
        store(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_file_where_the_folder_should_be_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DraftError, match="cannot read"):
        store(tmp_path / "file")
    with pytest.raises(DraftError, match=r"cannot (read|write)"):
        store(tmp_path / "file/study").open()


BROKEN = '{"format": 1, "name": "a", "toy": false, "jobs": %s}'


@pytest.mark.parametrize("text", ["{", "[]", "{}", BROKEN % "[]", BROKEN % '{"a": 1}'])
def test_a_broken_study_is_reported(tmp_path: Path, text: str) -> None:
    (tmp_path / "study.json").write_text(text)
    with pytest.raises(DraftError, match="cannot be read as a study"):
        store(tmp_path)


def test_a_study_of_another_format_is_reported(tmp_path: Path) -> None:
    (tmp_path / "study.json").write_text('{"format": 9, "name": "small", "toy": false, "jobs": {}}')
    with pytest.raises(DraftError, match=r"another version of Draft"):
        store(tmp_path)


@pytest.mark.parametrize(
    ("name", "toy", "words"),
    [("small", True, "the toy of study 'small'"), ("other", False, "study 'other'")],
)
def test_a_folder_of_another_study_or_of_its_toy_is_kept(
    tmp_path: Path, name: str, toy: bool, words: str
) -> None:
    record = {"format": 1, "name": name, "toy": toy, "jobs": {}}
    (tmp_path / "study.json").write_text(json.dumps(record))
    with pytest.raises(DraftError, match=f"is of {words}; it is kept"):
        store(tmp_path)


def test_two_at_once_do_not_work_on_one_folder(tmp_path: Path) -> None:
    one = store(tmp_path)
    one.open()
    with pytest.raises(DraftError, match=r"another run of the study is running .* \(process \d+\)"):
        store(tmp_path).open()
    one.close()
    other = store(tmp_path)
    other.open()
    other.close()


def test_a_disk_that_is_full_ends_the_study_and_it_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, writes = Path.write_bytes, iter(range(10**6))

    def full(self: Path, data: bytes) -> int:
        if next(writes) > 8:
            raise OSError(28, "No space left on device")
        return real(self, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    first, second = Fake(), Fake()
    with pytest.raises(DraftError, match="no space left on device"):
        go(tmp_path, first, SMALL)
    monkeypatch.undo()
    monkeypatch.setattr(module, "_POLL", 0.0)
    go(tmp_path, second, SMALL)
    assert set(states(tmp_path).values()) == {DONE}
    assert math.isclose(len(first.began) + len(second.began), len(jobs(SMALL)), abs_tol=1)
