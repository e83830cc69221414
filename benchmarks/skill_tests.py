"""How much faster skill tests are in one simulation than with one environment per level.

`python -m benchmarks.skill_tests` builds and rolls out the same levels, replicas and seconds both
ways, side by side in one process after kernels are compiled, prints a table with peak memory and
writes `benchmarks/results/skill_tests.json`. Builds count. On a GPU it is all levels with 256
replicas; on a CPU fewer replicas, levels and seconds, which `--replicas`, `--levels` and
`--seconds` change.
"""

from __future__ import annotations

import platform
import resource
from dataclasses import replace
from typing import Any

import torch
import tyro

import draft
from benchmarks.rows import measured, publish, timed
from draft.learn.bodies.legged import legged_robot
from draft.learn.measuring.evaluation_options import RollOuts
from draft.learn.measuring.levels import SkillTest, skill_tests
from draft.learn.measuring.rollout.evaluate import evaluate
from draft.learn.measuring.rollout.trial import Trial
from draft.learn.task.world.task import Task

STAGES = {"speed": "velocity", "stairs": "terrain", "push": "push"}


def main(
    replicas: int | None = None,
    levels: int | None = None,
    seconds: float | None = None,
    device: str | None = None,
) -> None:
    """Measure both ways, print a table and write it as JSON.

    Args:
        replicas: of each level; 256 on a GPU, 2 on a CPU.
        levels: of each test; all where None.
        seconds: of a roll-out; 12 on a GPU, 0.5 on a CPU.
        device: cuda:0 or cpu; the GPU if there is one.
    """
    device = device or ("cuda:0" if torch.cuda.is_available() else "cpu")
    gpu = device.startswith("cuda")
    usual = RollOuts() if gpu else RollOuts(replicas=2, seconds=0.5)
    replicas, seconds = replicas or usual.replicas, seconds or usual.seconds
    where = torch.cuda.get_device_name(device) if gpu else f"CPU ({platform.processor()})"
    rows, sums, peak = [], [0.0, 0.0], 0.0
    for word, stage in STAGES.items():
        found = skill_tests((word,), levels)
        trial = _trial(stage, found, replicas, seconds)
        alone = [replace(trial, tests=(replace(t, levels=(n,)),)) for t in found for n in t.levels]
        for warm in (trial, alone[0]):  # Kernels are compiled on the first steps.
            _run(replace(warm, seconds=0.1, settle=0.02), device)
        before = _memory(device)
        together, most = timed(lambda trial=trial: _run(trial, device))
        peak = max(peak, most)
        apart, _ = timed(lambda alone=alone: [_run(one, device) for one in alone])
        sums = [sums[0] + together, sums[1] + apart]
        rows += [
            measured(f"{word}: {len(alone)} levels in one simulation", together, "s"),
            measured(f"{word}: one environment per level", apart, "s"),
            measured(f"{word}: ratio", apart / together, "x"),
            measured(f"{word}: memory of the simulation", most - before, "MB"),
        ]
    rows.append(measured("all tests: ratio", sums[1] / sums[0], "x", 5.0, True))
    rows.append(measured("peak memory", peak, "MB"))
    publish("skill_tests", rows, device=where, replicas=str(replicas), seconds=f"{seconds:g}")


def _trial(stage: str, found: tuple[SkillTest, ...], replicas: int, seconds: float) -> Trial:
    task = Task((legged_robot(draft.load("quadruped").resolve("cheetah")),), stage)
    return Trial(task, found, replicas, seconds=seconds, settle=seconds / 6)


def _run(trial: Trial, device: str) -> float:
    """Build, roll out and close; returns memory in use at the end of the roll-out [MB]."""
    most = 0.0

    def tell(names: str, step: int, steps: int) -> None:
        nonlocal most
        if step == steps:
            most = max(most, _memory(device))

    evaluate(trial, _standing, device, tell)
    return most


def _standing(env: Any) -> Any:
    """The home pose: nobody falls, so that all worlds are simulated to the end."""
    actions = torch.zeros(env.num_envs, env.action_manager.total_action_dim, device=env.device)
    return lambda seen: actions


def _memory(device: str) -> float:
    """Memory in use on a GPU, of Warp too, or the process's peak on a CPU [MB]."""
    if device == "cpu":
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    free, total = torch.cuda.mem_get_info(device)
    return (total - free) / 1e6


if __name__ == "__main__":
    tyro.cli(main)
