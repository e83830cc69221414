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
from tests.study.small import (
    SMALL,
    Fake,
    Killed,
    again,
    dying,
    go,
    jobs,
    request_of,
    store,
    write_output,
)

CHANGED = SMALL + "set: {rewards.height: 0.5}\n"


def test_a_number_that_changes_puts_outputs_aside_and_brings_them_back(tmp_path: Path) -> None:
    again(tmp_path)
    assert again(tmp_path, CHANGED) == list(jobs(SMALL))
    # Runs and evaluations lie side by side, so that each comes back by itself.
    assert len(list((tmp_path / "aside").iterdir())) == 4 + 8
    assert again(tmp_path) == ["report"]
    assert again(tmp_path, CHANGED) == ["report"]


def test_evaluations_that_change_leave_their_runs_and_come_back(tmp_path: Path) -> None:
    again(tmp_path)
    text = SMALL.replace("replicas: 2", "replicas: 3")
    assert again(tmp_path, text) == [n for n, job in jobs(SMALL).items() if job.kind != "train"]
    assert again(tmp_path) == ["report"]


def replicas(folder: Path) -> set[int]:
    """What the evaluations at their places were asked for."""
    found = folder.glob("runs/*/evaluation/*/summary.json")
    return {json.loads(path.read_text())["asked"]["replicas"] for path in found}


def test_evaluations_of_several_files_do_not_get_mixed_up(tmp_path: Path) -> None:
    a, b = SMALL, SMALL.replace("replicas: 2", "replicas: 7")
    c = b + "set: {rewards.height: 0.4}\n"
    for text, count in ((a, 2), (b, 7), (c, 7), (a, 2), (c, 7), (b, 7), (a, 2)):
        began = again(tmp_path, text)
        assert replicas(tmp_path) == {count}
    assert began == ["report"]
    assert not list(tmp_path.glob("aside/*unknown*"))


def test_an_evaluation_in_the_way_of_one_that_comes_back_makes_room(tmp_path: Path) -> None:
    b = SMALL.replace("replicas: 2", "replicas: 7")
    again(tmp_path)
    again(tmp_path, b)
    # As if a call had been killed between its moves and its note of them.
    record = (tmp_path / "study.json").read_text()
    again(tmp_path)
    (tmp_path / "study.json").write_text(record)
    assert again(tmp_path, b) == []
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
        again(tmp_path, text)
    real, count = os.rename, iter(range(1, 100))

    def rename(source: Path, target: Path) -> None:
        if next(count) == moves:
            raise Killed
        real(source, target)

    monkeypatch.setattr(os, "rename", rename)
    with contextlib.suppress(Killed):
        again(tmp_path, a)
    monkeypatch.undo()
    for text in (a, b):
        again(tmp_path, text)
        opened = store(tmp_path, text)
        assert all(job.complete(tmp_path) for job in opened.jobs.values())


def test_the_run_of_fewer_iterations_is_not_gone_on_with_where_the_longer_is_kept(
    tmp_path: Path,
) -> None:
    longer = SMALL.replace("push: 2", "push: 5")
    for text in (longer, SMALL, longer):
        began = again(tmp_path, text)
    assert began == ["report"]
    assert again(tmp_path) == ["report"]


def test_more_iterations_continue_a_run_and_fewer_start_another(tmp_path: Path) -> None:
    again(tmp_path)
    later = [name for name in jobs(SMALL) if "push" in name or name == "report"]
    for count, kept in ((5, True), (1, False)):
        assert again(tmp_path, SMALL.replace("push: 2", f"push: {count}")) == later
        assert (tmp_path / "runs/bear-push-0/model_2.pt").exists() == kept


def test_designs_that_leave_the_study_are_put_aside_and_others_stay(tmp_path: Path) -> None:
    again(tmp_path)
    assert again(tmp_path, SMALL.replace("[cheetah, bear]", "[bear]"), "bear") == ["report"]
    assert {path.name for path in (tmp_path / "runs").iterdir()} == {"bear-base-0", "bear-push-0"}


def test_an_evaluation_that_is_not_the_studys_is_put_aside(tmp_path: Path) -> None:
    with pytest.raises(Killed):
        go(tmp_path, dying("cheetah-base-0-nominal", lambda _: None))
    # As 'draft evaluate' by hand leaves it, with whatever options.
    asked = request_of(jobs(SMALL)["cheetah-base-0-perturbed"], tmp_path)
    write_output(asked.model_copy(update={"levels": None, "replicas": 256}))
    assert again(tmp_path) == list(jobs(SMALL))[1:]
    assert (tmp_path / "aside/cheetah-base-0-perturbed-unknown/summary.json").exists()


RECORD = '{"format": %d, "name": "%s", "toy": %s, "jobs": %s}'
BROKEN = ("[]", '{"a": 1}')


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("mine.txt", "mine", r"holds no study, but mine.txt"),
        *(
            ("study.json", text, "cannot be read as a study")
            for text in ("{", "[]", "{}", *(RECORD % (1, "a", "false", x) for x in BROKEN))
        ),
        ("study.json", RECORD % (9, "small", "false", "{}"), "another version of Draft"),
        (
            "study.json",
            RECORD % (1, "small", "true", "{}"),
            "is of the toy of study 'small'",
        ),
        ("study.json", RECORD % (1, "other", "false", "{}"), "is of study 'other'; it is kept"),
    ],
)
def test_a_folder_that_is_not_the_studys_is_kept(
    tmp_path: Path, file: str, text: str, words: str
) -> None:
    (tmp_path / file).write_text(text)
    with pytest.raises(DraftError, match=words):
        store(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [file]
    assert (tmp_path / file).read_text() == text


def test_a_file_where_the_folder_should_be_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DraftError, match="cannot read"):
        store(tmp_path / "file")
    with pytest.raises(DraftError, match=r"cannot (read|write)"):
        store(tmp_path / "file/study").open()


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
    first = Fake()
    with pytest.raises(DraftError, match="no space left on device"):
        go(tmp_path, first)
    monkeypatch.undo()
    monkeypatch.setattr(module, "_POLL", 0.0)
    began = first.began + again(tmp_path)
    assert math.isclose(len(began), len(jobs(SMALL)), abs_tol=1)
