"""Bands of imported designs: wider than the trends' own where an import guessed.

An import records in its `import.json` what it guessed. The band of any design of that spec follows
from it, also after parameters were changed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from draft.design import Design
from draft.laws.law import quantile
from draft.values import scalar

REPORT = "import.json"
KEY = "wider_band"
SHARE = 0.9
# Standard deviation of ln(mass) of all drives together whose torques are those of surveyed joints,
# on robots left out: 0.24 for humanoids, 0.27 for quadrupeds.
GUESSED = 0.26
# That of the total, besides, where any torque is guessed: files with torques that are missing or
# implausible describe robots unlike the surveyed ones.
# By maximum likelihood over 26 robots outside the survey, 9 such and 17 with theirs removed; with
# each maker left out of the fit, the 90 % bands hold 23.
DOUBTED = 0.16
# That of the total for a robot of another build than those that its trends are fitted to.
UNLIKE = 0.40


@dataclass(frozen=True, slots=True)
class Doubts:
    """Assumptions of an import that the band of the trends does not cover.

    Attributes:
        guessed: actuator classes whose torques are those of surveyed joints.
        torques: how many torques are not the maker's, in words; "" for none.
        unlike: in what the robot is unlike those of its trends; "" for nothing.
    """

    guessed: frozenset[str] = frozenset()
    torques: str = ""
    unlike: str = ""

    def record(self) -> dict[str, Any]:
        """Return the doubts as plain data for JSON."""
        return {
            "guessed_actuators": sorted(self.guessed),
            "torques": self.torques,
            "unlike": self.unlike,
        }


@dataclass(frozen=True, slots=True)
class ExpectedMass:
    """Mass of the robot [kg] and the ends of its 90 % band; what widens that."""

    mass: float
    low: float
    high: float
    wider: tuple[str, ...]


def widened(design: Design, doubts: Doubts) -> ExpectedMass:
    """Mass of a design with the 90 % band that an import's doubts leave [kg]."""
    mass = scalar(design.mass)
    low, high = map(scalar, design.mass_band(SHARE))
    guessed = sum(
        scalar(body.actuator.mass)
        for body in design.bodies
        if body.actuator is not None and body.actuator.name in doubts.guessed
    )
    extra = (GUESSED * guessed / mass) ** 2 + (DOUBTED**2 if guessed else 0.0)
    extra += UNLIKE**2 if doubts.unlike else 0.0
    extra *= quantile(SHARE) ** 2
    below = math.sqrt(math.log(mass / low) ** 2 + extra)
    above = math.sqrt(math.log(high / mass) ** 2 + extra)
    wider = tuple(why for why in (doubts.torques if guessed else "", doubts.unlike) if why)
    return ExpectedMass(mass, mass * math.exp(-below), mass * math.exp(above), wider)


def imported_mass(design: Design) -> ExpectedMass | None:
    """Mass and band of a design whose spec was imported; None for other specs."""
    doubts = _read(Path(design.spec.folder) / REPORT)
    return None if doubts is None else widened(design, doubts)


def band(design: Design) -> tuple[float, float]:
    """Ends of the 90 % band of a design's mass [kg], as wide as its import, if any, asks for."""
    imported = imported_mass(design)
    if imported is not None:
        return imported.low, imported.high
    low, high = map(scalar, design.mass_band(SHARE))
    return low, high


def _read(file: Path) -> Doubts | None:
    """Doubts that a report records; None where there are none to read."""
    try:
        table = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    found = table.get(KEY) if isinstance(table, Mapping) else None
    if not isinstance(found, Mapping):
        return None
    guessed = found.get("guessed_actuators")
    names = guessed if isinstance(guessed, list) else []
    texts = [str(found.get(key) or "") for key in ("torques", "unlike")]
    return Doubts(frozenset(map(str, names)), *texts)
