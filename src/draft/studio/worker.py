"""One thread for each tab: does what was asked in order, and drops what was overtaken."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable


class Worker:
    """Runs wishes one after the other.

    A wish that waits is replaced by a later one of the same key: of a slider that moves faster
    than it can be followed, only the newest value is worked out.
    """

    def __init__(self, after: Callable[[], None], idle: Callable[[], float | None]) -> None:
        """Start.

        Args:
            after: called when all that waited is done.
            idle: called when nothing waits; returns the time until it wants to be called again
                [s], or None.
        """
        self._after, self._idle = after, idle
        self._waiting: dict[str, Callable[[], None]] = {}
        self._condition = threading.Condition()
        self._open = True
        self._thread = threading.Thread(target=self._run, name="draft-studio-tab", daemon=True)
        self._thread.start()

    def ask(self, key: str, wish: Callable[[], None]) -> None:
        """Have something done; it replaces what waits under the same key."""
        with self._condition:
            # Taken out first, so that wishes run in the order in which they were last asked.
            self._waiting.pop(key, None)
            self._waiting[key] = wish
            self._condition.notify()

    def waits(self, key: str) -> bool:
        """Whether a newer wish of this key waits."""
        return key in self._waiting

    def close(self) -> None:
        """End the thread after what it does now."""
        with self._condition:
            self._open = False
            self._condition.notify()

    def _run(self) -> None:
        pause: float | None = None
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._waiting or not self._open, pause)
                if not self._open:
                    return
                wishes, self._waiting = list(self._waiting.values()), {}
            try:
                for wish in wishes:
                    wish()
                if wishes:
                    self._after()
                pause = self._idle()
            except Exception:
                # A fault must not leave a tab dead: it is told where Draft was started.
                traceback.print_exc()
                pause = None
