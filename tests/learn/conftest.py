"""Environments that the tests of this folder share: few worlds, on the CPU."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

from draft.design.references import open_designs
from draft.learn.bodies.legged import LeggedRobot, legged_robot

DESIGNS = ("cheetah", "bear", "giraffe")
WORLDS = 12


@pytest.fixture(scope="session")
def members() -> tuple[LeggedRobot, ...]:
    """The three shipped quadrupeds; world i of an environment has member i modulo three."""
    return tuple(legged_robot(design) for design in open_designs(DESIGNS))


@pytest.fixture(scope="session")
def build(members: tuple[LeggedRobot, ...]) -> Callable[..., Any]:
    """Build an environment of a stage, reset once."""
    mjlab = pytest.importorskip("mjlab.envs")
    from draft.learn.task.mdp.environment import environment
    from draft.learn.task.world.task import Task

    def built(worlds: int = WORLDS, **task: Any) -> Any:
        task = {"members": members, **task}
        made = mjlab.ManagerBasedRlEnv(environment(Task(**task), worlds), "cpu")
        made.reset()
        return made

    return built


@pytest.fixture(scope="session")
def _shared(build: Callable[..., Any]) -> Callable[..., Any]:
    """Build an environment at its first use only."""
    return cache(build)


def _anew(env: Any) -> Any:
    env.common_step_counter = 0
    env.reset(seed=0)
    return env


@pytest.fixture
def flat(_shared: Callable[..., Any]) -> Any:
    """Stage base on a plane, all three designs, just reset."""
    return _anew(_shared(ground="flat"))


@pytest.fixture
def base(_shared: Callable[..., Any]) -> Any:
    """Stage base, all three designs, just reset."""
    return _anew(_shared())


@pytest.fixture
def terrain(_shared: Callable[..., Any]) -> Any:
    """Stage terrain, all three designs, just reset."""
    return _anew(_shared(stage="terrain"))


@pytest.fixture
def velocity(_shared: Callable[..., Any]) -> Any:
    """Stage velocity on a plane, all three designs, just reset."""
    return _anew(_shared(stage="velocity", ground="flat"))


@pytest.fixture
def push(_shared: Callable[..., Any]) -> Any:
    """Stage push on a plane, all three designs, just reset."""
    return _anew(_shared(stage="push", ground="flat"))
