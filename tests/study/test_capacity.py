"""How many jobs are done at once, and how many processes each training has."""

from __future__ import annotations

import pytest

from draft.errors import DraftError
from draft.learn.engine import machine
from draft.study import capacity as module
from draft.study.capacity import on_cpu, on_gpus
from draft.study.jobs import Physics
from tests.study.small import TEXT, study

LARGE = TEXT.replace("environments: 4", "environments: 64")


@pytest.fixture(autouse=True)
def eight_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    for place in (module, machine):
        monkeypatch.setattr(place, "cores", lambda: 8)
    monkeypatch.setattr(machine, "obstacle", lambda: None)


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
    word: str, replicas: int | None, workers: int | None, processes: int, at_once: int
) -> None:
    found = on_cpu(study(LARGE), word, replicas, workers)
    assert (found.processes, found.at_once) == (processes, at_once)
    assert found.physics == Physics(word, processes)
    assert found.on_cpu


def test_small_things_take_a_process_each() -> None:
    assert on_cpu(study(TEXT), "auto", None, None).processes == 4  # worlds
    toy = on_cpu(study(LARGE, toy=True), "auto", None, None)
    assert (toy.processes, toy.at_once) == (1, 4)


def test_jobs_of_a_cluster_know_nothing_of_this_machines_cores() -> None:
    found = on_cpu(study(LARGE), "auto", None, None, cluster=True)
    assert (found.processes, found.at_once) == (1, None)
    assert on_cpu(study(LARGE), "auto", 16, 5, cluster=True).processes == 16


def test_a_gpu_has_one_process_and_mujoco_warp() -> None:
    found = on_gpus("auto", None, None)
    assert (found.engine.name, found.on_cpu, found.at_once) == ("warp", False, None)
    assert found.physics == Physics("auto", None)


def test_what_does_not_fit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DraftError, match="`replicas` 9: this machine has 8 physical cores"):
        on_cpu(study(LARGE), "auto", 9, None)
    with pytest.raises(DraftError, match="`replicas` 5: a training has 4 worlds to share"):
        on_cpu(study(TEXT), "auto", 5, None)
    with pytest.raises(DraftError, match="`replicas` 0: "):
        on_cpu(study(TEXT), "auto", 0, None, cluster=True)
    with pytest.raises(DraftError, match="`replicas` 2 is for a CPU"):
        on_gpus("auto", 2, None)
    with pytest.raises(DraftError, match='`engine="native"` runs on the CPU, not on cuda'):
        on_gpus("native", None, None)
    monkeypatch.setattr(machine, "obstacle", lambda: "it is not installed")
    with pytest.raises(DraftError, match='`engine="native"`: it is not installed'):
        on_cpu(study(LARGE), "native", None, None)
    found = on_cpu(study(LARGE), "auto", None, None)
    assert (found.engine.name, found.processes, found.at_once) == ("warp", 1, 4)
