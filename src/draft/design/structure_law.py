"""Which of the structure laws hold for a design.

The calibrated law of the trunk was fitted to robots on two legs and on four. Other legs say little
about a trunk, so a hopper, a hexapod or an arm keeps the published median density.
"""

from __future__ import annotations

from dataclasses import replace

from draft.design.design import Design
from draft.design.legs import count
from draft.design.plan import plan
from draft.laws.structure import CALIBRATED, LEGS, PAPER, Population


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
