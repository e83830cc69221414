"""Copies among the limbs of a body, found by the positions and axes of their joints alone.

A mirror takes the axis of a hinge, an axial vector, and that of a slide, a polar one, to the same
line, and Draft keeps the sense on it that lies on the original's side: one rule for both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from draft.imports.anatomy import run
from draft.imports.reduce import Body
from draft.imports.rounding import turned
from draft.spec.tree import MIRRORS
from draft.values import Array

# Largest differences of a copy: a joint must stay within 0.1 mm and 0.01 degrees of the maker's,
# in every pose, in which the differences of the joints above it add up.
NEAR = 7e-5  # [m]
ALIGNED = 1.5e-4  # [rad]
# A reflection that turns an axis by 90 degrees lies on neither side of it: no sense is kept.
TIE = 1e-4


@dataclass(frozen=True, slots=True)
class Copy:
    """One use of a chain.

    Attributes:
        limb: its first body.
        mirror: reflection of the chain's original, None for none.
        shares: whether its attachment is the reflection of the original's.
        reverse: for each joint, whether it moves the other way than the mirrored chain's.
    """

    limb: Body
    mirror: str | None
    shares: bool
    reverse: tuple[bool, ...]


def groups(limbs: Sequence[Body], classes: dict[str, str], origin: Array) -> list[list[Copy]]:
    """Sort limbs into sets of copies; the first of each set is the original.

    Args:
        limbs: first bodies of the limbs of one body.
        classes: actuator class by the vendor's joint name; slides have none.
        origin: origin of the body that carries them [m].
    """
    found: list[list[Copy]] = []
    for limb in limbs:
        for group in found:
            copy = _copy(group[0].limb, limb, classes, origin)
            if copy is not None:
                group.append(copy)
                break
        else:
            found.append([Copy(limb, None, True, (False,) * len(run(limb)))])
    return found


def families(sets: Sequence[list[Copy]]) -> list[list[list[Copy]]]:
    """Sets of copies that are counterparts: the same joints and segments, of other dimensions."""
    found: list[list[list[Copy]]] = []
    for group in sets:
        for family in found:
            if _counterparts(run(family[0][0].limb), run(group[0].limb)):
                family.append(group)
                break
        else:
            found.append([group])
    return found


def _counterparts(first: Sequence[Body], other: Sequence[Body]) -> bool:
    """Whether two limbs have the same joints and segments in the same order."""
    if first[-1].children or other[-1].children:
        return False
    parts = [
        [(one.role, one.kind, one.merged, one.slides, one.coupled) for one in way]
        for way in (first, other)
    ]
    return bool(parts[0][0][1] or first[0].role) and parts[0] == parts[1]


def _copy(first: Body, other: Body, classes: dict[str, str], origin: Array) -> Copy | None:
    """Copy of one limb that another is, with its reflection; None if it is none."""
    found: list[Copy] = []
    for mirror in ("y", "x", "xy", None):
        signs = np.array(MIRRORS[mirror])
        reverse = _matches(run(first), run(other), signs, classes)
        if reverse is not None:
            gap = signs * (first.anchor - origin) - (other.anchor - origin)
            found.append(Copy(other, mirror, float(np.linalg.norm(gap)) < NEAR, reverse))
    found.sort(key=lambda copy: (not copy.shares, sum(copy.reverse)))
    return found[0] if found else None


def _matches(
    first: Sequence[Body], other: Sequence[Body], signs: Array, classes: dict[str, str]
) -> tuple[bool, ...] | None:
    if len(first) != len(other) or first[-1].children or other[-1].children:
        return None
    reverse: list[bool] = []
    above: list[tuple[Array, float]] = []  # Anchor of each hinge, and what it turns the rest by.
    for a, b in zip(first, other, strict=True):
        if a.joint is None or b.joint is None or (a.kind, a.merged) != (b.kind, b.merged):
            return None
        if classes.get(a.joint.name) != classes.get(b.joint.name):
            return None
        if _coupling(a, first) != _coupling(b, other):
            return None
        if (a.joint.limits is None) != (b.joint.limits is None):
            return None
        gap = signs * (a.anchor - first[0].anchor) - (b.anchor - other[0].anchor)
        shifts = (turn * float(np.linalg.norm(a.anchor - at)) for at, turn in above)
        if float(np.linalg.norm(gap)) + sum(shifts) > NEAR:
            return None
        if abs(float(a.axis @ (a.axis * signs))) < TIE:
            return None
        axis = kept(a.axis, signs)
        off = float(np.linalg.norm(np.cross(axis, b.axis)))
        if off + sum(turn for _, turn in above) > ALIGNED:
            return None
        above.append((a.anchor, turned(b, off)))
        reverse.append(float(axis @ b.axis) < 0)
    return tuple(reverse)


def _coupling(body: Body, way: Sequence[Body]) -> tuple[float | str, ...]:
    """How the joint of a body follows another one: its place in the limb, or else its name."""
    joint = body.joint
    if joint is None or joint.mimics is None:
        return ()
    names = [one.joint.name if one.joint is not None else "" for one in way]
    known = joint.mimics in names
    leader = names.index(joint.mimics) if known else joint.mimics
    return leader, joint.ratio, joint.offset


def kept(axis: Array, signs: Array) -> Array:
    """Axis of a mirrored copy: its reflection, on the original's side."""
    reflected = axis * signs
    return reflected if float(axis @ reflected) >= 0 else -reflected
