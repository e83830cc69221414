"""Devices, physics engines, cores and memory that this machine offers for training.

The physics engine is native MuJoCo on a CPU, or MuJoCo Warp on a GPU. `this_machine` finds out
what `draft train` would use without importing PyTorch where there can be no GPU.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import requires
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from draft.errors import DraftError, counted
from draft.extras import installed, need
from draft.learn.task.constants import JOINTS

EngineName = Annotated[
    Literal["auto", "native", "warp"],
    Field(
        description="Physics: native MuJoCo on the CPU, or MuJoCo Warp; auto is native without a "
        "GPU."
    ),
]
NATIVE, WARP = "native", "warp"
KINDS = {NATIVE: "native MuJoCo", WARP: "MuJoCo Warp"}
_WARP_REMEDY = 'use `engine="warp"`, which runs anywhere and is some 15 times slower on a CPU'
_REQUIRED = ("torch", "mjlab")
# Device files of GPU drivers on Linux: NVIDIA, NVIDIA on boards, Windows' Linux, AMD.
DEVICE_FILES = Path("/dev")
_DRIVERS = ("nvidia*", "nvhost*", "dxg", "kfd")
# Environment steps per second of one core with learning: native (flat, uneven ground) and Warp, as
# measured in docs/learning.md; used for estimates only.
_RATES = {NATIVE: {"flat": 4700.0, "uneven": 2500.0}, WARP: {"flat": 500.0, "uneven": 400.0}}
_RATED_AT = 4  # Physics steps per environment step of those rates.
# Time of a physics step of one world on one core, measured as the difference between 20 and 4 per
# environment step (cheetah, 256 worlds natively, 64 on Warp) [s].
_PHYSICS = {NATIVE: {"flat": 20e-6, "uneven": 37e-6}, WARP: {"flat": 180e-6, "uneven": 320e-6}}
# Memory of a world on native MuJoCo besides its rollout, measured (cheetah, flat ground) [bytes].
_PER_WORLD = 60e3
_PER_PROCESS = 0.7e9


@dataclass(frozen=True)
class Engine:
    """A physics engine and the reason for its choice.

    Attributes:
        name: "native" or "warp".
        why: reason for the choice.
    """

    name: str
    why: str


@dataclass(frozen=True)
class Machine:
    """Resources of this machine for training.

    Attributes:
        devices: as `devices` names them.
        engine: physics engine; None if a library is missing.
        missing: name of a required library that is not installed; None if all are.
        cores: physical cores that this process may use.
    """

    devices: list[str]
    engine: Engine | None
    missing: str | None
    cores: int

    @property
    def on_cpu(self) -> bool:
        """Whether no GPU is used."""
        return self.devices == ["cpu"]


def this_machine(device: str = "auto", engine: str = "auto", ask: bool = True) -> Machine:
    """Find out what a training would use on this machine.

    Args:
        device: as `draft.train` takes it; the CPU without PyTorch or a GPU driver.
        engine: as `draft.train` takes it.
        ask: import PyTorch where there may be a GPU; else a GPU is assumed if there is a driver.

    Raises:
        DraftError: no such device, or the engine cannot be used on it.
    """
    missing = next((name for name in _REQUIRED if importlib.util.find_spec(name) is None), None)
    on_cpu = device == "cpu" or missing is not None or (device == "auto" and not gpu_possible())
    assumed = ["cuda:0"] if not ask and device == "auto" else None
    chosen = ["cpu"] if on_cpu else assumed or devices(device)
    return Machine(chosen, None if missing else choose(engine, chosen), missing, cores())


# --- devices -------------------------------------------------------------------------------


def devices(name: str) -> list[str]:
    """Return the devices that an argument `device` names.

    Args:
        name: "auto", "cpu", "cuda", "cuda:1", "all" (GPUs), or numbers of GPUs such as "0,1".

    Raises:
        DraftError: no such device.
    """
    torch = need("torch", "learn")
    count = torch.cuda.device_count() if torch.cuda.is_available() else 0
    if name == "cpu" or (name == "auto" and not count):
        return ["cpu"]
    numbers = name.removeprefix("cuda").removeprefix(":")
    if name in ("auto", "cuda"):
        numbers = "0"
    elif name == "all":
        numbers = ",".join(map(str, range(count)))
    chosen = [part.strip() for part in numbers.split(",")]
    if name != "all" and not all(part.isdigit() for part in chosen):
        remedy = "use cpu, cuda, cuda:1, all, or numbers of GPUs such as 0,1"
        raise DraftError(f"there is no device '{name}'", remedy)
    if not count:
        cause = f"`device` {name}: PyTorch finds no GPU"
        remedy = 'use `device="cpu"`, with few worlds to try things out'
        raise DraftError(cause, remedy)
    if any(int(part) >= count for part in chosen) or len(set(chosen)) < len(chosen):
        cause = f"`device` {name}: this machine has {counted(count, 'GPU')}, numbered from 0"
        raise DraftError(cause, "name existing GPUs, each once")
    return [f"cuda:{part}" for part in chosen]


def visible(chosen: Sequence[str]) -> list[str]:
    """Return the names of GPUs for CUDA_VISIBLE_DEVICES of another process.

    PyTorch numbers the GPUs that this process sees. If CUDA_VISIBLE_DEVICES is set here, a number
    is an index into its list of numbers or names such as GPU-8932f937 and MIG-GPU-8932f937.

    Args:
        chosen: GPUs as `devices` names them: "cuda:1".
    """
    seen = [name.strip() for name in os.environ.get("CUDA_VISIBLE_DEVICES", "").split(",")]
    numbers = [int(name.removeprefix("cuda:")) for name in chosen]
    return [seen[n] if n < len(seen) and seen[n] else str(n) for n in numbers]


def gpu_possible() -> bool:
    """Return whether PyTorch might find a GPU, without importing it."""
    if os.environ.get("CUDA_VISIBLE_DEVICES", "0").strip() in ("", "-1"):
        return False
    if sys.platform == "darwin":
        return False
    if sys.platform != "linux":
        return True
    return any(next(DEVICE_FILES.glob(name), None) for name in _DRIVERS)


# --- physics engines -----------------------------------------------------------------------


def choose(name: str, devices: Sequence[str]) -> Engine:
    """Choose the physics engine for devices.

    Args:
        name: "auto", "native" or "warp". "auto" is native without CUDA, if mjbatch is usable.
        devices: as `devices` names them.

    Raises:
        DraftError: native MuJoCo is requested on a GPU, or cannot be used.
    """
    on_cpu = list(devices) == ["cpu"]
    if name == WARP:
        return Engine(WARP, "requested")
    if name == "auto" and not on_cpu:
        return Engine(WARP, "it runs on the GPU")
    if not on_cpu:
        cause = f'`engine="native"` runs on the CPU, not on {", ".join(devices)}'
        raise DraftError(cause, 'add `device="cpu"`, or use `engine="warp"`')
    missing = obstacle()
    if missing is None:
        return Engine(NATIVE, "requested" if name == NATIVE else "the fastest without a GPU")
    if name == NATIVE:
        raise DraftError(f'`engine="native"`: {missing}', _WARP_REMEDY)
    return Engine(WARP, f"native MuJoCo cannot be used: {missing}")


def obstacle() -> str | None:
    """Return the reason why native MuJoCo cannot be used; None if it can."""
    if importlib.util.find_spec("mjbatch") is None:
        return "mjbatch is not installed (it exists for Linux and macOS)"
    return incompatibility(_pinned_mujoco("mjbatch"), installed("mujoco"))


def incompatibility(needed: str | None, installed: str | None) -> str | None:
    """Return the reason why mjbatch does not work with the installed MuJoCo; None if it does.

    Args:
        needed: version of MuJoCo that mjbatch was built with; None if it states none.
        installed: version of MuJoCo; None if it is not installed.
    """
    if needed is None or needed == installed:
        return None
    return f"mjbatch was built with MuJoCo {needed}, and {installed or 'none'} is installed"


def _pinned_mujoco(package: str) -> str | None:
    """Version of MuJoCo that a package requires."""
    for line in requires(package) or []:
        match = re.match(r"mujoco\s*==\s*([\w.]+)", line)
        if match:
            return match[1]
    return None


# --- cores, time and memory ----------------------------------------------------------------


def cores() -> int:
    """Number of physical cores that this process may use, at least 1.

    Hyper-threads of one core share the units that physics and learning keep busy.
    """
    usable = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    siblings = {_siblings(cpu) for cpu in usable}
    return max(1, len(siblings) if usable else (os.cpu_count() or 2) // 2)


def _siblings(cpu: int) -> str:
    """Hyper-threads of a processor's core; the processor alone if that is not known."""
    path = f"/sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list"
    try:
        with open(path, encoding="ascii") as file:
            return file.read().strip()
    except OSError:
        return str(cpu)


