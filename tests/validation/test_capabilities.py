"""Capabilities of roll-outs made by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("mjlab")

import draft
from draft.learn.bodies.legged import legged_robot
from draft.learn.measuring.scalars import Worlds
from draft.validation.capabilities import _numbers, _resampled
from tests.learn.measuring.columns import stood

CHEETAH = legged_robot(draft.load("quadruped").resolve("cheetah"))
WALK = 1.0


def walking(up: int) -> Worlds:
    return stood("speed", {WALK: up}, speed=0.9)


@pytest.mark.parametrize(("up", "walks"), [(10, True), (8, True), (7, False), (1, False)])
def test_a_walk_has_power_where_four_in_five_stay_up(up: int, walks: bool) -> None:
    found = _numbers(walking(up), CHEETAH, WALK)
    names = ("walking_speed", "walking_power", "cost_of_transport", "endurance", "range")
    assert [found[name] is not None for name in names] == [walks] * len(names)


def test_samples_in_which_too_few_stay_up_count_as_zero_speed_and_as_no_power() -> None:
    drawn = _resampled(walking(8), CHEETAH, WALK, seed=0)
    speeds = np.array(drawn["top_speed"])
    assert set(speeds) == {0.0, 0.9}
    # Fewer than 8 of 10 by a chance of 0.8 each: 32 %.
    assert 0.2 < (speeds == 0).mean() < 0.45
    assert len(drawn["walking_power"]) == (speeds > 0).sum()
    assert all(power > 0 and not math.isnan(power) for power in drawn["walking_power"])
