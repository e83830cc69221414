"""Stage velocity with a share of robots that learn to survive pushes instead of to run."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("mjlab")
import torch

from draft.learn.task.mdp import curriculums, events
from draft.learn.task.mdp.commands import command_term, share_of_worlds
from draft.learn.task.recipes import LAPTOP
from tests.learn.task.states import drive, laptop


@pytest.fixture(scope="module")
def mixed() -> Any:
    """A quarter of the worlds is pushed; the commands of the others have grown to 3 m/s."""
    env = laptop("velocity", "cheetah", "bear", worlds=8, **{"velocity.pushed": 0.25})
    command_term(env).grown.fill_(10.0)
    return env


@pytest.mark.parametrize("share", [0.1, 0.25, 0.29, 0.4, 1.0])
def test_the_share_is_spread_evenly(share: float) -> None:
    chosen = share_of_worlds(share, 100, "cpu")
    assert int(chosen.sum()) == round(100 * share)
    gaps = chosen.nonzero()[:, 0].diff()
    assert gaps.max() - gaps.min() <= 1
    assert bool(chosen[0]) == (share == 1.0)  # The first world stands for the others.


def test_their_commands_are_those_of_stage_push_and_do_not_grow(mixed: Any) -> None:
    term: Any = command_term(mixed)
    assert term.pushed.tolist() == [False, False, False, True] * 2
    slow, others = term.range_now()[term.pushed], term.range_now()[~term.pushed]
    torch.testing.assert_close(slow, torch.tensor([1.0, 0.6, 0.5]).expand(2, 3))
    assert (others[:, 0] > 2.9).all()
    torch.testing.assert_close(curriculums.fastest(mixed, torch.arange(0)), others[:, 0].mean())


def test_their_tracking_says_nothing_of_how_fast_the_others_run(
    mixed: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    term: Any = command_term(mixed)
    before, most = term.grown.clone(), term.range_now()[:, 0]
    # With those that are pushed, 0.8 of the commands would be reached, and then not.
    drive(mixed, monkeypatch, most, most * torch.where(term.pushed, 1.0, 0.79), 4.0)
    assert term.grown.tolist() == before.tolist()
    drive(mixed, monkeypatch, most, most * torch.where(term.pushed, 0.0, 0.81), 4.0)
    assert (term.grown > before).all()
    term.grown.copy_(before)


@pytest.mark.parametrize(("iteration", "factor"), [(0, 2.0), (29, 2.0), (30, 3.0), (90, 5.0)])
def test_their_pushes_are_those_of_stage_push_and_alike_for_all_designs(
    mixed: Any, monkeypatch: pytest.MonkeyPatch, iteration: int, factor: float
) -> None:
    cfg = mixed.event_manager.get_term_cfg("push")
    term, added = cfg.func, []
    monkeypatch.setattr(events.torch, "rand_like", torch.ones_like)
    monkeypatch.setattr(events, "add_velocity", lambda robot, velocity: added.append(velocity))
    mixed.common_step_counter = iteration * LAPTOP.config.learning.steps
    term.time_left[:] = mixed.step_dt
    term(mixed, None, **cfg.params)
    mixed.common_step_counter = 0
    pushed: Any = command_term(mixed).pushed
    strong = factor * torch.tensor([0.5, 0.5, 0.4, 0.52, 0.52, 0.78])
    torch.testing.assert_close(added[0][pushed], strong.expand(2, 6))
    roots = mixed.scene["robot"].leg_scale.sqrt()
    torch.testing.assert_close(added[0][~pushed][:, 0], 0.5 * roots[~pushed])
    longest = torch.where(pushed, 3.0, 5.0) * roots
    torch.testing.assert_close(term.time_left, longest)


def test_without_a_share_the_states_of_earlier_runs_have_the_same_tensors() -> None:
    env = laptop("velocity", worlds=2)
    assert command_term(env).pushed is None
    assert env.event_manager.get_term_cfg("push").func._second is None
