"""What a person does in the page of the studio, of 1280 x 720, and reads there.

With DRAFT_PICTURES=1, pictures of each state are kept in `build/studio/`, for a look.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks import browser as chromium
from tests.waiting import until

if TYPE_CHECKING:
    from draft.studio.server import Studio

PICTURES = Path(__file__).resolve().parents[3] / "build" / "studio"


def visit(browser: Any, address: str) -> Any:
    """A tab whose fields are there to be used."""
    made = chromium.page(browser, address)
    made.wait_for_selector("label:has-text('trunk_height')")
    return made


def mass(tab: Any) -> float:
    return float(tab.inner_text("#ds-mass").split()[0])


def enter(tab: Any, studio: Studio, label: str, text: str) -> None:
    """Fill a field, and wait until the server has it, which the page sends a little later."""
    (shown, _), *_ = studio._panels.values()
    chromium.field(tab, label).fill(text)
    handles = shown._client.gui._gui_input_handle_from_uuid
    until(lambda: (label, text) in [(one.label, one.value) for one in list(handles.values())])


def picture(tab: Any, name: str) -> None:
    if "DRAFT_PICTURES" not in os.environ:
        return
    PICTURES.mkdir(parents=True, exist_ok=True)
    close = tab.get_by_text("Software WebGL rendering detected")
    if close.count():
        tab.evaluate(
            "document.querySelectorAll('[role=alert] button').forEach(button => button.click())"
        )
    time.sleep(1.5)
    tab.screenshot(path=PICTURES / f"{name}.png")


def press(tab: Any, name: str) -> None:
    tab.get_by_role("button", name=name, exact=True).click()


def turn_to(tab: Any, name: str) -> None:
    tab.get_by_role("tab", name=name, exact=True).click()


def push(tab: Any, label: str, times: int = 1) -> None:
    thumb = chromium.slider(tab, label)
    for _ in range(times):
        thumb.press("ArrowRight")


def load(tab: Any, name: str) -> None:
    chromium.field(tab, "design").click()
    tab.get_by_role("option", name=name).click()


def choose(tab: Any, label: str, name: str) -> None:
    chromium.field(tab, label).click()
    tab.get_by_role("option", name=name, exact=True).click()


def walker(studio: Studio) -> Any:
    (shown, _), *_ = studio._panels.values()
    return shown._walker


def walk(tab: Any) -> None:
    turn_to(tab, "Walk")
    tab.get_by_label("Walk", exact=True).last.click()
