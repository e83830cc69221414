"""Skill tests: their grids, what a run is asked, and what is beyond its training."""

from __future__ import annotations

import math

import pytest

from draft.errors import DraftError
from draft.learn.measuring.levels import (
    SKILL_TESTS,
    Reached,
    flags,
    of_stage,
    settle,
    skill_tests,
    spread,
    trained,
)
from tests.learn.small import plan


def test_grids_are_those_of_the_study() -> None:
    counts = {name: len(test.levels) for name, test in SKILL_TESTS.items()}
    assert counts == {"speed": 22, "ascent": 19, "descent": 19, "push": 23, "walk": 1}
    ends = {name: (one.levels[0], one.levels[-1]) for name, one in SKILL_TESTS.items()}
    assert ends["speed"] == (0.2, 20.0)
    assert ends["ascent"] == ends["descent"] == (0.05, 0.5)
    assert ends["push"] == (1.0, 12.0)
    assert SKILL_TESTS["ascent"].levels[1] == 0.075


def test_only_speeds_are_commanded_and_only_kicks_kick() -> None:
    speed, push, stairs = SKILL_TESTS["speed"], SKILL_TESTS["push"], SKILL_TESTS["ascent"]
    assert (speed.command(3.0), speed.kick(3.0)) == (3.0, 0.0)
    assert (push.command(3.0), push.kick(3.0)) == (0.4, 3.0)
    assert (stairs.command(0.3), stairs.kick(0.3)) == (0.4, 0.0)


def test_stairs_are_both_ways_and_each_stage_has_its_tests() -> None:
    assert [test.name for test in skill_tests(["stairs"])] == ["ascent", "descent"]
    assert [of_stage(s) for s in ("base", "velocity", "terrain", "push")] == [
        ("walk",),
        ("speed",),
        ("stairs",),
        ("push",),
    ]


def test_fewer_levels_are_spread_from_the_first_to_the_last() -> None:
    assert skill_tests(["push", "push"], 3)[0].levels == (1.0, 6.5, 12.0)
    assert spread((1.0, 2.0, 3.0), 1) == (1.0,)
    assert spread((1.0, 2.0, 3.0), 9) == (1.0, 2.0, 3.0)
    assert skill_tests(["speed"], [2.0, 0.4, 2])[0].levels == (0.4, 2.0)


@pytest.mark.parametrize("levels", [0, -3, [-1, 2], [], [math.nan, 1], [math.inf, 2], [0.1, 1e9]])
def test_levels_that_make_no_sense_are_refused(levels: int | list[float]) -> None:
    with pytest.raises(DraftError, match="`levels`"):
        skill_tests(["speed"], levels)


def test_levels_of_several_tests_are_refused() -> None:
    with pytest.raises(DraftError, match="there are 2"):
        skill_tests(["speed", "push"], [1.0, 2.0])


@pytest.mark.parametrize(
    ("name", "stage", "iteration", "most"),
    [
        ("speed", "velocity", 400, 6.0),  # 0.4 of 15 m/s, up to iteration 400
        ("speed", "velocity", 401, 9.0),
        ("speed", "velocity", 1800, 15.0),
        ("push", "push", 1500, 2.5),
        ("push", "base", 1500, 0.5),
        ("ascent", "terrain", 2000, 0.1),  # the first row, where all start
        ("descent", "base", 1200, 0.14),  # the fourth of four rows
        ("walk", "base", 1200, 1.0),
    ],
)
def test_what_was_trained_follows_the_stage_and_its_ramp(
    name: str, stage: str, iteration: int, most: float
) -> None:
    assert trained(name, plan(stage=stage), iteration) == pytest.approx(most)


def test_stairs_are_trained_up_to_the_hardest_row_that_a_robot_was_on() -> None:
    ten = {"ground.rows": 10}
    assert trained("descent", plan(stage="base", values=ten), 9) == pytest.approx(0.14 * 3 / 9)
    climbing = plan(stage="terrain", values=ten)
    assert trained("ascent", climbing, 9, Reached(row=6.0)) == pytest.approx(0.1 + 0.4 * 6 / 9)
    assert trained("ascent", climbing, 9, Reached(row=9.0)) == pytest.approx(0.5)


def test_growing_commands_are_trained_up_to_the_fastest_commanded() -> None:
    grown = plan(stage="velocity", values={"velocity.growth": 0.2})
    assert trained("speed", grown, 200, Reached(fastest=3.4)) == 3.4
    begun = trained("speed", grown, 0)
    assert begun == trained("speed", plan(stage="base"), 0)


def test_levels_beyond_the_trained_range_and_other_stages_are_flagged() -> None:
    assert flags(skill_tests(["stairs"]), plan(stage="terrain"), 2000, Reached(row=9.0)) == []
    told = flags(
        skill_tests(["stairs"], [0.1, 0.2, 0.4]),
        plan(stage="terrain", values={"ground.rows": 10}),
        2000,
        Reached(row=3.0),
    )
    assert told == [
        "ascent: trained up to 0.233 m; beyond it: 0.4",
        "descent: trained up to 0.233 m; beyond it: 0.4",
    ]
    (told,) = flags(skill_tests(["speed"]), plan(stage="velocity"), 1800)
    assert told == "speed: trained up to 15 m/s; beyond it: 17 to 20"
    told = flags(skill_tests(["walk"]), plan(stage="velocity"), 1800)
    assert told == ["walk: for policies of stage base, any; this one is of stage velocity"]


def test_speeds_are_measured_once_robots_are_up_to_speed() -> None:
    assert [settle(12.0, skill_tests([word])) for word in ("speed", "push")] == [4.0, 2.0]
