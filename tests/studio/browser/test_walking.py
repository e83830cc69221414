"""A robot that walks in the page, and what steers it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from benchmarks import browser as chromium
from tests import gamepad
from tests.studio.browser.page import mass, picture, press, push, turn_to, walk, walker
from tests.waiting import until

if TYPE_CHECKING:
    from draft.studio.server import Studio

pytestmark = pytest.mark.filterwarnings("ignore")


def test_the_robot_walks_on_while_a_slider_changes_its_legs(tab: Any, studio: Studio) -> None:
    said: list[str] = []
    tab.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
    tab.on("pageerror", lambda error: said.append(str(error)))
    walk(tab)
    until(lambda: walker(studio).walk is not None and walker(studio).walk.data.time > 0.5)
    until(lambda: tab.locator(".ds-dot").count() == 1)
    picture(tab, "walking")
    before, walking = mass(tab), walker(studio).walk
    push(tab, "thigh_length")  # one step: several are several steps of undo on a slow machine
    until(lambda: mass(tab) > before)
    until(lambda: tab.get_by_text("Policy of the family of quadrupeds.").count() == 1)
    assert walker(studio).walk is walking
    picture(tab, "walking_longer")
    tab.keyboard.press("k")
    until(lambda: walker(studio).command[0] == pytest.approx(0.7))
    until(lambda: chromium.field(tab, "forward").input_value() == "0.7")
    press(tab, "From the left")
    tab.keyboard.press("Control+z")
    until(lambda: mass(tab) == before)
    until(lambda: tab.get_by_text("Policy of quadruped:cheetah.").count() == 1)
    turn_to(tab, "Pose")
    press(tab, "Home")
    until(lambda: not walker(studio).on)
    until(lambda: not tab.get_by_label("Walk", exact=True).last.is_checked())
    assert said == []


def test_a_gamepad_steers_and_pushes_the_robot(browser: Any, address: str, studio: Studio) -> None:
    shown = chromium.tab(browser, viewport={"width": 1280, "height": 720})
    shown.add_init_script(gamepad.FAKE)
    shown.goto(address)
    shown.wait_for_selector("#ds-mass")
    said: list[str] = []
    shown.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
    walk(shown)
    until(lambda: walker(studio).walk is not None)
    robot = walker(studio)
    gamepad.hold(shown, [0, -1, 0.575, 0])
    until(lambda: robot.command == pytest.approx((robot.most[0], 0.0, -0.5), abs=0.01))
    until(lambda: chromium.field(shown, "forward").input_value() == f"{robot.most[0]:g}")
    frame = shown.frame_locator("iframe[title=gamepad]")
    until(lambda: frame.locator("#state").inner_text() == "Test pad")
    shown.locator("iframe[title=gamepad]").scroll_into_view_if_needed()
    picture(shown, "gamepad")
    pushed: list[float] = []
    robot.push = lambda size, left=True: pushed.append(size if left else -size)
    gamepad.hold(shown, [0, 0, 0, 0], gamepad.RIGHT_SHOULDER)
    until(lambda: pushed == [1.5])
    gamepad.hold(shown, [0, 0, 0, 0], gamepad.LEFT_SHOULDER)
    until(lambda: len(pushed) == 2)
    assert robot.command == (0.0, 0.0, 0.0)
    assert pushed == [1.5, -1.5]
    assert said == []
    shown.context.close()
