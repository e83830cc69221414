"""A design as one JSON object with timings; scripts rely on the keys."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from draft.design import Design


class Clock:
    """Stopwatch for the steps of a command.

    Attributes:
        laps: time of each step [ms].
    """

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        """Record the time since the last step."""
        now = time.perf_counter()
        self.laps[name] = (now - self._last) * 1e3
        self._last = now


def record(
    design: Design, clock: Clock, out: Path | None, more: Mapping[str, Any] | None = None
) -> str:
    """Return the object as text: that of `summary`, timings, folder, more."""
    # Options of all commands bring this module: not all of those need MuJoCo.
    from draft.design.report import summary
    from draft.values import plain

    return json.dumps(
        {
            **summary(design),
            "timings_ms": {name: round(ms, 3) for name, ms in clock.laps.items()},
            "out": str(out) if out is not None else None,
            **plain(more or {}),
        },
        indent=2,
    )
