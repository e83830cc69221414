"""What a command that is interrupted with Ctrl-C keeps, and how to go on."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

AGAIN = "the same command resumes"
FROM_START = "the same command starts again"
NOTHING = f"nothing is written, and what was there is kept; {FROM_START}"


@contextlib.contextmanager
def if_interrupted(kept: str | Callable[[], str]) -> Iterator[None]:
    """Let Ctrl-C in the block end the command with a line on what is kept.

    Args:
        kept: the line, or a function that returns it, called after Ctrl-C.
    """
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(kept if isinstance(kept, str) else kept()) from None
