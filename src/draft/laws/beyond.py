"""Errors of predicted masses beyond the data of the laws, which widen the bands there.

The actuator laws end at the weakest module of the catalogue, 4.1 N m. Below, servos and gearmotors
are lighter than the laws say; the laws stay as they are, and their bands hold such actuators.
Coefficients: `draft.fitting.beyond`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from draft.laws.law import Law

FILE = Path(__file__).resolve().parent / "data" / "beyond.json"


@dataclass(frozen=True, slots=True)
class Beyond:
    """Standard deviations of ln(true / predicted) beyond the data of the laws.

    Attributes:
        mass: of the mass of an actuator, from its peak torque [N m].
        volume: the same of its volume.
        without_legs: of the mass of a robot without legs; its `sigma`.
    """

    mass: Law
    volume: Law
    without_legs: Law


@lru_cache(maxsize=1)
def beyond() -> Beyond:
    """Return the shipped errors."""
    record = json.loads(FILE.read_text(encoding="utf-8"))
    return Beyond(**{name: Law.read(name, law) for name, law in record.items()})
