"""Families: several designs of one topology, for one simulation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from draft.design import Design
from draft.errors import DraftError, Problem
from draft.learn.quadruped import Quadruped, check_family, quadruped

_TOLD = 5  # refused designs that are told one by one


def family(designs: Sequence[Design]) -> tuple[Quadruped, ...]:
    """Quadrupeds that can share one simulation.

    Args:
        designs: single designs, or many at once in one Design.

    Raises:
        DraftError: there is none; some are refused, or no quadrupeds, each told with its reason;
            or they have different topologies.
    """
    singles = [one for design in designs for one in ([design] if design.count is None else design)]
    if len(singles) == 1:
        return (quadruped(singles[0]),)
    found: list[Quadruped] = []
    wrong: list[Problem] = []
    for number, design in enumerate(singles, start=1):
        try:
            found.append(quadruped(design))
        except DraftError as error:
            reasons = "; ".join(problem.cause for problem in error.problems)
            cause = f"design {number} of the family, {design.name}:{design.label}: {reasons}"
            wrong.append(Problem(cause, None, error.problems[0].remedy))
    if len(wrong) > _TOLD:
        more = Problem(f"and {len(wrong) - _TOLD} more of {len(singles)} designs")
        wrong = [*wrong[:_TOLD], more]
    if wrong:
        raise DraftError(wrong)
    return joined(found)


def joined(members: Sequence[Quadruped]) -> tuple[Quadruped, ...]:
    """Quadrupeds as one family: each name once, all of one topology.

    Raises:
        DraftError: there is none, or they have different topologies.
    """
    if not members:
        raise DraftError(Problem("a family needs a design", None, "name one, or several"))
    check_family(members)
    count = Counter(member.name for member in members)
    taken, found = set(count), []
    for member in members:
        name, number = member.name, 0
        while count[member.name] > 1 and name in taken:
            number += 1
            name = f"{member.name}-{number}"
        taken.add(name)
        found.append(replace(member, name=name))
    return tuple(found)
