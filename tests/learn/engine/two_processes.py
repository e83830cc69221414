"""Workers of tests of several processes, without pytest: each process imports them anew."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from draft.errors import DraftError, Problem
from draft.files import lock
from draft.learn.engine.machine import NATIVE
from draft.learn.engine.multi_process import Send, asked_to_stop, run_processes
from draft.learn.training.launch import THREADS
from tests.waiting import until

if TYPE_CHECKING:
    from draft.learn.training.ppo.trainer import Trainer

ROOT = Path(__file__).parents[3]
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}
GPUS = {"CUDA_VISIBLE_DEVICES": "4,GPU-5"}
BOTH = (NATIVE, 2)  # Engine and processes.


def start(name: str, folder: Path, more: dict[str, str]) -> subprocess.Popen[str]:
    """Start a process that runs a worker of this module in two others."""
    code = f"from {__name__} import main; main({name!r}, {str(folder)!r}, {more!r})"
    return subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def main(name: str, folder: str, more: dict[str, str]) -> None:
    """Run a worker as `draft train` does, in a folder that it holds, and print what it sends."""

    def receive(message: dict[str, Any]) -> None:
        # In one piece: `print` writes the end of a line apart, and there are two threads.
        sys.stdout.write(json.dumps(message) + "\n")
        sys.stdout.flush()

    place = Path(folder)
    # Whoever runs the tests in the background may have them ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with lock(place, "test"):
        try:
            run_processes(partial(globals()[name], place), 2, more, place / "logs", receive)
        except DraftError as error:
            print(json.dumps({"problem": str(error)}))
        except KeyboardInterrupt:
            print(json.dumps({"stopped": True}))


def breaks(folder: Path, rank: int, send: Send) -> bool:
    raise ZeroDivisionError("by nothing\nat all")


def lasts(folder: Path, rank: int, send: Send) -> bool:
    send({"process": os.getpid()})
    time.sleep(3600)
    return True


def stops(folder: Path, rank: int, send: Send) -> bool:
    """Work until asked to stop."""
    send({"rank": rank, "gpus": os.environ["CUDA_VISIBLE_DEVICES"]})
    until(asked_to_stop)
    return False


def trains(folder: Path, rank: int, send: Send) -> bool:
    """Train in one go; train, be killed and go on; lose numbers of the second process; and fail."""
    import torch

    from draft.learn.training.ppo import trainer as trainers
    from draft.learn.training.ppo.trainer import Trainer
    from draft.learn.training.run import open_run

    torch.set_num_threads(1)
    trainers.SAVE_SECONDS = 0.0
    whole = Trainer(open_run(folder / "whole"), "cpu", rank, *BOTH)
    reward = own_reward(whole)
    policy = dict(whole.runner.alg.actor.named_parameters())
    words = {
        "rank": rank,
        "threads": {name: os.environ[name] for name in THREADS},
        "seed": whole.env.cfg.seed,
        "reward": reward,
        "whole": state(whole),
        "policy": digest(policy),
        "worlds": digest({"qpos": whole.env.sim.data.qpos[:]}),
    }
    killed(Trainer(open_run(folder / "cut"), "cpu", rank, *BOTH))
    whole._ranks.wait()
    words["left"] = sorted(path.name for path in (folder / "cut").glob("resume*"))
    again = Trainer(open_run(folder / "cut"), "cpu", rank, *BOTH)
    words["from"] = again.iteration
    again.train(3)
    words["again"] = state(again)
    words["lost"] = loss(whole, rank)
    send(words)
    whole._ranks.wait()
    if rank == 1:
        raise DraftError(Problem("the second has had enough", None, "give it a rest"))
    time.sleep(3600)  # It would wait for the second for ever.
    return True


def digest(values: dict[str, Any]) -> str:
    parts = [f"{name} {values[name].tolist()}" for name in sorted(values)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def state(trainer: Trainer) -> str:
    """All that a process has learnt, with its worlds."""
    from tests.learn.runs import weights

    return digest(weights(trainer) | {"qpos": trainer.env.sim.data.qpos[:]})


def killed(trainer: Trainer) -> None:
    """Train until the second process has saved its second iteration, and the first has not."""
    from draft.learn.engine.worlds.ranks import Ranks

    wait, waits = Ranks.wait, iter(range(100))

    def dies(self: Ranks) -> None:
        # Two for each save: at the start, after one iteration, and the first of the second.
        if next(waits) == 4:
            raise KeyboardInterrupt
        wait(self)

    Ranks.wait = dies
    with contextlib.suppress(KeyboardInterrupt):
        trainer.train(3)
    Ranks.wait = wait


def own_reward(trainer: Trainer) -> float:
    """Train three iterations; returns the last one's reward per second in this process's worlds."""
    own: list[list[float]] = []
    add = trainer._ranks.sum

    def sum_(values: Any) -> Any:
        own.append(values.tolist())
        return add(values)

    trainer._ranks.sum = sum_
    trainer.train(3)
    steps, reward = own[-2][:2]
    return reward / steps / trainer.env.step_dt


def loss(trainer: Trainer, rank: int) -> str:
    """What is said where the second process sees numbers that are none."""
    step = trainer._wrapped.step

    def broken(actions: Any) -> Any:
        seen, *rest = step(actions)
        seen["actor"][0, 0] = float("nan") if rank else 0.0
        return seen, *rest

    trainer._wrapped.step = broken
    try:
        trainer.train(4)
    except DraftError as error:
        return str(error)
    return ""
