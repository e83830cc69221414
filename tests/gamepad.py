"""A gamepad that a test holds, for pages in a real browser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

LEFT_SHOULDER, RIGHT_SHOULDER = 4, 5
# For Playwright's `add_init_script`: frames get the gamepad of the page around them.
FAKE = "navigator.getGamepads = () => (top.gamepad ? [top.gamepad] : [])"
_BUTTONS = 16


def hold(tab: Any, axes: Sequence[float], down: int | None = None) -> None:
    """Move the sticks and press a button.

    Args:
        tab: the page.
        axes: left stick to the right and down, right stick to the right and down, from -1 to 1.
        down: index of the pressed button, by the standard mapping; None for none.
    """
    buttons = [{"pressed": index == down} for index in range(_BUTTONS)]
    pad = {"id": "Test pad", "connected": True, "mapping": "standard"}
    pad |= {"axes": list(axes), "buttons": buttons}
    tab.evaluate("pad => { top.gamepad = pad }", pad)
