"""The trim of many worlds is that of each, and starts anew where a world does."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from draft.learn.policy.trim import START, Trim

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")
from draft.learn.measuring.rollout.trimmed import Trimmed  # noqa: E402

TRIM = Trim(np.array([0.1, 0.1, 0.1, 0.05, 0.05]), np.full(5, 0.2), np.full(3, 0.5))
FIRST = {"base_lin_vel": 0, "base_ang_vel": 3, "projected_gravity": 6, "command": 9}
PERIODS = np.array([[0.02], [0.05]])


def test_worlds_are_trimmed_apart_and_start_anew_when_they_are_reset() -> None:
    env: Any = SimpleNamespace(num_envs=2, episode_length_buf=torch.tensor([0, 0]))
    trimmed = Trimmed(TRIM, env, FIRST, PERIODS)
    states = [START, START]
    random = np.random.default_rng(0)
    for step in range(6):
        env.episode_length_buf = torch.tensor([step, step % 4])  # The second is reset after 4.
        seen: Any = random.normal(size=(2, 12)).astype(np.float32)
        found = trimmed(seen)
        for world in range(2):
            state = START if env.episode_length_buf[world] == 0 else states[world]
            own = seen[world].astype(float)
            asked, moving = own[9:], own[[0, 1, 5]]
            np.testing.assert_array_equal(found[world, :6], own[:6])
            np.testing.assert_array_equal(found[world, 6:9], TRIM.gravity(own[6:9], state))
            np.testing.assert_array_equal(found[world, 9:], TRIM.command(asked, state))
            states[world] = TRIM.next(state, asked, moving, PERIODS[world])
    assert np.abs(states).max() > 0.001
