"""Effects at the sliders, a metric that is held, and a target."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.studio.browser.page import choose, enter, mass, picture, press, push, turn_to
from tests.waiting import until

if TYPE_CHECKING:
    from draft.studio.server import Studio

pytestmark = pytest.mark.filterwarnings("ignore")


def test_sliders_show_their_effect_a_held_metric_stays_and_a_target_is_reached(
    tab: Any, studio: Studio
) -> None:
    before = mass(tab)
    turn_to(tab, "Levers")
    choose(tab, "effect on", "jump_height")
    turn_to(tab, "Parameters")
    until(lambda: tab.locator("label:has-text('no_load_speed [rad/s] ▲')").count() == 1)
    turn_to(tab, "Levers")
    choose(tab, "hold", "mass")
    choose(tab, "by", "trunk_length")
    until(lambda: tab.locator("#ds-levers").count() == 0)
    turn_to(tab, "Parameters")
    push(tab, "thigh_length", 5)
    until(lambda: "holds mass" in tab.inner_text("#ds-levers"))
    assert mass(tab) == before
    picture(tab, "held")
    turn_to(tab, "Levers")
    enter(tab, studio, "target", "0.4")
    press(tab, "Reach")
    until(lambda: "reached by" in tab.inner_text("#ds-levers"))
    picture(tab, "levers")
    turn_to(tab, "Parameters")
    until(lambda: tab.locator("label:has-text('● no_load_speed')").count() == 1)
    picture(tab, "reached")
    press(tab, "Undo")
    until(lambda: tab.locator("label:has-text('● no_load_speed')").count() == 0)
    assert tab.locator("label:has-text('● thigh_length')").count() == 1
