"""Bands of imported designs: wider than the trends' own where an import guessed.

An import records in its `import.json` what it guessed, and how far its own torques are from holding
the predicted mass. The band of any design of that spec follows from it, also after parameters were
changed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from draft.design import Design
from draft.design.bands import small_actuators, wider
from draft.design.plan import plan
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
        unlike_sigma: standard deviation of ln(mass) of robots that are.
        overload: torque of standing over peak torque of the joint that holds least, at the mass
            that the import predicts; 1 for a robot that stands.
    """

    guessed: frozenset[str] = frozenset()
    torques: str = ""
    unlike: str = ""
    unlike_sigma: float = UNLIKE
    overload: float = 1.0

    def record(self) -> dict[str, Any]:
        """Return the doubts as plain data for JSON."""
        return {
            "guessed_actuators": sorted(self.guessed),
            "torques": self.torques,
            "unlike": self.unlike,
            "unlike_sigma": self.unlike_sigma,
            "overload": self.overload,
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
    guessed = sum(
        scalar(body.actuator.mass)
        for body in design.bodies
        if body.actuator is not None and body.actuator.name in doubts.guessed
    )
    extra = (GUESSED * guessed / mass) ** 2 + (DOUBTED**2 if guessed else 0.0)
    extra += doubts.unlike_sigma**2 if doubts.unlike else 0.0
    own = design.mass_band(SHARE)
    low, high = map(scalar, wider(mass, own, quantile(SHARE) * math.sqrt(extra)) if extra else own)
    # It stands, so it weighs at most what its torques hold.
    low /= doubts.overload
    why = (doubts.torques if guessed else "", doubts.unlike, _overload(doubts), *small(design))
    return ExpectedMass(mass, low, high, tuple(filter(None, why)))


def small(design: Design) -> tuple[str, ...]:
    """Why the band of a design with weak actuators is wider, in words; empty without them."""
    share = sum(scalar(share) for share, _ in small_actuators(design))
    if not share:
        return ()
    least = plan(design.spec).laws.trends["mass"].ranges["peak_torque"][0]
    of = f"{100 * share:.0f} % of its actuators, by mass, are below {least:g} N m"
    return (f"{of}, where servos are lighter than the trends say",)


def _overload(doubts: Doubts) -> str:
    """Why a robot that its own torques cannot hold is lighter than predicted, in words."""
    if doubts.overload <= 1:
        return ""
    return f"standing takes {doubts.overload:.2g} times its peak torques at that mass"


def mass_with_band(design: Design) -> ExpectedMass:
    """Mass and band of a design, as wide as the import of its spec, if any, asks for."""
    folder = design.spec.folder
    return widened(design, _read(folder / REPORT) if folder else Doubts())


def band(design: Design) -> tuple[float, float]:
    """Ends of the 90 % band of a design's mass [kg], as wide as its import, if any, asks for."""
    found = mass_with_band(design)
    return found.low, found.high


def _read(file: Path) -> Doubts:
    """Doubts that a report records; none where there is none to read."""
    try:
        table = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return Doubts()
    found = table.get(KEY) if isinstance(table, Mapping) else None
    if not isinstance(found, Mapping):
        return Doubts()
    guessed = found.get("guessed_actuators")
    names = guessed if isinstance(guessed, list) else []
    torques, unlike = (str(found.get(key) or "") for key in ("torques", "unlike"))
    sigma, overload = (
        float(x) if isinstance(x, (int, float)) and least <= x < math.inf else least
        for x, least in ((found.get("unlike_sigma"), UNLIKE), (found.get("overload"), 1.0))
    )
    return Doubts(frozenset(map(str, names)), torques, unlike, sigma, overload)
