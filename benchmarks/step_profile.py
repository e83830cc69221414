"""Where the time of an environment's step goes, and what in it waits for the device."""

from __future__ import annotations

import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import torch
from torch.utils._python_dispatch import TorchDispatchMode

# part of a step -> (what of the environment, its methods)
PARTS = {
    "physics": [("sim", "step")],
    "kinematics for observations": [("sim", "forward")],
    "rays": [("sim", "sense")],
    "actions to torques": [
        ("action_manager", "process_action"),
        ("action_manager", "apply_action"),
        ("scene", "write_data_to_sim"),
    ],
    "contact sensors and timers": [("scene", "update")],
    "observations": [("observation_manager", "compute")],
    "rewards": [("reward_manager", "compute")],
    "endings": [("termination_manager", "compute")],
    "commands": [("command_manager", "compute")],
    "events": [("event_manager", "apply")],
    "resets": [("", "_reset_idx")],
}
MAP = ("scan", "height", "feet", "normal")  # Of Draft's height map; part of the terms above.


def synchronise(device: str) -> None:
    """Wait until a device has done what it was asked for."""
    if device.startswith("cuda"):
        torch.cuda.synchronize(device)


def split(env: Any, act: Callable[[], Any], steps: int) -> dict[str, float]:
    """Milliseconds per step by part; what a part calls of another counts for the first.

    Args:
        env: the environment.
        act: makes actions.
        steps: how many steps.
    """
    found: dict[str, float] = defaultdict(float)
    with _timed_parts(env, found):
        synchronise(env.device)
        start = time.perf_counter()
        for _ in range(steps):
            env.step(act())
        synchronise(env.device)
        total = time.perf_counter() - start
    inside = sum(found[part] for part in PARTS)
    rows = {part: found[part] for part in PARTS} | {"rest": total - inside}
    if "height map" in found:
        rows["of these: height map"] = found["height map"]
    return {part: 1e3 * seconds / steps for part, seconds in rows.items()}


@contextmanager
def _timed_parts(env: Any, found: dict[str, float]) -> Iterator[None]:
    """Methods of the parts add the time they take to `found`."""
    depth: Counter[str] = Counter()

    def timed(method: Callable[..., Any], part: str, kind: str) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            if depth[kind]:
                return method(*args, **kwargs)
            depth[kind] += 1
            synchronise(env.device)
            start = time.perf_counter()
            try:
                return method(*args, **kwargs)
            finally:
                synchronise(env.device)
                found[part] += time.perf_counter() - start
                depth[kind] -= 1

        return call

    methods = [
        (getattr(env, owner) if owner else env, name, part, "part")
        for part, places in PARTS.items()
        for owner, name in places
    ]
    ground = env.scene.sensors.get("ground")
    methods += [(ground, name, "height map", "map") for name in MAP if ground is not None]
    patches = [
        mock.patch.object(owner, name, timed(getattr(owner, name), part, kind))
        for owner, name, part, kind in methods
    ]
    for patch in patches:
        patch.start()
    try:
        yield
    finally:
        for patch in patches:
            patch.stop()


class Transfers(TorchDispatchMode):
    """Counts operations whose result the host waits for, by operation and place in the code.

    Single numbers that Python reads, copies between devices, and results whose size the values
    decide: those of nonzero and of masks. On the CPU nothing waits, but all except the copies are
    counted there too.
    """

    def __init__(self) -> None:
        super().__init__()
        self.places: Counter[str] = Counter()

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        """Count, then do it."""
        kwargs = kwargs or {}
        name = str(func.overloadpacket).removeprefix("aten.")
        read = name in ("_local_scalar_dense", "nonzero", "masked_select", "equal")
        if read or _masked(name, args) or _copied(name, args, kwargs):
            self.places[f"{name} at {_place()}"] += 1
        return func(*args, **kwargs)


def _copied(name: str, args: Any, kwargs: Any) -> bool:
    """Whether an operation copies from one device to another."""
    to = kwargs.get("device") if name == "_to_copy" else None
    return to is not None and torch.device(to).type != args[0].device.type


def _masked(name: str, args: Any) -> bool:
    """Whether an operation takes or sets what a mask picks; one value for all needs no count."""
    if name not in ("index", "index_put", "index_put_"):
        return False
    masks = any(i is not None and i.dtype in (torch.bool, torch.uint8) for i in args[1])
    return masks and (name == "index" or args[2].numel() > 1)


def _place() -> str:
    """Innermost line of mjlab or Draft that is being run."""
    for frame in reversed(traceback.extract_stack()):
        parts = Path(frame.filename).parts
        for package in ("mjlab", "draft"):
            if package in parts:
                start = len(parts) - 1 - parts[::-1].index(package)
                return f"{'/'.join(parts[start:])}:{frame.lineno}"
    return "elsewhere"


def transfers(env: Any, act: Callable[[], Any], resets: bool, steps: int = 5) -> Counter[str]:
    """Operations that the host waits for in some steps, by place.

    Args:
        env: the environment.
        act: makes actions.
        resets: whether a world times out in every one of them; else none does.
        steps: how many.
    """
    found: Counter[str] = Counter()
    counted = 0
    while counted < steps:
        env.episode_length_buf[:] = 1
        if resets:
            env.episode_length_buf[0] = 10**6
        with Transfers() as mode:
            env.step(act())
        if bool(env.reset_buf.any()) == resets:  # A fall spoils a step without resets.
            found += mode.places
            counted += 1
    return found
