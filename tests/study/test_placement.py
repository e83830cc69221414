"""Workers of a study: how many, on which device, with which engine and processes."""

from __future__ import annotations

import types
from typing import Any

import pytest

from draft.errors import DraftError
from draft.learn.engine import machine
from draft.learn.engine.machine import Machine
from draft.study import capacity
from draft.study import placement as module
from draft.study.jobs import Physics
from draft.study.options import Placement
from draft.study.placement import expected_capacity, make_workers
from draft.study.workers import LocalWorker, RayWorker
from tests.study.small import TEXT, study

LARGE = TEXT.replace("environments: 4", "environments: 64")


@pytest.fixture(autouse=True)
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine of two cores without a GPU, where native MuJoCo can be used."""
    for place in (capacity, machine):
        monkeypatch.setattr(place, "cores", lambda: 2)
    monkeypatch.setattr(machine, "obstacle", lambda: None)
    cpu = Machine(["cpu"], machine.choose("auto", ["cpu"]), None, 2)
    monkeypatch.setattr(module, "this_machine", lambda: cpu)
    monkeypatch.setattr(module, "_devices", lambda word: ["cpu"])


@pytest.mark.parametrize(
    ("given", "toy", "expected"),
    [
        (Placement(), False, [Physics("auto", 2)]),
        (Placement(engine="warp"), False, [Physics("warp", 1)] * 2),
        (Placement(replicas=1), False, [Physics("auto", 1)] * 2),
        (Placement(workers=2, engine="native"), False, [Physics("native", 1)] * 2),
        (Placement(), True, [Physics("auto", 1)] * 2),
    ],
)
def test_workers_on_a_cpu_share_its_cores(
    given: Placement, toy: bool, expected: list[Physics]
) -> None:
    workers = make_workers(study(LARGE, toy), given)
    assert [worker.physics for worker in workers] == expected
    assert all(isinstance(worker, LocalWorker) for worker in workers)
    assert {worker.device for worker in workers} == {"cpu"}
    assumed = expected_capacity(study(LARGE, toy), given)
    assert assumed is not None
    assert (assumed.physics, assumed.at_once) == (expected[0], len(expected))


def test_each_gpu_has_a_worker_unless_more_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_devices", lambda word: ["cuda:0", "cuda:1"])
    for workers, count in ((None, 2), (3, 3)):
        found = make_workers(study(), Placement(workers=workers))
        assert [worker.physics for worker in found] == [Physics()] * count
        assert {worker.device for worker in found} == {"cuda"}
    with pytest.raises(DraftError, match="`replicas` 2 is for a CPU"):
        make_workers(study(), Placement(replicas=2))


def test_workers_take_the_gpus_that_this_process_sees(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "4,GPU-5")
    monkeypatch.setattr(module, "_devices", lambda word: ["cuda:0", "cuda:1"])
    workers = make_workers(study(), Placement(workers=3))
    names = [worker._gpu for worker in workers if isinstance(worker, LocalWorker)]
    assert names == ["4", "GPU-5", "4"]


def test_a_gpu_that_is_not_here_can_be_estimated_for() -> None:
    assumed = expected_capacity(study(), Placement(device="cuda:7"))
    assert assumed is not None
    assert (assumed.engine.name, assumed.on_cpu, assumed.at_once) == ("warp", False, None)


def test_where_nothing_can_be_learnt_no_capacity_is_expected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "this_machine", lambda: Machine(["cpu"], None, "torch", 2))
    assert expected_capacity(study(), Placement()) is None


class _Ray(types.ModuleType):
    """A cluster that only counts its resources."""

    def __init__(self, **resources: float) -> None:
        super().__init__("ray")
        self._resources = resources

    def is_initialized(self) -> bool:
        return True

    def cluster_resources(self) -> dict[str, float]:
        return self._resources

    def remote(self, function: Any) -> Any:
        return types.SimpleNamespace(options=lambda **options: options)


@pytest.mark.parametrize(
    ("resources", "given", "count", "device"),
    [
        ({"CPU": 5.0, "GPU": 3.0}, Placement(ray=True), 3, "cuda"),
        ({"CPU": 5.0, "GPU": 3.0}, Placement(ray=True, workers=2), 2, "cuda"),
        ({"CPU": 5.0}, Placement(device="cpu", ray=True), 5, "cpu"),
        ({"CPU": 5.0}, Placement(device="cpu", ray=True, replicas=2), 2, "cpu"),
    ],
)
def test_a_cluster_has_a_worker_per_gpu_or_per_group_of_cores(
    resources: dict[str, float],
    given: Placement,
    count: int,
    device: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "need", lambda name, extra: _Ray(**resources))
    workers = make_workers(study(), given)
    assert all(isinstance(worker, RayWorker) for worker in workers)
    assert [worker.device for worker in workers] == [device] * count


def test_a_cluster_without_a_gpu_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "need", lambda name, extra: _Ray(CPU=4.0))
    with pytest.raises(DraftError, match=r"no GPU\n.*`device=\"cpu\"`"):
        make_workers(study(), Placement(ray=True))


def test_options_out_of_range_are_refused() -> None:
    for workers in (0, 1025):
        with pytest.raises(
            DraftError, match=f"`workers` {workers} is not a whole number from 1 to 1024"
        ):
            Placement.of({"workers": workers})
    with pytest.raises(DraftError, match=r"`address` is for a Ray cluster\n.*`ray`"):
        Placement.of({"address": "here:1"})
    Placement.of({"workers": 2, "ray": True, "address": "here:1"})
