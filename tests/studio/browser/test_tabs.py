"""Two tabs at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.studio.browser.page import mass, push, visit, walk, walker
from tests.waiting import until

if TYPE_CHECKING:
    from draft.studio.server import Studio

pytestmark = pytest.mark.filterwarnings("ignore")


def test_two_tabs_do_not_disturb_each_other(tab: Any, browser: Any, address: str) -> None:
    other = visit(browser, address)
    before = mass(tab)
    push(other, "trunk_length", 10)
    until(lambda: mass(other) > before)
    push(tab, "thigh_length", 3)
    until(lambda: mass(tab) != before)
    assert "1 changed" in tab.inner_text("body")
    assert tab.locator("label:has-text('● trunk_length')").count() == 0
    until(lambda: other.locator("label:has-text('● trunk_length')").count() == 1)
    assert other.locator("label:has-text('● thigh_length')").count() == 0
    other.context.close()
    push(tab, "thigh_length", 3)
    until(lambda: "1 changed" in tab.inner_text("body"))


def test_a_walk_ends_with_its_tab_and_others_go_on(
    tab: Any, browser: Any, studio: Studio, address: str
) -> None:
    walk(tab)
    until(lambda: walker(studio).walk is not None)
    (shown, _), *_ = studio._panels.values()
    other = visit(browser, address)
    until(lambda: len(studio._panels) == 2)
    second = next(one for one, _ in studio._panels.values() if one is not shown)
    assert not second._walker.on
    walk(other)
    until(lambda: second._walker.walk is not None)
    first_walk, second_walk = shown._walker.walk, second._walker.walk
    assert first_walk is not None
    assert second_walk is not None
    other.context.close()
    until(lambda: not second._tasks._thread.is_alive())
    stopped, now = second_walk.data.time, first_walk.data.time
    until(lambda: first_walk.data.time > now + 0.3)
    assert second_walk.data.time == stopped
