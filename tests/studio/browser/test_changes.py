"""Changes of a design: sliders, findings, values that are refused, motors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks import browser as chromium

pytest.importorskip("viser", reason="needs the extra 'view'")

from draft.studio.library import Library
from draft.studio.server import Studio
from tests.studio.browser.page import enter, mass, picture, press, push, turn_to
from tests.studio.robots import with_motor_of_its_own
from tests.waiting import until

pytestmark = pytest.mark.filterwarnings("ignore")


def test_a_slider_moves_the_mass_and_undo_brings_it_back(tab: Any) -> None:
    before = mass(tab)
    picture(tab, "start")
    push(tab, "thigh_length", 5)
    until(lambda: mass(tab) > before)
    until(lambda: "1 changed" in tab.inner_text("body"))
    until(lambda: tab.locator("label:has-text('● thigh_length')").count() == 1)
    picture(tab, "changed")
    press(tab, "Undo")
    until(lambda: mass(tab) == before)
    assert tab.locator("label:has-text('●')").count() == 0
    press(tab, "Redo")
    until(lambda: mass(tab) > before)
    press(tab, "reset to 0.25 m")
    until(lambda: mass(tab) == before)


def test_a_finding_is_told_with_its_limit_and_the_way_to_allow_it(tab: Any) -> None:
    turn_to(tab, "Parameters")
    chromium.field(tab, "peak_torque").fill("280")
    until(lambda: tab.inner_text("#ds-verdict") == "refused")
    text = tab.inner_text("body")
    assert "error: torque" in text
    assert "torque:leg" in text
    assert "parameters.yaml" in text
    picture(tab, "refused")
    turn_to(tab, "Trends")
    picture(tab, "trends")
    turn_to(tab, "Actuators")
    picture(tab, "actuators")


def test_a_bad_value_is_explained_and_the_last_good_robot_stays(tab: Any, studio: Studio) -> None:
    before = mass(tab)
    turn_to(tab, "Expression")
    enter(tab, studio, "value", "1 / (thigh_length - thigh_length)")
    press(tab, "Apply")
    until(lambda: tab.locator("#ds-message").count() == 1)
    assert "last valid robot" in tab.inner_text("#ds-message")
    assert mass(tab) == before
    picture(tab, "bad_value")
    enter(tab, studio, "value", "1.5 * shank_length")
    press(tab, "Apply")
    until(lambda: tab.locator("#ds-message").count() == 0)
    until(lambda: mass(tab) > before)


def test_a_motor_of_ones_own_is_shown_and_another_is_chosen(browser: Any, tmp_path: Path) -> None:
    spec = with_motor_of_its_own(tmp_path / "jumper")
    studio = Studio(Library(spec), port=0, out=tmp_path / "out")
    tab = chromium.page(browser, f"http://127.0.0.1:{studio.port}/")
    try:
        tab.wait_for_selector("label:has-text('body_height')")
        before = mass(tab)
        turn_to(tab, "Parameters")
        assert chromium.field(tab, "like").input_value() == "S-40"
        chromium.field(tab, "like").click()
        tab.get_by_role("option", name="S-80").click()
        until(lambda: mass(tab) > before)
    finally:
        tab.context.close()
        studio.close()
