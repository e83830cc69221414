"""How many steps per second Draft's base stage makes, against mjlab's own Go1 velocity task.

`python -m benchmarks.learn` prints a table and writes `benchmarks/results/learn.json`. Both run in
the same process with the same number of worlds and random small actions, in turns, after kernels
are compiled; bars are ratios. On a GPU it takes 4096 worlds, on a CPU 16, which says little about
a GPU. `--envs`, `--steps`, `--rounds` and `--device` change that.
"""

from __future__ import annotations

import contextlib
import io
import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
import tyro
from mjlab.envs import ManagerBasedRlEnv
from mjlab.sensor import GridPatternCfg, ObjRef, RayCastSensorCfg
from mjlab.tasks.registry import load_env_cfg
from rich.console import Console

import draft
from benchmarks.rows import measured, publish
from benchmarks.step_profile import split, synchronise, transfers
from draft.learn.bodies.legged import legged_robot
from draft.learn.task.config import Config
from draft.learn.task.mdp.environment import environment
from draft.learn.task.world.access import GROUND
from draft.learn.task.world.task import Task

GO1 = {"rough": "Mjlab-Velocity-Rough-Unitree-Go1", "flat": "Mjlab-Velocity-Flat-Unitree-Go1"}
OURS, FLAT, FEET = "Draft base, uneven", "Draft base, flat", "Draft base, uneven, only feet touch"
THEIRS, THEIRS_FLAT = "mjlab Go1, rough", "mjlab Go1, flat"
RAYS = "rays"


