"""Expected mass of an imported robot, with a band that knows what was guessed.

The trends' own band (`Design.mass_band`) holds for robots like the surveyed ones, with torques that
their makers declare. Held out of the survey with all torques removed, 76 % of humanoids lie in it,
and with the population of the other kind 34 %; with the errors below, 93 % and 90 % do
(`docs/twins.md`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from draft.design import Design
from draft.fitting.structure.torques import torque_laws
from draft.imports.drives import leg_length
from draft.imports.importer import Files
from draft.laws.law import quantile
from draft.values import scalar

SHARE = 0.9
# Standard deviation of ln(mass) of all drives together whose torques are those of surveyed joints,
# on robots left out: 0.24 for humanoids, 0.27 for quadrupeds.
GUESSED = 0.26
# That of the total for a robot of another build than those that its trends are fitted to.
UNLIKE = 0.40
LEGS = {"humanoid": 2, "quadruped": 4}
# Legs longer or shorter than the surveyed ones by this factor are another build.
BEYOND = 1.25


@dataclass(frozen=True, slots=True)
class ExpectedMass:
    """Mass of the robot [kg] and the ends of its 90 % band; what widens that."""

    mass: float
    low: float
    high: float
    wider: tuple[str, ...]


def expected_mass(design: Design, files: Files) -> ExpectedMass:
    """Mass of an imported design, with its 90 % band.

    Args:
        design: what the import's spec resolves to.
        files: the import.
    """
    mass = scalar(design.mass)
    low, high = map(scalar, design.mass_band(SHARE))
    wider: list[str] = []
    extra = 0.0
    guessed = _guessed_mass(design, files)
    if guessed:
        count = sum(one.guessed for one in files.drives.values())
        extra += (GUESSED * guessed / mass) ** 2
        wider.append(f"{count} of {len(files.drives)} torques are not the maker's")
    unlike = _unlike(files)
    if unlike:
        extra += UNLIKE**2
        wider.append(unlike)
    extra *= quantile(SHARE) ** 2
    below = math.sqrt(math.log(mass / low) ** 2 + extra)
    above = math.sqrt(math.log(high / mass) ** 2 + extra)
    return ExpectedMass(mass, mass * math.exp(-below), mass * math.exp(above), tuple(wider))


def _guessed_mass(design: Design, files: Files) -> float:
    """Mass of the drives whose torques are those of surveyed joints [kg]."""
    return sum(
        scalar(body.actuator.mass)
        for body in design.bodies
        if body.actuator is not None and body.actuator.name in files.guessed
    )


def _unlike(files: Files) -> str:
    """In what the robot is unlike those that its trends are fitted to; "" for nothing."""
    people, legs = files.population, files.limbs.legs
    if not legs:
        return "the surveyed robots have legs"
    if legs != LEGS[people]:
        return f"surveyed {people}s have {LEGS[people]} legs, not {legs}"
    leg = leg_length(files.reduced)
    laws = torque_laws(people).values()
    low, high = min(law.legs[0] for law in laws), max(law.legs[1] for law in laws)
    if leg and not low / BEYOND <= leg <= high * BEYOND:
        return f"its legs of {leg:.2g} m are outside the surveyed {low:.2g} to {high:.2g} m"
    return ""
