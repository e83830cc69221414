"""How many jobs of a study are done at once, and with how many processes each."""

from __future__ import annotations

from dataclasses import dataclass

from draft.errors import DraftError, Problem
from draft.learn.engine import NATIVE, Engine, choose, cores
from draft.learn.engine import replicas as check_replicas
from draft.study.file import Study
from draft.study.jobs import Physics

_MOST = 4  # jobs at once on a CPU: a process of PyTorch and mjlab takes some 2 GB.


@dataclass(frozen=True)
class Hands:
    """What does the jobs of a study.

    Attributes:
        engine: what steps the worlds.
        on_cpu: without a GPU.
        processes: of each training.
        at_once: jobs; None for one per GPU.
        physics: what the requests say.
    """

    engine: Engine
    on_cpu: bool
    processes: int
    at_once: int | None
    physics: Physics


def on_gpus(engine: str, replicas: int | None, workers: int | None) -> Hands:
    """Jobs on GPUs, each on one.

    Args:
        engine: as `--engine` takes it.
        replicas: as `--replicas` takes it; a job on a GPU is one process.
        workers: jobs at once; None for one per GPU.

    Raises:
        DraftError: the engine does not run there, or several processes are asked for.
    """
    chosen = choose(engine, ["cuda"])
    check_replicas(replicas, 1, chosen, ["cuda"])
    return Hands(chosen, False, 1, workers, Physics(engine))


def on_cpu(
    study: Study, engine: str, replicas: int | None, workers: int | None, alone: bool = True
) -> Hands:
    """Jobs on a CPU: one at a time with a process per core, where processes share a run well.

    Toys and MuJoCo Warp take one process for each, and do several at once.

    Args:
        study: the study.
        engine: as `--engine` takes it.
        replicas: processes of each training; None to choose.
        workers: jobs at once; None for as many as there are cores for, at most 4.
        alone: on this machine; jobs of a cluster take one process each, wherever they are.

    Raises:
        DraftError: the engine cannot be used, or there are fewer cores or worlds than processes.
    """
    chosen = choose(engine, ["cpu"])
    most, processes = cores(), 1
    if replicas is not None:
        processes = replicas
        if alone:
            check_replicas(replicas, replicas, chosen, ["cpu"])
        if not 0 < replicas <= study.environments:
            cause = f"--replicas {replicas}: a training has {study.environments} worlds to share"
            raise DraftError(Problem(cause, None, f"choose 1 to {study.environments}"))
    elif chosen.name == NATIVE and not study.toy and alone:
        processes = max(1, min(most // (workers or 1), study.environments))
    at_once = workers
    if at_once is None and alone:
        at_once = max(1, min(most // processes, _MOST))
    return Hands(chosen, True, processes, at_once, Physics(engine, processes))
