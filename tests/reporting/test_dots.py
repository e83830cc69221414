"""Dot plot of a report: what stands where, for 2 to 12 designs."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from draft.metrics import METRICS
from draft.reporting import dots
from draft.reporting.dots import Row
from draft.reporting.subjects import Subject
from draft.reporting.tables import number

pytest.importorskip("plotly")


def test_a_dot_stands_where_its_value_is_between_the_ends() -> None:
    row = Row("speed", "m/s", "more", [3.0, 1.0, 2.5, math.nan])
    assert row.ends == (1.0, 3.0)
    assert row.about == "m/s, higher is better"
    assert dots.places(row) == [(2, 0.0, 0), (3, 0.75, 0), (1, 1.0, 0)]


@pytest.mark.parametrize("count", [2, 3, 8, 12])
def test_dots_of_a_lane_never_overlap(count: int) -> None:
    values = np.random.default_rng(count).lognormal(size=count).tolist()
    placed = dots.places(Row("x", "1", "", [*values, values[0]]))
    assert sorted(dot.design for dot in placed) == [*range(1, count + 2)]
    for lane in {dot.lane for dot in placed}:
        shares = [dot.share for dot in placed if dot.lane == lane]
        assert all(b - a >= dots.DOT for a, b in pairwise(shares))


def test_rows_are_the_quantities_that_differ(three: list[Subject]) -> None:
    rows = {row.name.replace(" ", "_"): row for row in dots.metrics(three)}
    for name, metric in METRICS.items():
        values = [one.metrics.get(name, math.nan) for one in three]
        differ = len({number(value) for value in values if math.isfinite(value)}) > 1
        assert (name in rows) == (differ and metric.unit != "bool")
    lengths = {row.name: row for row in dots.parameters(three)}["thigh_length"]
    assert lengths.values == [one.design.parameters["thigh_length"] for one in three]
    assert lengths.unit == "m"
    assert "crouch" not in {row.name for row in dots.parameters([three[0], three[0]])}


def test_the_plot_says_unit_direction_ends_and_who_has_no_value(three: list[Subject]) -> None:
    text = dots.plot(three, [Row("trunk mass", "kg", "less", [12.5, math.nan, 8.25])])
    for words in ("kg, lower is better", "<b><span>8.25</span></b>", "<span>12.5</span>"):
        assert words in text
    assert f"no value: {three[1].title}" in text
    assert f'title="{three[2].title}: 8.25 kg"' in text


def test_titles_are_words_and_nothing_else(three: list[Subject]) -> None:
    hostile = "<img src=x onerror=alert(1)>\"'"
    found = [Subject(**{**vars(one), "title": hostile}) for one in three]
    text = dots.plot(found, [Row(hostile, "kg", "", [1.0, 2.0, math.nan])])
    assert "<img" not in text
    assert text.count('"') % 2 == 0