def main(
    envs: int | None = None,
    steps: int | None = None,
    rounds: int = 7,
    device: str | None = None,
) -> None:
    """Measure everything, print a table and write it as JSON.

    Args:
        envs: worlds; 4096 on a GPU, 16 on a CPU.
        steps: steps per round; 100 on a GPU, 20 on a CPU.
        rounds: rounds in turns; medians count.
        device: cuda:0 or cpu; the GPU if there is one.
    """
    device = device or ("cuda:0" if torch.cuda.is_available() else "cpu")
    gpu = device.startswith("cuda")
    worlds, steps = envs or (4096 if gpu else 16), steps or (100 if gpu else 20)
    where = torch.cuda.get_device_name(device) if gpu else f"CPU ({_processor()})"
    cases, memory = {}, []
    for name, config in _configs(worlds).items():
        before = _memory(device)
        cases[name] = Case(config, device)
        cases[name].run(max(10, steps // 4))  # Kernels are compiled on the first steps.
        memory.append(measured(f"memory: {name}", (_memory(device) - before) / 1e6, "MB"))
    rates = _rates(cases, steps, rounds)
    rows = [measured(f"{name}, steps/s", rate, "") for name, rate in rates.items() if name != RAYS]
    rows += [
        measured("Draft uneven / Go1 rough", rates[OURS] / rates[THEIRS], "x", 1.0, True),
        measured("Draft flat / Go1 flat", rates[FLAT] / rates[THEIRS_FLAT], "x", 1.0, True),
        measured("thighs touch the ground / only feet do", rates[OURS] / rates[FEET], "x"),
        *_scans(cases[RAYS], steps),
        *_profiles(cases, steps),
        *memory,
    ]
    publish("learn", rows, device=where, worlds=str(worlds), torch=torch.__version__)


class Case:
    """An environment that takes random small actions."""

    def __init__(self, config: Any, device: str) -> None:
        with contextlib.redirect_stdout(io.StringIO()):  # mjlab prints its managers.
            self.env = ManagerBasedRlEnv(config, device=device)
            self.env.reset()
        shape = (self.env.num_envs, self.env.action_manager.total_action_dim)
        self._actions = 0.1 * torch.randn(*shape, device=device)
        # As in training: time-outs of the worlds are spread over time.
        longest = int(self.env.max_episode_length)
        self.env.episode_length_buf = torch.randint(longest, shape[:1], device=device)

    def act(self) -> torch.Tensor:
        """Actions for all worlds."""
        return self._actions.normal_(std=0.1)

    def run(self, steps: int) -> float:
        """Seconds that some steps take."""
        return _seconds(lambda: self.env.step(self.act()), steps, self.env.device)


def _configs(worlds: int) -> dict[str, Any]:
    """Environments that are measured."""
    member = legged_robot(draft.load("quadruped").resolve("cheetah"))
    config = Config()
    feet = config.with_values({"physics.upper_legs_collide": False})
    found = {OURS: environment(Task((member,)), worlds)}
    for name, task in ((THEIRS, "rough"), (THEIRS_FLAT, "flat")):
        found[name] = load_env_cfg(GO1[task])
        found[name].scene.num_envs = worlds
    found[FLAT] = environment(Task((member,), ground="flat"), worlds)
    found[FEET] = environment(Task((member,), config=feet), worlds)
    rays, seen = environment(Task((member,)), worlds), config.observations
    sensor = RayCastSensorCfg(
        name=RAYS,
        frame=ObjRef(type="body", name=member.trunk, entity="robot"),
        ray_alignment="yaw",
        pattern=GridPatternCfg(size=seen.scan_size, resolution=seen.scan_pitch),
        max_distance=seen.scan_range,
        include_geom_groups=(0,),
    )
    rays.scene = replace(rays.scene, sensors=(*rays.scene.sensors, sensor))
    return found | {RAYS: rays}


def _rates(cases: dict[str, Case], steps: int, rounds: int) -> dict[str, float]:
    """Steps of all worlds per second; the environments alternate."""
    times: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(rounds):
        for name, case in cases.items():
            times[name].append(case.run(steps))
    return {
        name: steps * case.env.num_envs / statistics.median(times[name])
        for name, case in cases.items()
    }


def _scans(case: Case, repeats: int) -> list[dict[str, Any]]:
    """The same grid over the same ground by mjlab's rays and by the height map."""
    env = case.env
    ground, rays = env.scene[GROUND], env.scene[RAYS]

    def by_rays() -> torch.Tensor:
        env.sim.sense()
        return rays.data.distances

    pairs = {"rays": by_rays, "height map": ground.scan}
    times: dict[str, list[float]] = {name: [] for name in pairs}
    for _ in range(8):
        for name, work in pairs.items():
            times[name].append(_seconds(work, repeats, env.device) / repeats)
    by = {name: 1e3 * statistics.median(found[1:]) for name, found in times.items()}
    return [
        measured("height scan by mjlab's rays", by["rays"], "ms"),
        measured("height scan by the height map", by["height map"], "ms"),
        measured("rays / height map", by["rays"] / by["height map"], "x"),
    ]


def _profiles(cases: dict[str, Case], steps: int) -> list[dict[str, Any]]:
    """How the time of a step splits, and what waits for the device."""
    rows = []
    for name in (OURS, THEIRS, FLAT, THEIRS_FLAT):
        case = cases[name]
        parts = split(case.env, case.act, steps)
        rows += [measured(f"{name}: {part}", ms, "ms") for part, ms in parts.items()]
        for resets, word in ((False, "no reset"), (True, "a reset")):
            places = transfers(case.env, case.act, resets)
            total = places.total() / 5
            rows.append(measured(f"{name}: the host waits, step with {word}", total, "times"))
            if name == OURS:
                for place, count in places.most_common():
                    Console().print(f"step with {word}: {count / 5:g} x {place}", style="dim")
    return rows


def _seconds(work: Callable[[], Any], times: int, device: str) -> float:
    """Seconds that some work takes so many times, all of it done."""
    synchronise(device)
    start = time.perf_counter()
    for _ in range(times):
        work()
    synchronise(device)
    return time.perf_counter() - start


def _memory(device: str) -> float:
    """Bytes in use: of the GPU, by all that runs there; else by this process, on Linux."""
    if device.startswith("cuda"):
        free, total = torch.cuda.mem_get_info(device)
        return total - free
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def _processor() -> str:
    """Name of the processor and its cores."""
    info = Path("/proc/cpuinfo")
    text = info.read_text() if info.exists() else ""
    names = [line.partition(": ")[2] for line in text.splitlines() if line.startswith("model name")]
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


if __name__ == "__main__":
    tyro.cli(main)
