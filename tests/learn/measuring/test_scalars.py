"""Every scalar's definition, on roll-outs made by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.learn.measuring.scalars import (
    Scalars,
    Worlds,
    curves,
    efficiency,
    kick,
    median_speed,
    scalars,
    tallest,
    traversed,
)
from tests.learn.measuring.columns import stood, worlds


def both(*parts: Worlds) -> Worlds:
    return Worlds(**{n: np.concatenate([getattr(p, n) for p in parts]) for n in vars(parts[0])})


def found(*parts: Worlds, leg: float = 0.48) -> Scalars:
    return scalars(curves(both(*parts)), leg)


def test_speed_is_the_median_over_those_that_did_not_fall() -> None:
    rows = [{"speed": v} for v in (1.0, 2.0, 4.0, 9.0)] + [{"speed": 50.0, "fell": True}] * 3
    assert median_speed(worlds("speed", rows)) == 3.0
    assert median_speed(stood("speed", {1.0: 0})) is None


def test_efficiency_is_the_median_of_work_per_work_and_heat() -> None:
    rows = [{"mechanical": m, "heat": 3.0} for m in (1.0, 3.0, 9.0)]  # 0.25, 0.5, 0.75
    rows += [{"mechanical": 1e6, "heat": 0.0, "fell": True}, {"mechanical": 0.0, "heat": 0.0}]
    assert efficiency(worlds("speed", rows)) == 0.5
    assert efficiency(worlds("speed", [{"mechanical": 0.0, "heat": 0.0}])) is None


def test_traversed_is_more_than_one_step_up_or_down_without_a_fall() -> None:
    rises = [0.1, -0.1, 0.11, -0.11, 0.5]
    rows = [{"rise": rise} for rise in rises] + [{"rise": math.nan, "fell": True}] * 5
    assert traversed(worlds("ascent", rows), 0.1) == 0.3


def test_top_speed_counts_levels_where_four_in_five_stay_up() -> None:
    made = found(
        stood("speed", {1.0: 10}, speed=0.9, mechanical=1.0, heat=1.0),
        stood("speed", {2.0: 8}, speed=1.7, mechanical=3.0, heat=1.0),
        stood("speed", {3.0: 7}, speed=2.6),
        stood("speed", {4.0: 10}, speed=1.2, mechanical=9.0, heat=1.0),
    )
    assert made.values["top_speed"] == 1.7
    assert made.values["peak_command"] == 2.0
    assert made.values["eta"] == 0.75
    assert made.values["top_speed_normalised"] == pytest.approx(1.7 / math.sqrt(9.81 * 0.48))
    assert made.reasons == {}


def test_walking_is_one_level() -> None:
    made = found(stood("walk", {0.4: 9}, speed=0.35))
    assert made.values == {"walk_survival": 0.9, "walk_speed": 0.35}


def test_the_kick_is_interpolated_where_half_recover() -> None:
    made = found(stood("push", {1.0: 10, 2.0: 9, 3.0: 6, 3.5: 2, 4.0: 8}))
    assert made.values["kick"] == pytest.approx(3.0 + 0.5 * 0.1 / 0.4)
    normalised = made.values["kick_normalised"]
    assert normalised == pytest.approx(3.125 / math.sqrt(9.81 * 0.48))
    assert made.flags == []


def test_a_kick_that_never_fells_half_is_the_largest_and_flagged() -> None:
    made = found(stood("push", {1.0: 10, 12.0: 5}))
    assert made.values["kick"] == 12.0
    assert made.flags == ["kick: half or more recover at every level, up to 12 m/s"]


def test_a_kick_below_the_first_level_has_a_reason() -> None:
    made = found(stood("push", {1.0: 4, 2.0: 0}))
    assert made.values == {"kick": None, "kick_normalised": None}
    assert made.reasons["kick"] == "fewer than half recover at the first level, 1 m/s"


@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=9),
    st.floats(0.1, 2.0),
)
def test_a_kick_lies_between_the_levels_that_it_is_read_from(
    shares: list[float], pitch: float
) -> None:
    levels = [1.0 + pitch * i for i in range(len(shares))]
    value, crosses = kick(levels, shares)
    if shares[0] < 0.5:
        assert value is None
        return
    assert value is not None
    below = [level for level, share in zip(levels, shares, strict=True) if share < 0.5]
    assert crosses == bool(below)
    assert levels[0] <= value <= (below[0] if below else levels[-1]) + 1e-9


def test_the_step_pools_ascent_and_descent() -> None:
    up, down = {0.1: 10, 0.2: 5, 0.3: 2, 0.4: 0}, {0.1: 10, 0.2: 10, 0.3: 8, 0.4: 9}
    made = found(stood("ascent", up, rise=0.9), stood("descent", down, rise=-0.9), leg=0.5)
    assert made.values["step_ascent"] == 0.2
    assert made.values["step_descent"] == 0.4
    assert made.values["step"] == 0.3  # (0.2 + 0.8) / 2
    assert made.values["step_normalised"] == pytest.approx(0.6)


def test_stairs_one_way_alone_give_no_pooled_step() -> None:
    made = found(stood("ascent", {0.1: 10}, rise=0.9))
    assert made.values == {"step_ascent": 0.1}


def test_the_tallest_step_counts_though_a_lower_one_fails() -> None:
    assert tallest([0.1, 0.2, 0.3], [0.9, 0.4, 0.5]) == 0.3
    assert tallest([0.1, 0.2], [0.4, 0.0]) is None


def test_zero_survivors_give_reasons_and_no_number() -> None:
    fallen: dict[str, Any] = {
        "speed": math.nan,
        "mechanical": math.nan,
        "heat": math.nan,
        "rise": math.nan,
    }
    names = ("speed", "ascent", "descent", "push")
    parts = [stood(name, {0.5: 0, 1.0: 0}, **fallen) for name in names]
    made = found(*parts)
    assert set(made.values.values()) == {None}
    assert set(made.reasons) == set(made.values)
    assert set(made.reasons.values()) == {"all fell at every level"}
    curve = curves(parts[0])["speed"]
    assert curve["speed"] == curve["eta"] == [None, None]


def test_curves_hold_what_each_test_is_about() -> None:
    made = curves(both(stood("push", {1.0: 5}), stood("ascent", {0.1: 5}, rise=1.0)))
    assert made["push"].get("recovered") == [0.5]
    assert made["ascent"].get("traversed") == [0.5]
    assert "traversed" not in made["push"]
