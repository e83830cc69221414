"""What a person sees of the robot and of the sliders."""

from __future__ import annotations

import io
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import draft
from benchmarks import browser as chromium

pytest.importorskip("viser", reason="needs the extra 'view'")

from PIL import Image

from draft.studio.library import Library
from draft.studio.server import Studio
from tests.studio.browser.page import picture, walk
from tests.waiting import until

pytestmark = pytest.mark.filterwarnings("ignore")

# Sliders of which a person sees the thumb: nothing covers it, and it is inside the window.
SEEN = """() => [...document.querySelectorAll('[role=slider]')].filter((thumb) => {
  const box = thumb.getBoundingClientRect();
  const top = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
  return top !== null && (top === thumb || top.closest('.mantine-Slider-root')?.contains(thumb));
}).length"""


@pytest.mark.parametrize("robot", ["quadruped", "humanoid"])
def test_ten_sliders_are_seen_without_scrolling(robot: str, browser: Any, tmp_path: Path) -> None:
    studio = Studio(Library(draft.load(robot), tmp_path / "designs"), port=0)
    tab = chromium.tab(browser, viewport={"width": 1280, "height": 800})
    try:
        tab.goto(f"http://127.0.0.1:{studio.port}/")
        tab.wait_for_selector("label:has-text('thigh_length')")
        until(lambda: tab.evaluate(SEEN) >= 10)
        assert chromium.slider(tab, "thigh_length").is_visible()
        assert tab.locator("canvas").first.bounding_box()["width"] >= 0.69 * 1280
        picture(tab, f"sliders_{robot}")
    finally:
        tab.context.close()
        studio.close()


def test_the_robot_has_a_shadow_on_the_floor_that_follows_it(tab: Any, studio: Studio) -> None:
    canvas = tab.locator("canvas").first.bounding_box()

    def seen() -> np.ndarray:
        shot = tab.screenshot(clip=canvas)
        return np.asarray(Image.open(io.BytesIO(shot)).convert("L"), int)

    (shown, _), *_ = studio._panels.values()
    until(lambda: shown._robot._shadow is not None)
    standing: Any = shown._robot._shadow
    until(lambda: np.array_equal(seen(), seen()))  # the camera has moved to the robot
    with_shadow = seen()
    standing.visible = False
    until(lambda: not np.array_equal(seen(), with_shadow))
    gained = seen() - with_shadow
    assert (gained > 30).sum() > 2000
    assert (gained < -30).sum() < 100
    standing.visible = True
    before = standing.vertices.copy()
    walk(tab)
    until(lambda: not np.array_equal(standing.vertices, before))


def test_most_of_the_window_shows_the_robot_and_a_click_tells_of_a_link(
    tab: Any, studio: Studio
) -> None:
    canvas = tab.locator("canvas").first.bounding_box()
    assert canvas["width"] >= 0.6 * 1280
    (shown, _), *_ = studio._panels.values()
    until(lambda: shown._robot.model is not None)
    picture(tab, "before_click")

    def clicked() -> bool:
        # The camera moves to the robot a little after the page is there.
        tab.mouse.click(canvas["x"] + canvas["width"] / 2, canvas["y"] + 0.44 * canvas["height"])
        time.sleep(0.5)
        return tab.locator("#ds-link").count() == 1

    until(clicked)
    assert "Link" in tab.inner_text("#ds-link")
    assert "kg" in tab.inner_text("body")
    picture(tab, "link")
