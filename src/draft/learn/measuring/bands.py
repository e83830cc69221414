"""How far capabilities err because masses are predicted: bands of real robots.

`python -m benchmarks.real_robots` writes the file: for each capability the fold within which nine
of ten real quadrupeds have it by predicted masses and by those of their makers, by the same policy
and seed. They hold the chance of 16 roll-outs too, which is much of that of a kick.
docs/real-robots.md has the robots.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from draft.metrics.capabilities import CAPABILITIES

FILE = Path(__file__).with_name("mass_bands.json")
# Capabilities of evaluations, and those of real robots that tell of them.
_OF = {
    "step": "step_up",
    "step_ascent": "step_up",
    "walk_cost_of_transport": "cost_of_transport",
    "cost_of_transport": "",  # At top speed; that of real robots is of a walk.
}


class MassBand(NamedTuple):
    """Band of a capability.

    Attributes:
        fold: factor within which it is for `share` of the robots.
        robots: number of robots that it rests on.
        share: 0.9.
    """

    fold: float
    robots: int
    share: float = 0.9


def mass_band(capability: str) -> MassBand | None:
    """Band of a capability by its name in `CAPABILITIES`; None if no robots tell of it."""
    return _bands().get(_OF.get(capability, capability))


def mass_bands(capabilities: Iterable[str]) -> str:
    """Sentence with the bands of some capabilities; "" if there is none."""
    found = [(name, mass_band(name)) for name in capabilities]
    known = [(CAPABILITIES[name].label, band) for name, band in found if band is not None]
    if not known:
        return ""
    words = ", ".join(f"{label} within {band.fold:.2f}" for label, band in known)
    least = min(band.robots for _, band in known)
    return (
        f"masses are predictions, for nine of ten real quadrupeds good to: {words} ({least} robots)"
    )


@lru_cache(maxsize=1)
def _bands() -> dict[str, MassBand]:
    record = json.loads(FILE.read_text(encoding="utf-8"))
    return {name: MassBand(of["fold_90"], of["robots"]) for name, of in record.items()}
