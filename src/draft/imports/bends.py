"""Bends of a limb at joints that are held: links beyond one are no part of a straight member."""

from __future__ import annotations

import numpy as np

from draft.description.description import Joint
from draft.description.segments import CLOSE, TOLERANCE
from draft.imports.reduce import Body, Reduced
from draft.values import Array

# Shortest member on either side of a bend [m], and least distance of the joint from the straight
# way, as a share of that way. None of the surveyed robots has such a joint between two driven ones.
NEAR = CLOSE - TOLERANCE
ASIDE = 0.1


def held_bends(reduced: Reduced, body: Body, below: Body) -> list[Array]:
    """Places of the held joints between two hinges at which the limb bends [m], each shape (3,).

    Args:
        reduced: the robot.
        body: body of the upper hinge.
        below: body of the next hinge.
    """
    own = set(body.links)
    upper, lower = _link(body.joint, own), _link(below.joint, own)
    if upper is None or lower is None:
        return []
    start, straight = body.anchor, below.anchor - body.anchor
    length = float(np.linalg.norm(straight))
    found: list[Array] = []
    for joint in reduced.description.between(upper, lower):
        at, turn = reduced.poses[joint.child]
        point = np.round(at + turn @ np.array(joint.anchor), reduced.digits) + 0.0
        along = float((point - body.anchor) @ straight) / max(length, NEAR) ** 2
        aside = float(np.linalg.norm(point - body.anchor - along * straight))
        gaps = [float(np.linalg.norm(point - end)) for end in (start, below.anchor)]
        turns = joint.type in ("revolute", "continuous")
        if turns and min(gaps) >= NEAR and aside >= ASIDE * length:
            found.append(point)
            start = point
    return found


def _link(joint: Joint | None, own: set[str]) -> str | None:
    """Link of a body to which a joint is attached, on whichever side."""
    names = (joint.child, joint.parent) if joint is not None else ()
    return next((name for name in names if name in own), None)
