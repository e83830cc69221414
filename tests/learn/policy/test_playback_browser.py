"""The page of a shipped policy in a real browser: sliders and a gamepad steer it."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks.browser import tab as new_tab

pytest.importorskip("mjviser")

import draft
from draft.learn.policy.playback import Playback, Scenario
from draft.learn.policy.playback_page import PlaybackPage
from tests import gamepad
from tests.waiting import until

pytestmark = pytest.mark.filterwarnings("ignore")


def test_a_gamepad_steers_and_kicks_a_shipped_policy(
    browser: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    design = draft.load("quadruped").resolve("cheetah")
    shown = Playback(draft.policy("cheetah", "walk"), design, Scenario((0.0, 0.0, 0.0)))
    page = PlaybackPage(shown, "127.0.0.1", 0, None)
    kicks: list[float] = []
    monkeypatch.setattr(shown, "push", kicks.append)
    tab = new_tab(browser)
    try:
        tab.add_init_script(gamepad.FAKE)
        tab.goto(f"http://127.0.0.1:{page.port}/")
        tab.wait_for_selector("iframe[title=gamepad]")
        gamepad.hold(tab, [0, -1, 0, 0], 5)
        until(lambda: shown.command == pytest.approx((shown.policy.forward, 0.0, 0.0), abs=0.03))
        until(lambda: kicks == [2.0])
        gamepad.hold(tab, [0, 0, 0, 0])
        until(lambda: shown.command == (0.0, 0.0, 0.0))
    finally:
        tab.context.close()
        page.close()
    assert kicks == [2.0]
