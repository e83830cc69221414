"""Stop of a training by Ctrl-C or SIGTERM: after its current iteration, with all of it kept."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType

_NOTE = b"\nstopping after this iteration; Ctrl-C again stops at once, without saving it\n"


class Stop:
    """Request to stop.

    Attributes:
        asked: whether a signal has asked for it.
    """

    def __init__(self) -> None:
        self.asked = False

    def __call__(self) -> bool:
        """Return whether to stop."""
        return self.asked


@contextlib.contextmanager
def stopping(forward: Callable[[], bool] = lambda: True) -> Iterator[Stop]:
    """Turn the first Ctrl-C or SIGTERM into a request, for as long as the block runs.

    A second one raises KeyboardInterrupt at once. Signals are handled in a process's main thread
    only: elsewhere nothing changes. Signals that the process ignores stay ignored.

    Args:
        forward: called with the first signal; returns whether the request can be met, otherwise
            KeyboardInterrupt is raised at once.

    Raises:
        KeyboardInterrupt: at the end of the block, if a signal came.
    """
    stop, before = Stop(), {}

    def handle(number: int, frame: FrameType | None) -> None:
        if stop.asked or not forward():
            raise KeyboardInterrupt
        stop.asked = True
        # A signal may come while Python writes: its own streams cannot be used here.
        os.write(2, _NOTE)

    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                before[number] = signal.signal(number, handle)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if stop.asked:
        raise KeyboardInterrupt
