"""Velocity commands: their ranges, their shares and their ramp."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("mjlab")
import torch

from draft.learn.task.mdp.commands import command_term as term
from tests.learn.task.states import each, place, turn

FORWARD, SIDEWAYS, TURN = (
    (1.0, 1.241639, 1.645701),
    (0.6, 0.744983, 0.987421),
    (0.5, 0.402694, 0.303822),
)
LIMIT = 0.5 * 1.77356  # Half the giraffe's estimated top speed [m/s].
DRAWS = 400


def drawn(env: Any) -> dict[str, torch.Tensor]:
    """Many draws for every world: commands, and what kind each is."""
    command, ids = term(env), torch.arange(env.num_envs)
    names = {
        "value": "vel_command_b",
        "standing": "is_standing_env",
        "heading": "is_heading_env",
        "forward": "is_forward_env",
        "target": "heading_target",
    }
    found: dict[str, list[torch.Tensor]] = {name: [] for name in names}
    torch.manual_seed(1)
    for _ in range(DRAWS):
        command._resample_command(ids)
        for name, attribute in names.items():
            found[name].append(getattr(command, attribute).clone())
    return {name: torch.stack(values) for name, values in found.items()}


def test_ranges_of_commands_by_stage(base: Any, terrain: Any, push: Any) -> None:
    # Those of the base stage grow with the design; on hard ground half the top speed holds the
    # giraffe alone; those of the push stage are the same for all.
    held = (FORWARD[0], FORWARD[1], LIMIT)
    sideways = (SIDEWAYS[0], SIDEWAYS[1], 0.6 * LIMIT)
    for env, expected, share, tolerance in (
        (base, (FORWARD, SIDEWAYS, TURN), (1.0, 1.0, 1.0), 1e-4),
        (terrain, (held, sideways, TURN), (1.0, 1.0, LIMIT / FORWARD[2]), 5e-4),
        (push, ((1.0,) * 3, (0.6,) * 3, (0.5,) * 3), (1.0, 1.0, 1.0), 1e-6),
    ):
        largest = torch.stack([each(env, values) for values in expected], dim=1)
        torch.testing.assert_close(term(env).range_now(), largest, atol=tolerance, rtol=0)
        torch.testing.assert_close(term(env).held_share, each(env, share), atol=tolerance, rtol=0)
    torch.testing.assert_close(term(base).held_share, torch.ones(base.num_envs))


@pytest.mark.parametrize(
    ("iteration", "share"),
    [(0, 0.4), (399, 0.4), (400, 0.6), (899, 0.6), (900, 0.8), (1399, 0.8), (1400, 1), (5000, 1)],
)
def test_commands_of_the_velocity_stage_grow_at_their_steps(
    velocity: Any, iteration: int, share: float
) -> None:
    expected = torch.tensor([15 * share, 0.4, 0.4]).expand(velocity.num_envs, 3)
    for step in (24 * iteration, 24 * iteration + 23):
        velocity.common_step_counter = step
        torch.testing.assert_close(term(velocity).range_now(), expected)
    value = drawn(velocity)["value"][..., 0].abs()
    assert value.max() <= 15 * share
    assert value.max() > 0.99 * 15 * share


def test_commands_fill_their_range_and_never_leave_it(base: Any) -> None:
    found = drawn(base)
    free = ~found["forward"]
    share = (found["value"] / term(base).range_now())[free]
    assert share.abs().max() <= 1
    assert (share.max(0).values > 0.99).all()
    assert (share.min(0).values < -0.99).all()
    assert (share.mean(0).abs() < 5 / (3 * len(share)) ** 0.5).all()
    assert found["target"].abs().max() <= torch.pi
    assert found["target"].abs().max() > 3.1


def test_shares_of_the_kinds_of_command(base: Any) -> None:
    found, n = drawn(base), DRAWS * base.num_envs
    # A heading is followed only by those that do not go straight ahead.
    for kind, share in (("standing", 0.1), ("forward", 0.2), ("heading", 0.3 * 0.8)):
        spread = (share * (1 - share) / n) ** 0.5
        assert abs(float(found[kind].float().mean()) - share) < 4 * spread, kind
    assert not (found["forward"] & found["heading"]).any()


def test_straight_ahead_is_forwards_and_not_slower_than_the_least(base: Any) -> None:
    found = drawn(base)
    straight = found["value"][found["forward"]]
    assert (straight[:, 0] >= 0.3).all()
    assert (straight[:, 0] == torch.tensor(0.3)).any()
    assert not straight[:, 1:].any()


def test_standing_worlds_are_commanded_zero_and_heading_worlds_turn_to_their_heading(
    flat: Any,
) -> None:
    command = term(flat)
    place(flat, (0, 0, 2), turn("z", 0.5))
    command.vel_command_b[:] = 0.2
    command.is_standing_env[:], command.is_heading_env[:] = False, False
    command.is_standing_env[0] = command.is_heading_env[1] = command.is_heading_env[2] = True
    command.heading_target[:] = 0.5 + 0.4
    command.heading_target[2] = 0.5 - 3.0
    command._update_command()
    value = command.command
    assert not value[0].any()
    # Half the error of 0.4 rad; and no faster than this design turns.
    torch.testing.assert_close(value[1], torch.tensor([0.2, 0.2, 0.2]), atol=1e-5, rtol=0)
    expected = torch.tensor([0.2, 0.2, -TURN[2]])
    torch.testing.assert_close(value[2], expected, atol=1e-5, rtol=0)
    torch.testing.assert_close(value[3:], torch.full((flat.num_envs - 3, 3), 0.2))


def test_a_command_lasts_three_to_eight_seconds(flat: Any) -> None:
    command, ids = term(flat), torch.arange(flat.num_envs)
    times = []
    for _ in range(50):
        command.reset(ids)
        times.append(command.time_left.clone())
    found = torch.cat(times)
    assert 3.0 <= found.min() < 3.2
    assert 7.8 < found.max() <= 8.0
    command.time_left[:] = 1.0
    command.time_left[4] = 0.02
    before = command.command_counter.clone()
    command.compute(0.02)
    assert (command.command_counter - before).tolist() == [i == 4 for i in range(flat.num_envs)]


def test_a_reset_draws_for_its_worlds_and_returns_their_mean_error(flat: Any) -> None:
    command, ids = term(flat), torch.tensor([2, 7])
    command.metrics["error_vel_xy"][:] = torch.arange(flat.num_envs, dtype=torch.float32)
    before = command.command.clone()
    told = command.reset(ids)
    assert float(told["error_vel_xy"]) == 4.5
    assert not command.metrics["error_vel_xy"][ids].any()
    others = [i for i in range(flat.num_envs) if i not in (2, 7)]
    torch.testing.assert_close(command.command[others], before[others])
    assert (command.command[ids] != before[ids]).any(1).all()
