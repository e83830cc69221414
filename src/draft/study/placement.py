"""Placement of the jobs of a study: GPUs, the CPU, or a Ray cluster."""

from __future__ import annotations

from collections.abc import Sequence

from draft.errors import DraftError
from draft.explore.engines import RayEngine
from draft.extras import need
from draft.learn.engine.machine import devices, this_machine, visible
from draft.study.capacity import Capacity, on_cpu, on_gpus
from draft.study.file import Study
from draft.study.options import Placement
from draft.study.workers import LocalWorker, RayWorker, Worker


def expected_capacity(study: Study, placement: Placement) -> Capacity | None:
    """Capacity that an estimate assumes, found without starting anything.

    A GPU that is named need not exist here.

    Returns:
        The capacity; None if nothing on this machine could run the jobs.

    Raises:
        DraftError: the engine or the processes do not fit the device.
    """
    device, engine, replicas = placement.device, placement.engine, placement.replicas
    if device == "auto" and not placement.ray:
        here = this_machine()
        if here.engine is None:
            return None
        device = "cpu" if here.on_cpu else "all"
    if device == "cpu":
        return on_cpu(study, engine, replicas, placement.workers, cluster=placement.ray)
    return on_gpus(engine, replicas, placement.workers)


def make_workers(study: Study, placement: Placement) -> Sequence[Worker]:
    """Workers for the jobs of a study; none has started yet.

    Raises:
        DraftError: there is no such device or cluster, the engine does not run there, or PyTorch
            or Ray is not installed.
    """
    if placement.ray:
        return _cluster_workers(study, placement)
    chosen = _devices(placement.device)
    engine, replicas, workers = placement.engine, placement.replicas, placement.workers
    if chosen == ["cpu"]:
        capacity = on_cpu(study, engine, replicas, workers)
        return [LocalWorker("cpu", physics=capacity.physics) for _ in range(capacity.at_once or 1)]
    capacity, gpus = on_gpus(engine, replicas, workers), visible(chosen)
    return [
        LocalWorker("cuda", gpus[k % len(gpus)], physics=capacity.physics)
        for k in range(workers or len(gpus))
    ]


def _cluster_workers(study: Study, placement: Placement) -> Sequence[Worker]:
    """Workers that run jobs as tasks of a Ray cluster."""
    engine, replicas, workers = placement.engine, placement.replicas, placement.workers
    ray = need("ray", "cluster")
    RayEngine(placement.address).join(ray)
    resources = ray.cluster_resources()
    if placement.device == "cpu":
        capacity = on_cpu(study, engine, replicas, workers, cluster=True)
        count = workers or max(1, int(resources.get("CPU", 1)) // capacity.processes)
        return [RayWorker(ray, 0, capacity.physics) for _ in range(count)]
    gpus = int(resources.get("GPU", 0))
    if not gpus:
        cause = "the Ray cluster has no GPU"
        raise DraftError(cause, 'add a node that has one, or pass `device="cpu"`')
    capacity = on_gpus(engine, replicas, workers)
    return [RayWorker(ray, 1, capacity.physics) for _ in range(workers or gpus)]


def _devices(word: str) -> list[str]:
    """Devices of the argument `device`; "auto" is all GPUs, unlike for a single training."""
    torch = need("torch", "learn")
    if word == "auto":
        word = "all" if torch.cuda.is_available() else "cpu"
    return devices(word)
