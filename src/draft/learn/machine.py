"""What `draft train` would run on here, told without PyTorch where no GPU can be."""

from __future__ import annotations

import importlib.util
import os
import sys
from dataclasses import dataclass
from pathlib import Path

from draft.learn.devices import devices
from draft.learn.engine import NATIVE, Engine, choose, cores

# Files by which drivers of GPUs show on Linux: NVIDIA's, on boards, in Windows' Linux, AMD's.
DEVICE_FILES = Path("/dev")
_DRIVERS = ("nvidia*", "nvhost*", "dxg", "kfd")
_NEEDED = ("torch", "mjlab")
KINDS = {NATIVE: "native MuJoCo", "warp": "MuJoCo Warp"}
REMEDY = "pip install 'draft[learn]'"


@dataclass(frozen=True)
class Machine:
    """What there is to learn on.

    Attributes:
        devices: as `draft.learn.devices.devices` names them.
        engine: what steps the worlds; None where something is missing.
        missing: library without which nothing can be learnt; None where all are there.
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


def machine(device: str = "auto", engine: str = "auto") -> Machine:
    """Look at this machine as `draft train` does.

    Args:
        device: as `--device` takes it; without PyTorch or a GPU's driver it is the CPU.
        engine: as `--engine` takes it.

    Raises:
        DraftError: no such device, or the engine cannot be used on it.
    """
    missing = next((name for name in _NEEDED if importlib.util.find_spec(name) is None), None)
    on_cpu = device == "cpu" or missing is not None or (device == "auto" and not gpu_possible())
    chosen = ["cpu"] if on_cpu else devices(device)
    return Machine(chosen, None if missing else choose(engine, chosen), missing, cores())


def gpu_possible() -> bool:
    """Whether PyTorch might find a GPU; where it cannot, it need not be loaded to be asked."""
    if os.environ.get("CUDA_VISIBLE_DEVICES", "0").strip() in ("", "-1"):
        return False
    if sys.platform == "darwin":
        return False
    if sys.platform != "linux":
        return True
    return any(next(DEVICE_FILES.glob(name), None) for name in _DRIVERS)
