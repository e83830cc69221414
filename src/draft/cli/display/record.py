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
    """Return the object as text: verdict, masses, actuators, findings, timings, folder, more."""
    # Options of all commands bring this module: not all of those need MuJoCo.
    from draft.values import plain

    actuators = {
        name: {"like": actuator.like} | {key: getattr(actuator, key) for key in actuator.quantities}
        for name, actuator in design.actuators.items()
    }
    return json.dumps(
        plain(
            {
                "name": design.name,
                "design": design.label,
                "mass_kg": design.mass,
                "n_joints": len(design.joints),
                "accepted": design.accepted,
                "findings": [finding.record() for finding in design.findings],
                "actuators": actuators,
                "bodies": design.body_masses(),
                "timings_ms": {name: round(ms, 3) for name, ms in clock.laps.items()},
                "out": str(out) if out is not None else None,
                **(more or {}),
            }
        ),
        indent=2,
    )
