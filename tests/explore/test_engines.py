"""Engines: every task once, whoever dies on the way."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from draft.errors import DraftError, Problem
from draft.explore.engines import LocalEngine, RayEngine


@dataclass(frozen=True)
class Doubles:
    """Work that ends its own process at some tasks, each a number of times."""

    folder: Path
    deadly: tuple[int, ...] = ()
    lives: int = 1
    wrong: int = -1

    def __call__(self, task: int) -> int:
        if task == self.wrong:
            raise DraftError(Problem(f"task {task} is wrong"))
        deaths = len(list(self.folder.glob(f"{task}-*")))
        if task in self.deadly and deaths < self.lives:
            (self.folder / f"{task}-{deaths}").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return 2 * task


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_every_task_is_done_once(tmp_path: Path, workers: int) -> None:
    for count in (20, 0):
        found = list(LocalEngine(workers).run(range(count), Doubles(tmp_path)))
        assert sorted(found) == [(task, 2 * task) for task in range(count)]


def test_a_worker_that_dies_is_replaced_and_its_task_done_again(tmp_path: Path) -> None:
    found = list(LocalEngine(2).run(range(12), Doubles(tmp_path, deadly=(0, 7))))
    assert sorted(found) == [(task, 2 * task) for task in range(12)]
    assert len(list(tmp_path.iterdir())) == 2


def test_a_task_that_kills_every_worker_is_given_up(tmp_path: Path) -> None:
    work = Doubles(tmp_path, deadly=(0,), lives=99)
    with pytest.raises(DraftError, match="a worker process died 3 times in a row"):
        list(LocalEngine(2).run([0], work))


@pytest.mark.parametrize("workers", [1, 2])
def test_what_the_work_says_is_wrong_comes_through(tmp_path: Path, workers: int) -> None:
    with pytest.raises(DraftError, match="task 3 is wrong"):
        list(LocalEngine(workers).run(range(9), Doubles(tmp_path, wrong=3)))


def test_tasks_are_read_only_as_far_ahead_as_there_are_workers(tmp_path: Path) -> None:
    read: list[int] = []

    def tasks() -> Iterator[int]:
        for task in range(1000):
            read.append(task)
            yield task

    results = LocalEngine(2).run(tasks(), Doubles(tmp_path))
    next(results)
    assert len(read) <= 4
    results.close()  # type: ignore[attr-defined]


def test_a_ray_cluster_that_is_not_there_is_said(tmp_path: Path) -> None:
    pytest.importorskip("ray")
    with pytest.raises(DraftError, match="no Ray cluster answers"):
        list(RayEngine("127.0.0.1:1").run([1], Doubles(tmp_path)))
