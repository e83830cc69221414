"""What a person sees of a robot that is bolted to the world."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks import browser as chromium

pytest.importorskip("viser", reason="needs the extra 'view'")

from draft.studio.library import Library
from draft.studio.server import Studio
from tests import fixed
from tests.studio.browser.page import mass, picture, press, push, turn_to
from tests.waiting import until

pytestmark = pytest.mark.filterwarnings("ignore")


def test_an_arm_on_a_fixed_base_is_shown_on_the_floor_and_does_not_walk(
    tmp_path: Path, browser: Any
) -> None:
    studio = Studio(Library(fixed.arm(), tmp_path / "designs"), port=0, out=tmp_path / "out")
    try:
        made = chromium.page(browser, f"http://127.0.0.1:{studio.port}/")
        made.wait_for_selector("label:has-text('forearm_length')")
        (shown, _), *_ = studio._panels.values()
        assert shown._robot.base == 0.0
        before = mass(made)
        push(made, "pedestal_mass", 5)
        until(lambda: mass(made) > before)
        picture(made, "arm")
        turn_to(made, "Pose")
        press(made, "Limp")
        until(lambda: shown._drop is not None)
        press(made, "Stop")
        made.context.close()
    finally:
        studio.close()
