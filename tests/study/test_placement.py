"""Workers of a study: how many, on which device, with which engine and processes."""

from __future__ import annotations

import types
from typing import Any

import pytest

from draft.errors import DraftError
from draft.learn.engine.machine import Machine
from draft.study import placement as module
from draft.study.jobs import Physics
from draft.study.options import Placement
from draft.study.placement import expected_capacity, make_workers
from draft.study.workers import LocalWorker, RayWorker
from tests.study.small import LARGE, machine_of, study


@pytest.fixture(autouse=True)
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    machine_of(2, monkeypatch)


@pytest.mark.parametrize(
    ("given", "toy", "expected"),
    [
        (Placement(), False, [Physics("auto", 2)]),
        (Placement(engine="warp"), False, [Physics("warp", 1)] * 2),
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
    with pytest.raises(DraftError, match="`replicas`"):
        make_workers(study(), Placement(replicas=2))
    # Those that this process sees.
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "4,GPU-5")
    workers = make_workers(study(), Placement(workers=3))
    names = [worker._gpu for worker in workers if isinstance(worker, LocalWorker)]
    assert names == ["4", "GPU-5", "4"]


def test_a_machine_that_is_not_here_can_be_estimated_for(monkeypatch: pytest.MonkeyPatch) -> None:
    assumed = expected_capacity(study(), Placement(device="cuda:7"))
    assert assumed is not None
    assert (assumed.engine.name, assumed.on_cpu, assumed.at_once) == ("warp", False, None)
    # Where nothing can be learnt, no capacity is expected.
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
    ("resources", "given", "devices"),
    [
        ({"CPU": 5.0, "GPU": 3.0}, Placement(ray=True), ["cuda"] * 3),
        ({"CPU": 5.0, "GPU": 3.0}, Placement(ray=True, workers=2), ["cuda"] * 2),
        ({"CPU": 5.0}, Placement(device="cpu", ray=True), ["cpu"] * 5),
        ({"CPU": 5.0}, Placement(device="cpu", ray=True, replicas=2), ["cpu"] * 2),
    ],
)
def test_a_cluster_has_a_worker_per_gpu_or_per_group_of_cores(
    resources: dict[str, float],
    given: Placement,
    devices: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "need", lambda name, extra: _Ray(**resources))
    workers = make_workers(study(), given)
    assert all(isinstance(worker, RayWorker) for worker in workers)
    assert [worker.device for worker in workers] == devices


def test_a_cluster_without_a_gpu_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "need", lambda name, extra: _Ray(CPU=4.0))
    with pytest.raises(DraftError, match=r"no GPU\n.*`device=\"cpu\"`"):
        make_workers(study(), Placement(ray=True))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        *(
            ({"workers": n}, f"`workers` {n} is not a whole number from 1 to 1024")
            for n in (0, 1025)
        ),
        ({"address": "here:1"}, r"`address` is for a Ray cluster\n.*`ray`"),
    ],
)
def test_options_out_of_range_are_refused(given: dict[str, Any], words: str) -> None:
    Placement.of({"workers": 2, "ray": True, "address": "here:1"})
    with pytest.raises(DraftError, match=words):
        Placement.of(given)
