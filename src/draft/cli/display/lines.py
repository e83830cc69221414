"""Progress as lines on stderr, for a log or a pipe."""

from __future__ import annotations

import sys
import time

from draft.learn.training.progress import LINE_SECONDS, clock


class Lines:
    """Progress of a command without a terminal: a line every few seconds."""

    def __init__(self, what: str, at_once: bool = False) -> None:
        """Begin; `at_once` prints a line for 0 as well, where the first step takes minutes."""
        self._what, self._at_once = what, at_once
        self._began = self._printed = time.monotonic()

    def tell(self, done: int, total: int) -> None:
        """Print how many are done, unless the last line is too recent."""
        now = time.monotonic()
        if not (self._at_once and done == 0) and now - self._printed < LINE_SECONDS:
            return
        self._printed = now
        left = (now - self._began) / done * (total - done) if done else None
        text = f"{self._what}: {done:,} of {total:,}"
        text += f", left {clock(left)}" if left is not None else ""
        print(text, file=sys.stderr, flush=True)
