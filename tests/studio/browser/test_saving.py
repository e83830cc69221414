"""A design that is saved, loaded, exported and reported."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.studio.browser.page import enter, load, mass, picture, press, push, turn_to, visit
from tests.waiting import until

if TYPE_CHECKING:
    from draft.studio.server import Studio

pytestmark = pytest.mark.filterwarnings("ignore")


def test_a_design_is_saved_loaded_exported_and_reported(
    tab: Any, browser: Any, studio: Studio, address: str, folder: Path
) -> None:
    push(tab, "thigh_length", 9)
    until(lambda: "1 changed" in tab.inner_text("body"))
    turn_to(tab, "Save")
    enter(tab, studio, "name", "mine")
    press(tab, "Save as named design")
    until((folder / "mine.yaml").is_file)
    until(lambda: "changed" not in tab.inner_text("body"))
    saved = mass(tab)
    press(tab, "Export MuJoCo model")
    until((folder.parent / "out" / "mine" / "robot.xml").is_file)
    picture(tab, "saved")
    with tab.context.expect_page() as found:
        tab.get_by_text("Open the report").click()
    report = found.value
    report.wait_for_load_state()
    assert f"{saved:.1f}" in report.inner_text("body")
    picture(report, "report")
    other = visit(browser, address)
    assert mass(other) != saved
    load(other, "mine")
    until(lambda: mass(other) == saved)
    other.context.close()
