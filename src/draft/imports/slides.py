"""Prismatic joints of a vendor's robot: kept as slides without a drive.

Draft's actuator trends are those of rotary modules, so a linear drive has no mass and no armature.
A slide is part of the member that it lengthens: it has its hinge's role and class.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from draft.description.segments import CLOSE, TOLERANCE
from draft.description.xmlfile import DescriptionError
from draft.errors import Problem
from draft.imports.reduce import Body, Reduced
from draft.values import Array

NEAR = CLOSE - TOLERANCE
LEFT_OUT = "drives of prismatic joints"


def hinges(way: Sequence[Body]) -> list[Body]:
    """Bodies of a limb but those on slides."""
    return [body for body in way if not body.slides]


def beyond(body: Body) -> list[Body]:
    """Bodies below one, as if what slides were bolted to what it slides on."""
    found: list[Body] = []
    for child in body.children:
        found += beyond(child) if child.slides else [child]
    return found


def inherit(root: Body) -> None:
    """Give every slide the role and class of the hinge that it hangs on; none on the trunk."""
    for body in root.all():
        if body.slides:
            above = body.parent
            hung = above is not None and above.parent is not None
            body.role, body.kind = (above.role, above.kind) if hung and above else ("", "")


def place(reduced: Reduced) -> None:
    """Give every part of a member that slides divide a length, and so a mass.

    A slide moves alike wherever its frame is. Its vendor's place stands unless it leaves a part
    shorter than 2 cm; then the slides of that member divide it evenly.

    Raises:
        DescriptionError: there is no member to divide.
    """
    for body in reduced.root.all():
        for first in body.children:
            # A row begins below a hinge, the trunk, or a slide that carries several limbs.
            if first.slides and (not body.slides or len(body.children) > 1):
                _divide(body, first, reduced)


def _divide(body: Body, first: Body, reduced: Reduced) -> None:
    """Place the slides that follow one another on a body, the trunk or one on a hinge."""
    row = [first]
    while len(row[-1].children) == 1 and row[-1].children[0].slides:
        row.append(row[-1].children[0])
    # The trunk weighs by itself: its first slide may be anywhere.
    points = [one.anchor for one in (row if body.parent is None else [body, *row])]
    gaps = [float(np.linalg.norm(b - a)) for a, b in itertools.pairwise(points)]
    if not gaps or min(gaps) >= NEAR:
        return
    end = _end(row[-1], points[0], reduced)
    if float(np.linalg.norm(end - points[0])) < len(points) * NEAR:
        joint = row[gaps.index(min(gaps)) + (body.parent is None)].joint
        assert joint is not None
        cause = f"prismatic joint '{joint.name}' begins where the joint above it does"
        remedy = "what lies between weighs nothing; move its origin along, or make it fixed"
        raise DescriptionError(Problem(cause, joint.where, f"{remedy} in a copy"))
    for i, one in enumerate(row, start=len(points) - len(row)):
        one.anchor = points[0] + (end - points[0]) * (i / len(points))


def _end(last: Body, start: Array, reduced: Reduced) -> Array:
    """End of the member with a slide: the next hinge, or else its furthest link [m]."""
    if len(last.children) == 1:
        return last.children[0].anchor
    places = [reduced.poses[name][0] for name in last.links]
    return max(places, key=lambda at: float(np.linalg.norm(at - start)))


def tell(reduced: Reduced) -> None:
    """Count and note the drives of the slides that are kept."""
    for body in reduced.root.all():
        if body.slides and not body.coupled and body.joint is not None:
            reduced.counts[LEFT_OUT] += 1
            cause = f"prismatic joint '{body.joint.name}' is kept without its drive"
            remedy = "no trend knows linear drives: this one weighs nothing"
            reduced.notes.append(Problem(cause, body.joint.where, remedy))
