"""What `draft train` says at its end: whether the robot walks, by tracking and by falls."""

from __future__ import annotations

import math
import re

import pytest

pytest.importorskip("mjlab")

from draft.cli.display.training import verdict, worse
from draft.learn.measuring.levels import ASCENT, SPEED
from draft.learn.measuring.rollout.review import Level


def level(speed: float, error: float, up: int = 64, test: str = SPEED) -> Level:
    return Level(test, speed, speed - error, error, up, up, 64)


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ([level(0.25, 0.04), level(1.0, 0.09)],
         "it walks: commands are met within 0.09 m/s, and none falls"),
        # A fast command may be missed by a share of it.
        ([level(3.0, 0.4)], "it walks.*"),
        ([level(0.5, 0.11)], "it does not walk as asked at 0.5 m/s yet.*"),
        # Few falls are reported, and many are no walk.
        ([level(0.5, 0.02, up=62), level(1.0, 0.02)], "it walks.* and 2 of 128 fall"),
        ([level(0.5, 0.02, up=40), level(1.0, 0.02)],
         "it does not walk as asked at 0.5 m/s yet, and 24 of 128 fall"
         ".*repeat the command with --iterations 500"),
        # Where all fall, no speed is known.
        ([level(1.0, math.nan, up=0)], ".*it does not walk as asked at 1 m/s.*"),
        # Stairs do not decide whether it walks.
        ([level(0.5, 0.02), level(0.1, 0.9, 0, ASCENT)], "it walks.*"),
    ],
)  # fmt: skip
def test_a_robot_walks_that_meets_its_commands_and_stays_up(found: list[Level], said: str) -> None:
    assert re.fullmatch(said, verdict(found, 250), re.DOTALL)


def test_it_is_said_where_a_policy_does_worse_than_the_one_it_started_from() -> None:
    before = [level(1.0, 0.05), level(3.0, 0.2), level(5.0, 0.4)]
    assert worse(before, before) is None
    slower = [level(1.0, 0.05), level(3.0, 0.5), level(5.0, 1.3)]
    assert worse(slower, before) == "asked for 5.00 m/s"
    assert worse(before, slower) is None
    falls = [level(1.0, 0.05, up=60), level(3.0, 0.2, up=61), level(5.0, math.nan, up=0)]
    assert worse(falls, before) == "asked for 1.00 m/s, asked for 5.00 m/s"
    steps = [level(0.1, 0.0, up=40, test=ASCENT)]
    assert worse(steps, [level(0.1, 9.0, test=ASCENT)]) == "steps of 0.1 m up"
