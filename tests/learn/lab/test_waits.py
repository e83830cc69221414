"""Nothing of Draft in a step waits for the device, so that a GPU never stands idle for it."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("mjlab")

import torch
from mjlab.envs import ManagerBasedRlEnv

import draft
from benchmarks.step_profile import Transfers, transfers
from draft.learn.lab.tasks import Task, environment
from draft.learn.quadruped import quadruped

WORLDS = 3
# MuJoCo Warp: stairs and cylinders touch in one point only.
pytestmark = pytest.mark.filterwarnings("ignore:MULTICCD is enabled:UserWarning")


@pytest.fixture(scope="module")
def env() -> Any:
    member = quadruped(draft.load("quadruped").resolve("cheetah"))
    made = ManagerBasedRlEnv(environment(Task((member,)), WORLDS), device="cpu")
    made.reset()
    yield made
    made.close()


def still() -> torch.Tensor:
    return torch.zeros(WORLDS, 12)


def test_a_step_waits_only_where_mjlab_asks_which_worlds_are_due(env: Any) -> None:
    places = transfers(env, still, resets=False, steps=3)
    assert {place.split(":")[0] for place in places} == {
        "nonzero at mjlab/envs/manager_based_rl_env.py",
        "nonzero at mjlab/managers/command_manager.py",
    }
    assert set(places.values()) == {3}


def test_a_reset_waits_for_nothing_of_draft(env: Any) -> None:
    places = transfers(env, still, resets=True, steps=2)
    assert [place for place in places if "at mjlab/" not in place] == []


@pytest.mark.parametrize(
    ("work", "count"),
    [
        (lambda x: float(x.sum()), 1),
        (lambda x: bool((x > 0).any()), 1),
        (lambda x: x.nonzero(), 1),
        (lambda x: x[x > 0], 1),
        (lambda x: x.index_put_((x > 0,), torch.ones(2)), 1),
        (lambda x: x.masked_fill_(x > 0, 1.0), 0),
        (lambda x: torch.where(x > 0, x, 0.0), 0),
        (lambda x: x[torch.tensor([0, 1])], 0),
    ],
)
def test_what_waits_is_counted(work: Any, count: int) -> None:
    values = torch.tensor([1.0, -1.0, 2.0])
    with Transfers() as mode:
        work(values)
    assert mode.places.total() == count
