"""A worker thread per tab: it runs tasks in order and drops those that newer ones replace."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable

Task = Callable[[], None]


class TaskThread:
    """Runs tasks one after the other.

    A waiting task is replaced by a later one of the same key: of a slider that moves faster than
    its robot can be resolved, only the newest value is resolved.
    """

    def __init__(self, after: Task, idle: Callable[[], float | None]) -> None:
        """Start the thread.

        Args:
            after: called when all waiting tasks are done.
            idle: called when no task waits; returns the time until its next call [s], or None.
        """
        self._after, self._idle = after, idle
        self._waiting: dict[str, Task] = {}
        self._condition = threading.Condition()
        self._open = True
        self._thread = threading.Thread(target=self._run, name="draft-studio-tab", daemon=True)
        self._thread.start()

    def submit(self, key: str, task: Task) -> None:
        """Queue a task; it replaces the waiting task of the same key."""
        with self._condition:
            # Removed first, so that tasks run in the order of their last submission.
            self._waiting.pop(key, None)
            self._waiting[key] = task
            self._condition.notify()

    def waits(self, key: str) -> bool:
        """Tell whether a task of this key waits."""
        return key in self._waiting

    def shows(self) -> None:
        """Show the state between two steps of a task."""
        self._after()

    def close(self) -> None:
        """End the thread after its current task."""
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
                tasks, self._waiting = list(self._waiting.values()), {}
            try:
                for task in tasks:
                    task()
                if tasks:
                    self._after()
                pause = self._idle()
            except Exception:
                # The tab must keep working; the fault is printed where Draft was started.
                traceback.print_exc()
                pause = None
