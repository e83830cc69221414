"""Training shared by two processes of a CPU, started by torchrunx as on two GPUs."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")
pytest.importorskip("torchrunx")
pytest.importorskip("mjbatch")

from hypothesis import given  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

from draft.errors import DraftError  # noqa: E402
from draft.learn.engine.machine import NATIVE  # noqa: E402
from draft.learn.engine.multi_process import Send, run_processes  # noqa: E402
from draft.learn.engine.worlds.ranks import Ranks, rank_seed  # noqa: E402
from draft.learn.task.world.access import robot_of  # noqa: E402
from draft.learn.training.launch import THREADS  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.progress import read  # noqa: E402
from draft.learn.training.run import create, open_run  # noqa: E402
from tests.learn.small import plan  # noqa: E402

BOTH = (NATIVE, 2)  # Engine and processes.
ROOT = Path(__file__).parents[3]


@given(st.integers(0, 2**31 - 1), st.integers(1, 1024))
def test_seeds_of_ranks_are_seeds_and_the_first_keeps_the_runs(seed: int, rank: int) -> None:
    assert rank_seed(seed, 0) == seed
    assert 0 <= rank_seed(seed, rank) < 2**31


def test_no_two_processes_of_neighbouring_runs_share_a_seed() -> None:
    seeds = [rank_seed(seed, rank) for seed in range(20) for rank in range(8)]
    assert len(set(seeds)) == len(seeds)
    assert rank_seed(0, 1) == 1556325973  # The same in every version: runs go on.


def test_one_process_alone_keeps_the_seed_of_the_plan(tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(seed=7), {"cheetah": "values: {}\n"})
    assert Trainer(run, "cpu").env.cfg.seed == 7


def test_the_worlds_of_both_have_all_designs(tmp_path: Path) -> None:
    made = plan("cheetah", "bear", "giraffe", environments=4)
    designs = dict.fromkeys((member.name for member in made.members), "values: {}\n")
    run = create(tmp_path / "run", made, designs)
    both = [robot_of(Trainer(run, "cpu", rank, *BOTH).env).host_member for rank in (0, 1)]
    assert [member.tolist() for member in both] == [[0, 1], [2, 0]]


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    """What two processes found, and their folder."""
    folder = tmp_path_factory.mktemp("pair")
    for name in ("whole", "cut"):
        create(folder / name, plan(environments=8), {"cheetah": "values: {}\n"})
    subprocess.run(
        [sys.executable, "-c", f"from {__name__} import main; main({str(folder)!r})"],
        check=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])},
    )
    return folder, [json.loads((folder / f"found.{rank}.json").read_text()) for rank in (0, 1)]


Pair = tuple[Path, list[dict[str, Any]]]


def test_both_learn_one_policy_in_worlds_of_their_own(pair: Pair) -> None:
    first, second = pair[1]
    assert first["policy"] == second["policy"]
    assert first["worlds"] != second["worlds"]
    assert (first["seed"], second["seed"]) == (0, rank_seed(0, 1))


def test_rewards_are_means_over_the_worlds_of_both(pair: Pair) -> None:
    folder, found = pair
    rewards = [words["reward"] for words in found]
    assert rewards[0] != rewards[1]
    rows = read(folder / "whole/progress.csv")
    assert [row["iteration"] for row in rows] == [1, 2, 3]
    assert rows[-1]["reward"] == pytest.approx(sum(rewards) / 2, rel=1e-4)


def test_the_newest_state_that_both_have_is_gone_on_with(pair: Pair) -> None:
    folder, found = pair
    for words in found:
        # The second had written its state after two iterations, the first had not.
        assert words["left"] == ["resume.1.1.pt", "resume.1.2.pt", "resume.pt"]
        assert words["from"] == 1
        assert words["again"] == words["whole"]
    assert sorted(p.name for p in (folder / "cut").glob("resume*")) == [
        "resume.1.3.pt",
        "resume.pt",
    ]


def test_numbers_that_are_none_in_one_process_stop_both(pair: Pair) -> None:
    for words in pair[1]:
        assert words["lost"].startswith("iteration 4: observations are not finite")


def test_a_run_resumes_with_as_many_processes(pair: Pair) -> None:
    with pytest.raises(
        DraftError, match=r"was written by 2 processes, and this run has 1\n  use as many"
    ):
        Trainer(open_run(pair[0] / "whole"), "cpu")


def digest(values: dict[str, Any]) -> str:
    parts = [f"{name} {values[name].tolist()}" for name in sorted(values)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def state(trainer: Trainer) -> str:
    """All that a process has learnt, with its worlds."""
    saved = trainer.runner.alg.save()
    learnt = {
        **saved["actor_state_dict"],
        **{f"v.{k}": v for k, v in saved["critic_state_dict"].items()},
    }
    return digest(learnt | {"qpos": trainer.env.sim.data.qpos[:]})


def two(folder: Path, rank: int, send: Send) -> bool:
    """Train in one go; train, be killed and go on; and lose the second process's numbers."""
    from draft.learn.training.ppo import trainer as trainers

    torch.set_num_threads(1)
    trainers.SAVE_SECONDS = 0.0
    whole = Trainer(open_run(folder / "whole"), "cpu", rank, *BOTH)
    reward = own_reward(whole)
    policy = dict(whole.runner.alg.actor.named_parameters())
    words = {
        "seed": whole.env.cfg.seed,
        "reward": reward,
        "whole": state(whole),
        "policy": digest(policy),
        "worlds": digest({"qpos": whole.env.sim.data.qpos[:]}),
    }
    killed(folder / "cut", rank)
    whole._ranks.wait()
    words["left"] = sorted(path.name for path in (folder / "cut").glob("resume*"))
    again = Trainer(open_run(folder / "cut"), "cpu", rank, *BOTH)
    words["from"] = again.iteration
    assert again.train(3)
    words["again"] = state(again)
    words["lost"] = loss(whole, rank)
    # Files, as lines of both on one output can run into each other.
    (folder / f"found.{rank}.json").write_text(json.dumps(words))
    return True


def killed(folder: Path, rank: int) -> None:
    """Train until the second process has saved its second iteration, and the first has not."""
    trainer = Trainer(open_run(folder), "cpu", rank, *BOTH)
    wait, waits = Ranks.wait, iter(range(100))

    def dies(self: Ranks) -> None:
        # Two for each save: at the start, after one iteration, and the first of the second.
        if next(waits) == 4:
            raise KeyboardInterrupt
        wait(self)

    Ranks.wait = dies
    with pytest.raises(KeyboardInterrupt):
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
    assert trainer.train(3)
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
    with pytest.raises(DraftError) as error:
        trainer.train(4)
    return str(error.value)


def main(folder: str) -> None:
    """Start both."""
    worker = partial(two, Path(folder))
    assert run_processes(worker, 2, THREADS, Path(folder) / "logs", lambda _: None)
