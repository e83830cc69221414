"""Doing a study: what fails, what is killed, what goes on, and what changed in between."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from draft.errors import DraftError
from draft.files import lock, locked
from draft.learn.study import execution as module
from draft.learn.study.execution import Execution
from draft.learn.study.store import BEGUN, DONE, FAILED, SKIPPED, WAITING
from tests.learn.study.small import TEXT, Fake, Killed, after, go, jobs, store, write_output

SMALL = TEXT.replace("seeds: 2", "seeds: 1")


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_POLL", 0.0)


def states(folder: Path) -> dict[str, str]:
    return {n: job["state"] for n, job in told(folder)["jobs"].items()}


def told(folder: Path) -> dict:
    return json.loads((folder / "study.json").read_text())


def dying(name: str, how: Callable[[Sequence[str]], None]) -> Fake:
    """A worker during whose job the study is killed."""

    def act(job: str, arguments: Sequence[str]) -> None:
        if job == name:
            how(arguments)
            raise Killed

    return Fake(act)


def test_all_jobs_are_done_in_order_and_then_none(tmp_path: Path) -> None:
    first, second = Fake(), Fake()
    go(tmp_path, first, SMALL)
    assert first.began == list(jobs(SMALL))
    assert set(states(tmp_path).values()) == {DONE}
    assert (tmp_path / "study.yaml").read_text() == SMALL
    go(tmp_path, second, SMALL)
    assert second.began == []


@pytest.mark.parametrize("name", jobs(SMALL))
@pytest.mark.parametrize("when", ["at its start", "half way", "at its end"])
def test_a_study_that_is_killed_goes_on_and_loses_nothing(
    tmp_path: Path, name: str, when: str
) -> None:
    def how(arguments: Sequence[str]) -> None:
        if when == "at its end":
            write_output(arguments)
        elif when == "half way" and arguments[0] == "train":
            write_output(arguments, done=1)

    first, second = dying(name, how), Fake()
    with pytest.raises(Killed):
        go(tmp_path, first, SMALL)
    order = list(jobs(SMALL))
    assert first.began == order[: order.index(name) + 1]
    go(tmp_path, second, SMALL)
    at = order.index(name) + (when == "at its end" and name != "report")
    assert second.began == order[at:]
    assert set(states(tmp_path).values()) == {DONE}


def test_a_job_that_fails_is_told_its_dependants_are_skipped_and_others_go_on(
    tmp_path: Path,
) -> None:
    failing = Fake(lambda name, _: 2 if name == "cheetah-base-0" else None)
    execution = go(tmp_path, failing, SMALL)
    found = states(tmp_path)
    assert found.pop("cheetah-base-0") == FAILED
    assert found.pop("report") == WAITING
    assert {name for name, state in found.items() if state == SKIPPED} == {
        name for name in found if name.startswith("cheetah")
    }
    assert {state for name, state in found.items() if name.startswith("bear")} == {DONE}
    log = tmp_path / "logs/cheetah-base-0.log"
    why = execution.failures["cheetah-base-0"]
    assert why == f"exit code 2; {log} ends with\n    cheetah-base-0 says this"
    # The report is of what there is, and is written again when the rest is done.
    assert "report" in failing.began
    again = Fake()
    go(tmp_path, again, SMALL)
    cheetahs = [name for name in jobs(SMALL) if name.startswith("cheetah")]
    assert again.began == [*cheetahs, "report"]


def test_without_anything_to_report_on_there_is_no_report(tmp_path: Path) -> None:
    failing = Fake(lambda name, _: 2 if "base" in name else None)
    execution = go(tmp_path, failing, SMALL)
    assert failing.began == ["cheetah-base-0", "bear-base-0"]
    assert states(tmp_path)["report"] == WAITING
    assert len(execution.failures) == 2


def test_a_report_is_written_again_when_what_it_tells_is_done_again(tmp_path: Path) -> None:
    go(tmp_path, Fake(), SMALL)
    (tmp_path / "runs/bear-push-0/evaluation/nominal-walking/summary.json").unlink()
    again = Fake()
    go(tmp_path, again, SMALL)
    assert again.began == ["bear-push-0-nominal", "report"]
    # As a call that was killed between both would leave it.
    late = tmp_path / "report/index.html"
    os.utime(late, ns=(0, 0))
    again = Fake()
    go(tmp_path, again, SMALL)
    assert again.began == ["report"]


def test_a_study_that_lost_its_study_json_knows_its_outputs_by_what_they_hold(
    tmp_path: Path,
) -> None:
    go(tmp_path, Fake(), SMALL)
    (tmp_path / "study.json").unlink()
    again = Fake()
    go(tmp_path, again, SMALL)
    assert again.began == ["report"]
    assert set(states(tmp_path).values()) == {DONE}


def test_a_job_whose_process_dies_is_tried_once_more(tmp_path: Path) -> None:
    deaths = iter([-9, None])
    once = Fake(lambda name, _: next(deaths) if name == "bear-base-0" else None)
    go(tmp_path / "once", once, SMALL)
    assert once.began.count("bear-base-0") == 2
    assert set(states(tmp_path / "once").values()) == {DONE}
    execution = go(tmp_path / "twice", Fake(lambda n, _: -9 if n == "bear-base-0" else None), SMALL)
    assert "was ended by SIGKILL" in execution.failures["bear-base-0"]


@pytest.mark.parametrize("seconds", [module._PATIENCE / 2, module._PATIENCE * 2])
def test_a_run_that_a_dying_process_has_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float
) -> None:
    with pytest.raises(Killed):
        go(tmp_path, dying("cheetah-base-0", lambda words: write_output(words, done=1)), SMALL)
    held = lock(tmp_path / "runs/cheetah-base-0", "draft train")
    now = [0.0]

    def pause(_: float) -> None:
        now[0] += 1.0
        if now[0] >= seconds:
            held.close()

    def act(name: str, arguments: Sequence[str]) -> int | None:
        taken = name == "cheetah-base-0" and locked(Path(after(arguments, "--out")))
        return 2 if taken else None

    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(module.time, "sleep", pause)
    again = Fake(act)
    execution = go(tmp_path, again, SMALL)
    held.close()
    # Others do not wait for it.
    assert again.began[0] == "bear-base-0"
    if seconds < module._PATIENCE:
        assert not execution.failures
        assert set(states(tmp_path).values()) == {DONE}
    else:
        assert execution.failures.keys() == {"cheetah-base-0"}


def test_a_process_that_dies_after_its_work_was_done_has_done_it(tmp_path: Path) -> None:
    def act(name: str, arguments: Sequence[str]) -> int | None:
        write_output(arguments)
        return -9

    dead = Fake(act)
    assert not go(tmp_path, dead, SMALL).failures
    assert dead.began == list(jobs(SMALL))


def test_a_command_that_ends_well_without_its_output_has_failed(tmp_path: Path) -> None:
    execution = go(tmp_path, Fake(lambda name, _: 0 if name == "bear-push-0" else None), SMALL)
    assert "ended well, but" in execution.failures["bear-push-0"]


def test_training_is_sliced_and_told_how_long_it_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module.time, "monotonic", lambda: 1000.0)

    def act(name: str, arguments: Sequence[str]) -> int | None:
        if name == "bear-base-0":
            write_output(arguments, done=1)
            return 0
        return None

    sliced = Fake(act)
    go(tmp_path, sliced, SMALL, until=1000.0 + 135.0)
    assert after(sliced.commands["cheetah-base-0"], "--minutes") == "2.000"
    assert states(tmp_path)["bear-base-0"] == BEGUN
    assert states(tmp_path)["bear-push-0"] == WAITING
    whole = Fake()
    go(tmp_path, whole, SMALL)
    assert whole.began[0] == "bear-base-0"
    assert "--minutes" not in whole.commands["bear-base-0"]
    assert set(states(tmp_path).values()) == {DONE}


def test_nothing_begins_that_would_not_end_in_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])

    def act(name: str, arguments: Sequence[str]) -> int | None:
        now[0] += 100.0 if arguments[0] == "evaluate" else 1.0
        return None

    late = Fake(act)
    # 1 s of training, 100 s of evaluation; then 100 s are left, too few for another.
    go(tmp_path, late, SMALL, until=201.0)
    assert late.began == ["cheetah-base-0", "cheetah-base-0-nominal", "cheetah-push-0",
                          "cheetah-push-0-nominal"]  # fmt: skip
    nothing = Fake(act)
    go(tmp_path, nothing, SMALL, until=now[0] + module.LEAST)
    assert nothing.began == []


@pytest.mark.parametrize("until", [math.inf, 10.0**9])
def test_a_design_that_changes_while_the_study_runs_is_told(tmp_path: Path, until: float) -> None:
    def act(name: str, arguments: Sequence[str]) -> int | None:
        if name == "cheetah-base-0":  # As if the file named so were another's by now.
            write_output([arguments[0], "giraffe", *arguments[2:]])
            return 0
        return None

    execution = go(tmp_path, Fake(act), SMALL, until=until)
    words = "design 'cheetah' was changed while the study ran; repeat the command"
    assert execution.failures["cheetah-base-0"].startswith(words)
    assert states(tmp_path)["cheetah-base-0-nominal"] == SKIPPED
    # With the design as it was, the run of the other is kept, and not gone on with.
    again = Fake()
    go(tmp_path, again, SMALL)
    assert again.began[0] == "cheetah-base-0"
    assert set(states(tmp_path).values()) == {DONE}
    assert (tmp_path / "aside/cheetah-base-0-unknown/run.json").exists()


def test_what_is_evaluated_by_hand_into_a_study_does_not_count(tmp_path: Path) -> None:
    go(tmp_path, Fake(), SMALL)
    command = jobs(SMALL)["bear-push-0-nominal"].command(tmp_path, "cpu", None)
    write_output([*command[:4], "--replicas", "8"])
    again = Fake()
    go(tmp_path, again, SMALL)
    assert again.began[0] == "bear-push-0-nominal"
    assert set(states(tmp_path).values()) == {DONE}


def test_an_evaluation_that_takes_most_of_a_slice_begins_with_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])

    def act(name: str, arguments: Sequence[str]) -> int | None:
        now[0] += 405.0 if arguments[0] == "evaluate" else 20.0
        return None

    began: list[str] = []
    for _ in range(10):
        worker = Fake(act)
        execution = go(tmp_path, worker, SMALL, until=now[0] + 480.0)
        assert execution.lacking() == 0.0
        began += worker.began
    assert sorted(began) == sorted(jobs(SMALL))


def test_what_an_evaluation_took_is_its_last_attempt_and_training_all_its_slices(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, tries = [0.0], iter([-9, None])
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])

    def act(name: str, arguments: Sequence[str]) -> int | None:
        now[0] += 7.0
        if name == "cheetah-base-0" and now[0] < 10.0:
            write_output(arguments, done=1)
            return -9
        return next(tries) if name == "cheetah-base-0-nominal" else None

    go(tmp_path, Fake(act), SMALL)
    found = told(tmp_path)["jobs"]
    assert found["cheetah-base-0"]["seconds"] == 14.0
    assert found["cheetah-base-0-nominal"]["seconds"] == 7.0


@pytest.mark.parametrize(("given", "lacking"), [(20.0, 25.0), (60.0, 60.0)])
def test_a_slice_too_short_for_anything_says_by_how_much(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: float, lacking: float
) -> None:
    monkeypatch.setattr(module.time, "monotonic", lambda: 0.0)

    def act(name: str, arguments: Sequence[str]) -> int | None:
        write_output(arguments, done=0)  # It had time to load, and no more.
        return 0

    worker = Fake(act)
    execution = go(tmp_path, worker, SMALL, until=given)
    assert bool(worker.began) == (given > module.LEAST)
    assert execution.lacking() == lacking


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
    execution = go(tmp_path, endless, SMALL, until=200.0)
    assert endless.stopped >= 1
    assert execution.late[0] == "cheetah-base-0-nominal"
    assert execution.lacking() == 0.0  # The training was done.
    assert states(tmp_path)["cheetah-base-0-nominal"] == WAITING
    assert not execution.failures


def test_two_workers_share_the_jobs(tmp_path: Path) -> None:
    opened = store(tmp_path, SMALL)
    opened.open()
    one, other = Fake(), Fake()
    assert Execution(opened, [one, other]).run()
    opened.close()
    assert sorted(one.began + other.began) == sorted(jobs(SMALL))
    assert one.began[0] == "cheetah-base-0"
    assert other.began[0] == "bear-base-0"


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


def test_more_iterations_go_on_with_a_run_and_fewer_begin_another(tmp_path: Path) -> None:
    go(tmp_path, Fake(), SMALL)
    more, fewer = Fake(), Fake()
    go(tmp_path, more, SMALL.replace("push: 2", "push: 5"))
    assert more.began == [name for name in jobs(SMALL) if "push" in name or name == "report"]
    assert (tmp_path / "runs/bear-push-0/model_2.pt").exists()
    assert "--from" not in more.commands["bear-push-0"]
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
    write_output(["evaluate", str(tmp_path / "runs/cheetah-base-0"), "--perturbed"])
    later = Fake()
    go(tmp_path, later, SMALL)
    assert later.began == list(jobs(SMALL))[1:]
    assert (tmp_path / "aside/cheetah-base-0-perturbed-unknown/summary.json").exists()


def test_a_folder_with_something_else_is_kept(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(DraftError, match=r"holds something else than a study \(mine.txt\)"):
        store(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_file_where_the_folder_should_be_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DraftError, match="cannot read"):
        store(tmp_path / "file")
    with pytest.raises(DraftError, match=r"cannot (read|write)"):
        store(tmp_path / "file/study").open()


BROKEN = '{"format": 1, "name": "a", "toy": false, "jobs": %s}'


@pytest.mark.parametrize("text", ["{", "[]", "{}", BROKEN % "[]", BROKEN % '{"a": 1}'])
def test_a_broken_study_is_told(tmp_path: Path, text: str) -> None:
    (tmp_path / "study.json").write_text(text)
    with pytest.raises(DraftError, match="cannot be read as a study"):
        store(tmp_path)


def test_a_study_of_another_format_is_told(tmp_path: Path) -> None:
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
    with pytest.raises(DraftError, match=r"another 'draft study' is at work .* \(process \d+\)"):
        store(tmp_path).open()
    one.close()
    other = store(tmp_path)
    other.open()
    other.close()


def test_a_disk_that_is_full_ends_the_study_and_it_goes_on(
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
