"""Which of the structure laws hold for a design.

The calibrated law of the trunk was fitted to robots on two legs and on four. Other legs say little
about a trunk, so a hopper, a hexapod or an arm keeps the published median density.

The law compares robots: those with longer legs carry more in a denser trunk. A design of which only
the legs change carries what it did, so root.yaml may state the leg length that the law takes.
docs/structure-trends.md has the robots of one maker on which that rests.
"""

from __future__ import annotations

from dataclasses import replace

from draft.design.design import Design
from draft.design.legs import count
from draft.design.plan import plan
from draft.laws.structure import CALIBRATED, LEGS, PAPER, Population
from draft.spec.primitives.root import TrunkPart
from draft.values import Value, brief


def structure_laws(design: Design) -> Population:
    """Structure laws of a design, with the law of the trunk that holds for it.

    Args:
        design: the design, with bodies and segments; its legs do not depend on numbers.

    Returns:
        The laws that its spec names; the published law of the trunk where the calibrated one does
        not apply: without thigh and shank, or with another number of legs than the population.
    """
    named = plan(design.spec).population
    if named.uses != CALIBRATED:
        return named
    applies = design.leg_length is not None and count(design) == LEGS[named.name]
    return named if applies else replace(named, uses=PAPER)


def leg_of_trunk(design: Design, trunk: TrunkPart) -> Value | None:
    """Leg length that gives the density of the trunk [m]: stated in root.yaml, or the design's own.

    None where no leg gives it: the density is stated, or the published law holds.
    """
    if trunk.density_stated or structure_laws(design).uses != CALIBRATED:
        return None
    return design.leg_length if trunk.leg_length is None else trunk.leg_length


def trunk_words(design: Design, trunk: TrunkPart) -> str:
    """The law of the trunk that holds for a design, with the leg length that it takes."""
    words, leg = structure_laws(design).trunk_words, leg_of_trunk(design, trunk)
    if leg is None:
        return words
    if trunk.leg_length is None:
        return f"{words} = {brief(leg)} m, of this design: longer legs make the trunk denser"
    return f"{words} = {brief(leg)} m, stated in root.yaml: the legs do not change the trunk"
