"""Expected mass of an imported robot, with a band that knows what was guessed.

The trends' own band (`Design.mass_band`) holds for robots like the surveyed ones, with torques that
their makers declare. Held out of the survey with all torques removed, 26 of 29 humanoids lie in it,
and with the population of the other kind 11; in the band of `draft.design.widened`, all do
(`docs/twins.md`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from draft.design import Design
from draft.design.loads import home_loads, loads
from draft.design.widened import UNLIKE, Doubts, ExpectedMass, widened
from draft.imports.drives import leg_length
from draft.imports.volumes import is_slim
from draft.laws.beyond import beyond
from draft.laws.joint_torques import torque_laws
from draft.laws.structure import LEGS
from draft.values import scalar

if TYPE_CHECKING:
    from draft.imports.importer import Files

# Legs longer or shorter than the surveyed ones by this factor are another build.
BEYOND = 1.25


def expected_mass(design: Design, files: Files) -> ExpectedMass:
    """Mass of an imported design, with its 90 % band.

    Args:
        design: what the import's spec resolves to.
        files: the import.
    """
    return widened(design, doubts(files, design))


def doubts(files: Files, design: Design) -> Doubts:
    """Assumptions of an import that widen the band of its mass, and what its torques cannot hold.

    Args:
        files: the import.
        design: what its spec resolves to.
    """
    count = sum(one.guessed for one in files.drives.values())
    torques = f"{count} of {len(files.drives)} torques are not the maker's" if count else ""
    sigma = UNLIKE if files.limbs.legs else beyond().without_legs.sigma
    return Doubts(files.guessed, torques, _unlike(files), sigma, overload(design))


def overload(design: Design) -> float:
    """Torque of standing over peak torque, of the joint that holds least; at least 1.

    The larger of the two of the home pose and of the crouch. Surveyed robots have at most 0.69.
    """
    found = (
        abs(one.torque) / one.actuator.peak_torque for one in (*home_loads(design), *loads(design))
    )
    return max([1.0, *map(scalar, found)])


def _unlike(files: Files) -> str:
    """In what the robot is unlike those that its trends are fitted to; "" for nothing."""
    population, legs = files.population, files.limbs.legs
    if files.fixed:
        return "few arms and hands are known by their links"
    if not legs:
        return "the surveyed robots have legs"
    if legs != LEGS[population]:
        return f"surveyed {population}s have {LEGS[population]} legs, not {legs}"
    if is_slim(files.drives):
        return "its limbs are slimmer than the drives of surveyed robots"
    leg = leg_length(files.reduced)
    laws = torque_laws(population).values()
    low, high = min(law.legs[0] for law in laws), max(law.legs[1] for law in laws)
    if leg and not low / BEYOND <= leg <= high * BEYOND:
        return f"its legs of {leg:.2g} m are outside the surveyed {low:.2g} to {high:.2g} m"
    return ""
