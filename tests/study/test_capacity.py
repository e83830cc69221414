"""How many jobs are done at once, and how many processes each training has."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from draft.errors import DraftError
from draft.learn.engine import machine
from draft.learn.engine.machine import EngineName
from draft.study.capacity import on_cpu, on_gpus
from draft.study.jobs import Physics
from tests.study.small import LARGE, TEXT, machine_of, study


@pytest.fixture(autouse=True)
def eight_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    machine_of(8, monkeypatch)


@pytest.mark.parametrize(
    ("word", "replicas", "workers", "processes", "at_once"),
    [
        ("auto", None, None, 8, 1),
        ("native", None, None, 8, 1),
        ("auto", None, 2, 4, 2),
        ("auto", None, 3, 2, 3),
        ("auto", None, 99, 1, 99),
        ("auto", 4, None, 4, 2),
        ("auto", 3, None, 3, 2),
        ("auto", 1, None, 1, 4),
        ("auto", 8, 2, 8, 2),
        ("warp", None, None, 1, 4),
        ("warp", 4, None, 4, 2),
    ],
)
def test_jobs_do_not_fight_for_cores(
    word: EngineName, replicas: int | None, workers: int | None, processes: int, at_once: int
) -> None:
    found = on_cpu(study(LARGE), word, replicas, workers)
    assert (found.processes, found.at_once) == (processes, at_once)
    assert found.physics == Physics(word, processes)
    assert found.on_cpu


def test_small_things_take_a_process_each_and_clusters_have_cores_of_their_own() -> None:
    toy, large = study(LARGE, toy=True), study(LARGE)
    for found, expected in (
        (on_cpu(study(TEXT), "auto", None, None), (4, 2)),  # worlds
        (on_cpu(toy, "auto", None, None), (1, 4)),
        (on_cpu(large, "auto", None, None, cluster=True), (1, None)),
        (on_cpu(large, "auto", 16, 5, cluster=True), (16, 5)),
    ):
        assert (found.processes, found.at_once) == expected


def test_a_gpu_has_one_process_and_mujoco_warp() -> None:
    found = on_gpus("auto", None, None)
    assert (found.engine.name, found.on_cpu, found.at_once) == ("warp", False, None)
    assert found.physics == Physics("auto", None)


def test_without_native_mujoco_a_cpu_has_mujoco_warp(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "obstacle", lambda: "it is not installed")
    with pytest.raises(DraftError, match='`engine="native"`: it is not installed'):
        on_cpu(study(LARGE), "native", None, None)
    found = on_cpu(study(LARGE), "auto", None, None)
    assert (found.engine.name, found.processes, found.at_once) == ("warp", 1, 4)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: on_cpu(study(LARGE), "auto", 9, None), "9: this machine has 8 physical cores"),
        (lambda: on_cpu(study(TEXT), "auto", 5, None), "5: a training has 4 worlds to share"),
        (lambda: on_cpu(study(TEXT), "auto", 0, None, cluster=True), "`replicas` 0: "),
        (lambda: on_gpus("auto", 2, None), "`replicas` 2 is for a CPU"),
        (lambda: on_gpus("native", None, None), '`engine="native"` runs on the CPU, not on cuda'),
    ],
)
def test_what_does_not_fit_is_refused(ask: Callable[[], object], words: str) -> None:
    with pytest.raises(DraftError, match=words):
        ask()
