"""Training shared by two processes of a CPU, started by torchrunx as on two GPUs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("torch")
pytest.importorskip("mjlab")
pytest.importorskip("torchrunx")
pytest.importorskip("mjbatch")

from hypothesis import given
from hypothesis import strategies as st

from draft.errors import DraftError
from draft.learn.engine.worlds.ranks import rank_seed
from draft.learn.task.world.access import robot_of
from draft.learn.training.launch import THREADS
from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.progress import read
from draft.learn.training.run import open_run
from tests.learn.engine.two_processes import BOTH, start
from tests.learn.runs import begin
from tests.learn.small import plan


@given(st.integers(0, 2**31 - 1), st.integers(1, 1024))
def test_seeds_of_ranks_are_seeds_and_the_first_keeps_the_runs(seed: int, rank: int) -> None:
    assert rank_seed(seed, 0) == seed
    assert 0 <= rank_seed(seed, rank) < 2**31


def test_no_two_processes_of_neighbouring_runs_share_a_seed() -> None:
    seeds = [rank_seed(seed, rank) for seed in range(20) for rank in range(8)]
    assert len(set(seeds)) == len(seeds)
    assert rank_seed(0, 1) == 1556325973  # The same in every version: runs go on.


def test_the_worlds_of_both_have_all_designs_and_one_alone_the_seed_of_the_plan(
    tmp_path: Path,
) -> None:
    run = begin(tmp_path / "run", plan("cheetah", "bear", "giraffe", environments=4, seed=7))
    both = [Trainer(run, "cpu", rank, *BOTH).env for rank in (0, 1)]
    assert [robot_of(env).host_member.tolist() for env in both] == [[0, 1], [2, 0]]
    assert Trainer(run, "cpu", engine=BOTH[0]).env.cfg.seed == both[0].cfg.seed == 7


Pair = tuple[Path, list[dict[str, Any]], dict[str, str]]


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    """A folder, what two processes found that trained in it, and how they ended."""
    folder = tmp_path_factory.mktemp("pair")
    for name in ("whole", "cut"):
        begin(folder / name, plan(environments=8))
    said, _ = start("trains", folder, THREADS).communicate()
    *found, end = [json.loads(line) for line in said.splitlines()]
    return folder, sorted(found, key=lambda words: words["rank"]), end


def test_both_learn_one_policy_in_worlds_of_their_own(pair: Pair) -> None:
    first, second = pair[1]
    assert first["policy"] == second["policy"]
    assert first["worlds"] != second["worlds"]
    assert (first["seed"], second["seed"]) == (0, rank_seed(0, 1))
    assert first["threads"] == second["threads"] == THREADS


def test_rewards_are_means_over_the_worlds_of_both(pair: Pair) -> None:
    folder, found, _ = pair
    rewards = [words["reward"] for words in found]
    assert rewards[0] != rewards[1]
    rows = read(folder / "whole/progress.csv")
    assert [row["iteration"] for row in rows] == [1, 2, 3]
    assert rows[-1]["reward"] == pytest.approx(sum(rewards) / 2, rel=1e-4)


def test_the_newest_state_that_both_have_is_gone_on_with(pair: Pair) -> None:
    folder, found, _ = pair
    for words in found:
        # The second had written its state after two iterations, the first had not.
        assert words["left"] == ["resume.1.1.pt", "resume.1.2.pt", "resume.pt"]
        assert words["from"] == 1
        assert words["again"] == words["whole"]
    left = sorted(path.name for path in (folder / "cut").glob("resume*"))
    assert left == ["resume.1.3.pt", "resume.pt"]


def test_numbers_that_are_none_in_one_process_stop_both(pair: Pair) -> None:
    for words in pair[1]:
        assert words["lost"].startswith("iteration 4: observations are not finite")


def test_an_error_of_one_process_ends_all(pair: Pair) -> None:
    assert pair[2] == {"problem": "the second has had enough\n  give it a rest"}
    assert len(list((pair[0] / "logs").glob("*/localhost*.log"))) == 3


def test_a_run_resumes_with_as_many_processes(pair: Pair) -> None:
    with pytest.raises(
        DraftError, match=r"was written by 2 processes, and this run has 1\n  use as many"
    ):
        Trainer(open_run(pair[0] / "whole"), "cpu", engine=BOTH[0])
