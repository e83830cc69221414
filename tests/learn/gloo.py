"""Two processes on the CPU in place of two GPUs, for tests: `python -m tests.learn.gloo ARGUMENTS`.

It is `draft ARGUMENTS` with gloo for NCCL; all else, torchrunx too, is as it is on GPUs.
"""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path
from typing import Any

from draft.learn.several import Say


def configure(runner: Any) -> None:
    """rsl-rl's `_configure_multi_gpu` without its GPUs."""
    from torch import distributed

    runner.gpu_world_size = count = int(os.environ["WORLD_SIZE"])
    runner.gpu_global_rank = runner.gpu_local_rank = rank = int(os.environ["RANK"])
    runner.is_distributed = True
    runner.cfg["multi_gpu"] = {"global_rank": rank, "local_rank": rank, "world_size": count}
    if not distributed.is_initialized():
        distributed.init_process_group("gloo", rank=rank, world_size=count)


def on_cpu() -> None:
    """Let rsl-rl's runner take the CPU in this process."""
    from mjlab.rl import MjlabOnPolicyRunner

    MjlabOnPolicyRunner._configure_multi_gpu = configure  # type: ignore[method-assign]


def share(folder: Path, total: int, until: float, wandb: str | None, rank: int, say: Say) -> bool:
    """`draft.learn.lab.launch._share` on the CPU."""
    from draft.learn.lab import launch

    on_cpu()
    work = launch.work
    launch.work = lambda folder, device, *more: work(folder, "cpu", *more)
    return launch._share(folder, total, until, wandb, rank, say)


def main() -> int:
    """Run `draft`."""
    from draft.cli import main as draft
    from draft.learn import devices
    from draft.learn.lab import launch

    devices.devices = lambda word: ["cuda:0", "cuda:1"]
    together = launch.together
    launch.together = lambda of, *more: together(partial(share, *of.args), *more)
    return draft(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
