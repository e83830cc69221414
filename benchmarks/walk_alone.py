"""Environment steps per second of one process without learning: `ENGINE GROUND WORLDS`."""

from __future__ import annotations

import contextlib
import io
import statistics
import sys
import time

import torch

from draft.design.references import open_designs
from draft.learn.bodies.legged import legged_robot
from draft.learn.engine.worlds.simulate import make
from draft.learn.silence import quiet
from draft.learn.task.mdp.environment import environment
from draft.learn.task.recipes import LAPTOP
from draft.learn.task.world.task import Task

ROUNDS, SECONDS = 5, 3.0


def main(engine: str, ground: str, worlds: int) -> None:
    """Step with small random actions, and print the median of the rounds."""
    quiet()
    torch.set_num_threads(1)
    member = legged_robot(open_designs(["cheetah"])[0])
    stage = "terrain" if ground == "uneven" else "base"
    sees = ground == "uneven"
    task = Task((member,), stage, LAPTOP.config, ground, see_ground=sees)  # type: ignore[arg-type]
    with contextlib.redirect_stdout(io.StringIO()):
        env = make(environment(task, worlds), "cpu", engine)
        env.reset()
    actions = torch.zeros(worlds, 12)

    def rate(seconds: float) -> float:
        begun, steps = time.perf_counter(), 0
        while time.perf_counter() - begun < seconds:
            env.step(actions.normal_(0.0, 0.3))
            steps += worlds
        return steps / (time.perf_counter() - begun)

    rate(SECONDS)  # Kernels are compiled, and robots land.
    print(statistics.median(rate(SECONDS) for _ in range(ROUNDS)))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
