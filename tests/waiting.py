"""Waiting in tests takes as long as it must: pytest ends a test that hangs (pyproject.toml)."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path


def until(true: Callable[[], object], pause: float = 0.02) -> None:
    """Wait until something is true.

    Args:
        true: looked at again and again.
        pause: time between two looks [s].
    """
    while not true():
        time.sleep(pause)


def alive(process: int) -> bool:
    """Whether a process runs; one that has ended and that nobody has asked about does not."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
