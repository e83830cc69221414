"""Rigid segments of a robot: links between joints, with the joints that turn them.

Fixed joints are merged; a joint closer than 2 cm to its parent joint joins its parent's segment
(strictly closer, chained, into the base too). Source: arXiv 2609.38405, structure survey.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from draft.description.description import Description, Inertial, Joint, Point
from draft.description.rigid import box, combined, moved
from draft.geometry import IDENTITY, ZERO, Matrix, Vector, add, compose, dot, norm, rotate, subtract

CLOSE = 0.020
# Files give lengths to a micrometre at best: 0.020 m summed from several parts is not below it.
TOLERANCE = 1e-7
SHORTEST = 1e-3
DIGITS = 8


@dataclass(frozen=True, slots=True)
class Segment:
    """A rigid part of a robot: what moves as one when joints closer than 2 cm count as one.

    Attributes:
        name: its first link.
        parent: name of the segment it hangs on; None for the root.
        joints: joints merged into it, the first being at its proximal end; those that turn parts
            of the root against each other, for the root.
        links: its links.
        body: mass properties in the frame of its first link.
        length: from its first joint to the furthest first joint of a child [m]; terminal: to the
            furthest link fixed to it, else the longest edge of the box.
        box: edges of the box with the same inertia, longest first [m].
        centre: where its centre of mass lies along the line from its first joint to the point
            that its length goes to, as a share of that length; NaN for the root, for what weighs
            nothing, and where the length is the box's.
    """

    name: str
    parent: str | None
    joints: tuple[Joint, ...]
    links: tuple[str, ...]
    body: Inertial
    length: float
    box: Point
    centre: float

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.body.mass

    @property
    def box_volume(self) -> float:
        """Volume of the box [m3]."""
        return math.prod(self.box)


@dataclass(slots=True)
class _Draft:
    """A segment while it is being gathered; positions are those of the neutral pose."""

    name: str
    parent: str | None
    start: Vector
    pose: tuple[Vector, Matrix]
    joints: list[Joint] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    ends: list[Vector] = field(default_factory=list)
    fixed: list[Vector] = field(default_factory=list)


def segments(description: Description) -> list[Segment]:
    """Cut a robot into segments, parents first, root at the front."""
    poses: dict[str, tuple[Vector, Matrix]] = {description.root: (ZERO, IDENTITY)}
    first = _Draft(description.root, None, ZERO, poses[description.root])
    drafts: dict[str, _Draft] = {first.name: first}
    # Each waiting link: its name, its segment, and where the joint above it lies.
    waiting: list[tuple[str, str, Vector]] = [(description.root, first.name, ZERO)]
    while waiting:
        link, owner, origin = waiting.pop()
        drafts[owner].links.append(link)
        below: list[tuple[str, str, Vector]] = []
        for joint in description.children[link]:
            poses[joint.child] = pose = _child_pose(poses[link], joint)
            at = add(pose[0], rotate(pose[1], joint.anchor))
            if not joint.moves:
                drafts[owner].fixed.append(pose[0])
                # Below a floating joint the robot starts anew: its base is there, not here.
                below.append((joint.child, owner, at if joint.type == "floating" else origin))
            elif norm(subtract(at, origin)) < CLOSE - TOLERANCE:
                drafts[owner].joints.append(joint)
                below.append((joint.child, owner, at))
            else:
                drafts[owner].ends.append(at)
                drafts[joint.child] = _Draft(joint.child, owner, at, pose, [joint])
                below.append((joint.child, joint.child, at))
        waiting.extend(reversed(below))
    return [_finished(draft, description, poses) for draft in drafts.values()]


def _child_pose(parent: tuple[Vector, Matrix], joint: Joint) -> tuple[Vector, Matrix]:
    at = add(parent[0], rotate(parent[1], joint.position))
    turned = compose(parent[1], joint.rotation)
    return at, turned or IDENTITY


def _finished(
    draft: _Draft, description: Description, poses: dict[str, tuple[Vector, Matrix]]
) -> Segment:
    bodies: list[Inertial] = []
    for name in draft.links:
        inertial = description.links[name].inertial
        if inertial is not None:
            bodies.append(moved(inertial, *_relative(draft.pose, poses[name])))
    body = combined(bodies)
    edges = box(body)
    reach = _reach(draft)
    return Segment(
        name=draft.name,
        parent=draft.parent,
        joints=tuple(draft.joints),
        links=tuple(draft.links),
        body=body,
        length=edges[0] if reach is None else float(norm(reach)),
        box=edges,
        centre=_centre(draft, body, reach),
    )


def _reach(draft: _Draft) -> Vector | None:
    """From its start to the furthest child's joint, else to the furthest link fixed to it [m].

    None where neither is a millimetre away.
    """
    for points in (draft.ends, draft.fixed):
        arms = [subtract(point, draft.start) for point in points]
        furthest = max(arms, key=norm, default=ZERO)
        if norm(furthest) >= SHORTEST:
            return furthest
    return None


def _centre(draft: _Draft, body: Inertial, reach: Vector | None) -> float:
    """Place of the centre of mass along the reach, as a share of it; NaN where there is none."""
    if reach is None or draft.parent is None or body.mass <= 0:
        return math.nan
    com = add(draft.pose[0], rotate(draft.pose[1], body.com))
    share = float(dot(subtract(com, draft.start), reach) / dot(reach, reach))
    # Zero, not its rounding error: the table must not depend on the last bit of a library.
    return round(share, DIGITS) + 0.0


def _relative(base: tuple[Vector, Matrix], other: tuple[Vector, Matrix]) -> tuple[Vector, Matrix]:
    """Pose of `other` in the frame of `base`."""
    back: Matrix = tuple(zip(*base[1], strict=True))  # type: ignore[assignment]
    turned = compose(back, other[1])
    return rotate(back, subtract(other[0], base[0])), turned or IDENTITY
