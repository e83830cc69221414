"""Number of jobs that a study runs at once, and of processes for each."""

from __future__ import annotations

from dataclasses import dataclass

from draft.errors import DraftError, counted
from draft.learn.engine.machine import NATIVE, Engine, choose, cores
from draft.learn.engine.machine import replicas as check_replicas
from draft.study.file import Study
from draft.study.jobs import Physics

_MOST = 4  # Jobs at once on a CPU: each process of PyTorch and mjlab takes about 2 GB.


@dataclass(frozen=True)
class Capacity:
    """Processes and devices that run the jobs of a study.

    Attributes:
        engine: physics engine.
        on_cpu: whether no GPU is used.
        processes: processes of each training.
        at_once: number of jobs at once; None for one per GPU.
        physics: engine and processes as requests name them.
    """

    engine: Engine
    on_cpu: bool
    processes: int
    at_once: int | None
    physics: Physics


def on_gpus(engine: str, replicas: int | None, workers: int | None) -> Capacity:
    """Capacity of GPUs; each job uses one.

    Args:
        engine: "auto", "native" or "warp".
        replicas: processes of each training; a job on a GPU is one process.
        workers: number of jobs at once; None for one per GPU.

    Raises:
        DraftError: the engine does not run on a GPU, or several processes are asked for.
    """
    chosen = choose(engine, ["cuda"])
    check_replicas(replicas, 1, chosen, ["cuda"])
    return Capacity(chosen, False, 1, workers, Physics(engine))


def on_cpu(
    study: Study, engine: str, replicas: int | None, workers: int | None, cluster: bool = False
) -> Capacity:
    """Capacity of a CPU.

    On native MuJoCo one job runs at a time, with a process per core. Toy studies and MuJoCo Warp
    use one process per job, and run several jobs at once.

    Args:
        study: the study.
        engine: "auto", "native" or "warp".
        replicas: processes of each training; None to choose.
        workers: number of jobs at once; None for as many as there are cores for, at most 4.
        cluster: whether jobs run on the nodes of a cluster, with one process each by default.

    Raises:
        DraftError: the engine cannot be used, or there are fewer cores or worlds than processes.
    """
    chosen = choose(engine, ["cpu"])
    most, processes = cores(), 1
    if replicas is not None:
        processes = replicas
        if not cluster:
            check_replicas(replicas, replicas, chosen, ["cpu"])
        if not 0 < replicas <= study.environments:
            worlds = counted(study.environments, "world")
            cause = f"`replicas` {replicas}: a training has {worlds} to share"
            raise DraftError(cause, f"choose 1 to {study.environments}")
    elif chosen.name == NATIVE and not study.toy and not cluster:
        processes = max(1, min(most // (workers or 1), study.environments))
    at_once = workers
    if at_once is None and not cluster:
        at_once = max(1, min(most // processes, _MOST))
    return Capacity(chosen, True, processes, at_once, Physics(engine, processes))