def replicas(
    requested: int | None, environments: int, engine: Engine, devices: Sequence[str]
) -> int:
    """Number of processes that share a run on a CPU.

    Args:
        requested: number asked for; None for one per physical core.
        environments: worlds of the run, divided among the processes.
        engine: the engine; MuJoCo Warp uses one process on a CPU unless more are requested.
        devices: as `devices` names them.

    Raises:
        DraftError: more processes than cores or worlds, or several requested on GPUs.
    """
    if list(devices) != ["cpu"]:
        if requested is not None:
            cause = f"`replicas` {requested} is for a CPU; on GPUs there is one process per device"
            raise DraftError(cause, 'omit `replicas`, or add `device="cpu"`')
        return len(devices)
    most = cores()
    if requested is None:
        return min(most, environments) if engine.name == NATIVE else 1
    if not 0 < requested <= most:
        cause = f"`replicas` {requested}: this machine has {most} physical cores for this process"
        raise DraftError(cause, f"choose 1 to {most}")
    if requested > environments:
        verb = "is" if environments == 1 else "are"
        worlds = f"there {verb} only {counted(environments, 'world')} to divide"
        cause = f"`replicas` {requested}: {worlds}"
        raise DraftError(cause, f"add `envs={requested}` or more")
    return requested


def minutes(
    steps: float,
    physics: int,
    engine: Engine,
    processes: int,
    ground: str,
    joints: float = JOINTS,
) -> float:
    """Estimate the time that training takes on a CPU [min].

    Args:
        steps: environment steps, of all worlds together.
        physics: physics steps per environment step.
        engine: the physics engine.
        processes: number of processes that share the run, each on a core.
        ground: "flat" or "uneven".
        joints: joints of the robots; steps take as much longer as they have more than twelve.
    """
    finer = (physics - _RATED_AT) * _PHYSICS[engine.name][ground]
    step = (1.0 / _RATES[engine.name][ground] + finer) * max(1.0, joints / JOINTS)
    return steps * step / processes / 60


def check_memory(worlds: int, steps: int, observations: int, processes: int) -> None:
    """Check that the worlds of a run fit into the memory of a CPU.

    Args:
        worlds: worlds of all processes together.
        steps: steps of a rollout.
        observations: length of the observations of actor and critic together.
        processes: number of processes that share the run.

    Raises:
        DraftError: they do not fit.
    """
    free = free_memory()
    # A rollout is held once, and once more during the update.
    needed = worlds * (_PER_WORLD + 8.0 * steps * (observations + 64)) + processes * _PER_PROCESS
    if free is not None and needed > free:
        most = int(worlds * max(0.0, free - processes * _PER_PROCESS) / needed)
        cause = f"{worlds} worlds need some {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB are free"
        raise DraftError(cause, f"add `envs={max(most // 64 * 64, 64)}` or fewer")


def free_memory() -> float | None:
    """Available memory [bytes]; None if the system does not report it."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            lines = dict(line.split(":", 1) for line in file)
        return 1024.0 * float(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return None
