"""Gamepads of browsers, which viser cannot read: a small page in a frame of the panel sends them.

The left stick commands forwards and sideways, the right one turns, and the shoulder buttons push.
The frame sends each change as a request whose path starts with a secret of the tab, so that no
other page can steer.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Callable
from importlib.resources import files
from typing import NamedTuple

from draft.webpage import webpage

_STYLE = "body{margin:0 8px;font:12px/20px system-ui,sans-serif;color:#868e96;white-space:nowrap;"
_STYLE += "overflow:hidden;text-overflow:ellipsis}"
_BODY = '<span title="left stick: walk; right stick: turn; shoulder buttons: push">Gamepad: '
_BODY += '<span id="state"></span></span>'
_PERCENT = "(-?(?:100|[0-9]{1,2}))"
_MOVED = re.compile(rf"/{_PERCENT}/{_PERCENT}/{_PERCENT}/(-1|0|1)")


class Sticks(NamedTuple):
    """State of a gamepad.

    Attributes:
        forward, left, turn: shares of the largest commands, from -1 to 1.
        push: 1 to the left and -1 to the right, if a button was pressed since; else 0.
    """

    forward: float
    left: float
    turn: float
    push: int


class Gamepad:
    """The gamepad of a browser tab.

    Attributes:
        path: URL path of its page, which is secret.
    """

    def __init__(self, moved: Callable[[Sticks], object]) -> None:
        """Prepare the page.

        Args:
            moved: called with each new state, in any thread.
        """
        self.path = f"/gamepad/{secrets.token_urlsafe(16)}"
        self._moved = moved

    @property
    def frame(self) -> str:
        """HTML of the frame that shows the page in a panel."""
        style = "border:0;width:100%;height:20px"
        return (
            f'<iframe src="{self.path}" title="gamepad" allow="gamepad" style="{style}"></iframe>'
        )

    def page(self, path: str) -> str | None:
        """HTML of a URL path, or None if it is none of this gamepad's.

        The paths below that of the page are its messages.
        """
        if path == self.path:
            script = files("draft.serving").joinpath("gamepad.js").read_text("utf-8")
            return webpage("Gamepad", _STYLE, _BODY, [script], requests=True)
        if not path.startswith(self.path):
            return None
        found = _MOVED.fullmatch(path.removeprefix(self.path))
        if found is None:
            return None
        *shares, push = (int(text) for text in found.groups())
        forward, left, turn = (share / 100 for share in shares)
        self._moved(Sticks(forward, left, turn, push))
        return ""
