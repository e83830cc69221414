"""Levers without the browser: effects on sliders, a metric that is held, and one to reach."""

from __future__ import annotations

import json
import re
from html import escape

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.errors import DraftError
from draft.explore.comparison_tables import section
from draft.metrics import of_design
from draft.studio.levers import Levers, between, effect_text, hold, to_target
from draft.studio.library import Library
from draft.studio.report_page import report_page
from draft.studio.session import Session
from draft.values import scalar

QUADRUPED = draft.load("quadruped")
CHEETAH = QUADRUPED.resolve("cheetah")
TORQUE = "actuators.leg.peak_torque"


def metric(design: draft.Design, name: str) -> float:
    return scalar(of_design(design, [name])[name])


def test_sliders_show_direction_and_size_of_a_step() -> None:
    effects = Levers(metric="mass").effects(CHEETAH)
    assert effects[TORQUE].startswith("▲ ")
    assert effects["crouch"] == ""
    assert Levers(metric="payload_rated").effects(CHEETAH)["trunk_length"].startswith("▼ ")
    assert Levers().effects(CHEETAH) == {}
    assert effect_text(0.0, -0.5) == "▲ 0.5"  # A step more does nothing, a step less does.
    assert effect_text(float("nan"), 0.25) == "▼ 0.25"


@settings(max_examples=15)
@given(st.floats(0.2, 0.45), st.sampled_from(["mass", "standing_torque_rated", "jump_height"]))
def test_a_held_metric_stays_or_the_follower_is_at_an_end(length: float, name: str) -> None:
    found = hold(CHEETAH, {"thigh_length": length}, name, TORQUE)
    assert found is not None
    value, exact = found
    after = QUADRUPED.resolve("cheetah", {"thigh_length": length, TORQUE: value})
    if exact:
        assert metric(after, name) == pytest.approx(metric(CHEETAH, name), rel=1e-4)
    else:
        assert value in (20.0, 300.0)  # The ends of its slider.


def test_the_effects_of_sliders_need_no_verdict_and_are_those_of_the_command() -> None:
    found = draft.sensitivity(CHEETAH, ["jump_height"])
    quick = draft.sensitivity(CHEETAH, ["jump_height"], verdicts=False)
    np.testing.assert_array_equal(quick.step_up, found.step_up)
    assert quick.accepted.all()
    effects = Levers(metric="accepted").effects(CHEETAH)  # A mask is judged all the same.
    assert effects["trunk_length"] == ""
    strong = draft.sensitivity(CHEETAH, ["accepted"], by=[TORQUE], verdicts=False)
    judged = draft.sensitivity(CHEETAH, ["accepted"], by=[TORQUE])
    np.testing.assert_array_equal(strong.step_up, judged.step_up)


def test_the_card_of_a_pinned_design_has_the_numbers_of_the_comparison() -> None:
    pytest.importorskip("viser")
    from draft.studio.pinned_tab import comparison_card

    session = Session(Library(QUADRUPED))
    session.pin()
    pinned = session.shown
    assert "Change the design" in comparison_card(pinned, pinned)
    session.set_all({"thigh_length": 0.3, TORQUE: 90.0}, "both")
    card = comparison_card(pinned, session.shown)
    found = draft.compare([pinned.design, session.design], names=("pinned", "now"))
    for name, _, before, now, odds, shares in section(found).summary.rows:
        row = " ".join(re.sub(r"<[^>]+>", " ", card[card.index(f"<td>{name} ") :]).split())
        assert f"{now} {before} {escape(odds)}" in row
        assert shares in row
    assert "knee: rated torque (leg)" in card
    pytest.importorskip("plotly")
    record = draft.compare([pinned.design, session.design]).record()["against_first"][0]
    data = re.search(r'id="draft-report">(.+?)</script>', report_page(session))
    assert data is not None
    own = json.loads(data[1])["comparison"]["against_first"][0]
    assert own["shares"] == record["shares"]
    assert own["better"] == record["better"]


def test_a_follower_that_ends_says_so() -> None:
    levers = Levers(held="mass", follower="trunk_length")
    moved = levers.moved(CHEETAH, TORQUE, 500.0)
    assert moved[TORQUE] == 500.0
    assert moved["trunk_length"] == pytest.approx(0.2)
    assert levers.told == "mass 33.6 kg cannot be held: trunk_length ends at 0.2"
    levers.moved(CHEETAH, TORQUE, 80.0)
    assert levers.told.endswith("holds mass 33.6 kg")


def test_the_follower_itself_moves_alone_and_so_does_all_without_a_hold() -> None:
    assert Levers(held="mass", follower=TORQUE).moved(CHEETAH, TORQUE, 90.0) == {TORQUE: 90.0}
    assert Levers().moved(CHEETAH, TORQUE, 90.0) == {TORQUE: 90.0}
    assert Levers(held="mass").moved(CHEETAH, TORQUE, 90.0) == {TORQUE: 90.0}


def test_a_target_is_a_number_or_a_comparison() -> None:
    higher = to_target(CHEETAH, "jump_height", "0.4")
    assert metric(higher.design, "jump_height") >= 0.4
    lighter = to_target(CHEETAH, "mass", "30")
    assert metric(lighter.design, "mass") <= 30
    assert not to_target(CHEETAH, "mass", "<= 40").moved
    for text in ("", "light", "= 3"):
        with pytest.raises(DraftError, match="is no target"):
            to_target(CHEETAH, "mass", text)
    assert between(lighter, 1.0) == {one.name: one.after for one in lighter.moved}
    assert between(lighter, 0.0) == {one.name: one.before for one in lighter.moved}


def test_values_of_one_gesture_are_one_step_of_undo() -> None:
    session = Session(Library(QUADRUPED), clock=lambda: 0.0)
    before = session.point
    for share in (0.5, 1.0):
        assert session.set_all({"thigh_length": 0.25 + 0.05 * share, TORQUE: 80.0}, "reach")
    assert session.design.parameters["thigh_length"] == pytest.approx(0.3)
    assert session.undo()
    assert session.point == before
