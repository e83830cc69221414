"""Which physics engine steps the worlds: native MuJoCo on a CPU, or MuJoCo Warp on a GPU."""

from __future__ import annotations

import importlib.util
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from typing import Literal

from draft.errors import DraftError, Problem

EngineName = Literal["auto", "native", "warp"]
NATIVE, WARP = "native", "warp"
_REMEDY = "use --engine warp, which runs anywhere and is some 15 times slower on a CPU"


@dataclass(frozen=True)
class Engine:
    """A physics engine and the reason for its choice.

    Attributes:
        name: "native" or "warp".
        why: reason, in words.
    """

    name: str
    why: str


def choose(word: str, devices: Sequence[str]) -> Engine:
    """Choose the engine for devices.

    Args:
        word: "auto", "native" or "warp". "auto" is native without CUDA, where mjbatch is usable.
        devices: as `draft.learn.devices.devices` names them.

    Raises:
        DraftError: native MuJoCo is asked for on a GPU, or cannot be used.
    """
    on_cpu = list(devices) == ["cpu"]
    if word == WARP:
        return Engine(WARP, "asked for")
    if word == "auto" and not on_cpu:
        return Engine(WARP, "it runs on the GPU")
    if not on_cpu:
        cause = f"--engine native runs on the CPU, not on {', '.join(devices)}"
        raise DraftError(Problem(cause, None, "add --device cpu, or use --engine warp"))
    missing = obstacle()
    if missing is None:
        return Engine(NATIVE, "asked for" if word == NATIVE else "the fastest without a GPU")
    if word == NATIVE:
        raise DraftError(Problem(f"--engine native: {missing}", None, _REMEDY))
    return Engine(WARP, f"native MuJoCo cannot be used: {missing}")


def obstacle() -> str | None:
    """Reason why native MuJoCo cannot be used; None if it can."""
    if importlib.util.find_spec("mjbatch") is None:
        return "mjbatch is not installed (it exists for Linux and macOS)"
    return unfit(_pinned("mjbatch"), _installed("mujoco"))


def unfit(needed: str | None, installed: str | None) -> str | None:
    """Reason why mjbatch does not work with the installed MuJoCo; None if it does.

    Args:
        needed: version of MuJoCo that mjbatch was built with; None if it states none.
        installed: version of MuJoCo; None if it is not installed.
    """
    if needed is None or needed == installed:
        return None
    return f"mjbatch was built with MuJoCo {needed}, and {installed or 'none'} is installed"


def _pinned(package: str) -> str | None:
    """Version of MuJoCo that a package demands."""
    for line in requires(package) or []:
        match = re.match(r"mujoco\s*==\s*([\w.]+)", line)
        if match:
            return match[1]
    return None


def _installed(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def cores() -> int:
    """Physical cores that this process may use, at least 1.

    Hyper-threads of one core share the units that physics and learning keep busy.
    """
    usable = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    siblings = {_siblings(cpu) for cpu in usable}
    return max(1, len(siblings) if usable else (os.cpu_count() or 2) // 2)


def _siblings(cpu: int) -> str:
    """Hyper-threads of a processor's core; the processor alone where that is not known."""
    path = f"/sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list"
    try:
        with open(path, encoding="ascii") as file:
            return file.read().strip()
    except OSError:
        return str(cpu)


def replicas(asked: int | None, environments: int, engine: Engine, devices: Sequence[str]) -> int:
    """Number of processes that share a run on a CPU.

    Args:
        asked: `--replicas`; None for one per physical core.
        environments: worlds of the run, shared among them.
        engine: the engine; MuJoCo Warp runs in one process on a CPU unless more are asked for.
        devices: as `draft.learn.devices.devices` names them.

    Raises:
        DraftError: more than there are cores or worlds, or several on GPUs.
    """
    if list(devices) != ["cpu"]:
        if asked is not None:
            cause = f"--replicas {asked} is for a CPU; on GPUs there is one process per device"
            raise DraftError(Problem(cause, None, "omit --replicas, or add --device cpu"))
        return len(devices)
    most = cores()
    if asked is None:
        return min(most, environments) if engine.name == NATIVE else 1
    if not 0 < asked <= most:
        cause = f"--replicas {asked}: this machine has {most} physical cores for this process"
        raise DraftError(Problem(cause, None, f"choose 1 to {most}"))
    if asked > environments:
        cause = f"--replicas {asked}: {environments} worlds cannot be shared among them"
        raise DraftError(Problem(cause, None, f"add --envs {asked} or more"))
    return asked


# Environment steps per second of one core with learning: native (flat, uneven ground) and Warp, as
# measured in docs/learning.md; they serve estimates alone.
_RATES = {NATIVE: {"flat": 4700.0, "uneven": 2500.0}, WARP: {"flat": 500.0, "uneven": 400.0}}


def minutes(steps: float, engine: Engine, processes: int, ground: str) -> float:
    """Estimate the time that training takes on a CPU [min].

    Args:
        steps: environment steps, of all worlds together.
        engine: the engine.
        processes: that share the run, each on a core.
        ground: "flat" or "uneven".
    """
    return steps / (_RATES[engine.name][ground] * processes) / 60


# Memory of a world on native MuJoCo besides its rollout, measured (cheetah, flat ground) [bytes].
_PER_WORLD = 60e3
_PER_PROCESS = 0.7e9


def check_memory(worlds: int, steps: int, observations: int, processes: int) -> None:
    """Check that the worlds of a run fit into the memory of a CPU.

    Args:
        worlds: of all processes together.
        steps: of a rollout.
        observations: numbers that actor and critic see together.
        processes: that share the run.

    Raises:
        DraftError: they do not.
    """
    free = _free_memory()
    # A rollout is held once, and once more while it is learnt from.
    needed = worlds * (_PER_WORLD + 8.0 * steps * (observations + 64)) + processes * _PER_PROCESS
    if free is not None and needed > free:
        most = int(worlds * max(0.0, free - processes * _PER_PROCESS) / needed)
        cause = f"{worlds} worlds need some {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB are free"
        raise DraftError(Problem(cause, None, f"add --envs {max(most // 64 * 64, 64)} or fewer"))


def _free_memory() -> float | None:
    """Memory that processes may still take [bytes]; None where the system does not say."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            lines = dict(line.split(":", 1) for line in file)
        return 1024.0 * float(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return None
