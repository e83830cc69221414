"""Rigid segments of a robot: links between joints, with the joints that move them.

Links on fixed joints are merged. A joint less than 2 cm from the joint above it belongs to the
segment above it, also in a row of such joints and at the base. Source: arXiv 2609.38405, structure
survey.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from draft.description.description import Description, Inertial, Joint, Point
from draft.description.rigid import box, combined, moved
from draft.geometry import (
    IDENTITY,
    ZERO,
    Matrix,
    Vector,
    add,
    compose,
    dot,
    norm,
    rotate,
    subtract,
    transposed,
)

CLOSE = 0.020
# Files give lengths to a micrometre at best: 0.020 m summed from several parts is not less.
TOLERANCE = 1e-7
SHORTEST = 1e-3
DIGITS = 8


@dataclass(frozen=True, slots=True)
class Segment:
    """A rigid segment of a robot, with joints less than 2 cm apart taken as one.

    Attributes:
        name: name of its first link.
        parent: name of its parent segment; None for the root.
        joints: joints merged into it, the first at its proximal end; for the root, the joints
            inside it.
        links: names of its links.
        body: mass properties in the frame of its first link.
        length: distance from its first joint to the furthest first joint of a child segment [m];
            without children, to the furthest link fixed to it, else the longest edge of the box.
        box: edges of the box with the same inertia [m], longest first.
        centre: position of the centre of mass along the line of the length, as a share of it, from
            the first joint; NaN for the root, without mass, and where the length is that of the
            box.
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
class _Partial:
    """A segment under construction; positions are those of the neutral pose [m]."""

    name: str
    parent: str | None
    start: Vector
    pose: tuple[Vector, Matrix]
    joints: list[Joint] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    ends: list[Vector] = field(default_factory=list)
    fixed: list[Vector] = field(default_factory=list)


def segments(description: Description) -> list[Segment]:
    """Split a robot into segments, parents before children."""
    poses: dict[str, tuple[Vector, Matrix]] = {description.root: (ZERO, IDENTITY)}
    first = _Partial(description.root, None, ZERO, poses[description.root])
    parts: dict[str, _Partial] = {first.name: first}
    # Each waiting link: its name, its segment, and the position of the joint above it.
    waiting: list[tuple[str, str, Vector]] = [(description.root, first.name, ZERO)]
    while waiting:
        link, owner, origin = waiting.pop()
        parts[owner].links.append(link)
        below: list[tuple[str, str, Vector]] = []
        for joint in description.children[link]:
            poses[joint.child] = pose = _child_pose(poses[link], joint)
            at = add(pose[0], rotate(pose[1], joint.anchor))
            if not joint.moves:
                parts[owner].fixed.append(pose[0])
                # The base of a robot on a floating joint is at that joint.
                below.append((joint.child, owner, at if joint.type == "floating" else origin))
            elif norm(subtract(at, origin)) < CLOSE - TOLERANCE:
                parts[owner].joints.append(joint)
                below.append((joint.child, owner, at))
            else:
                parts[owner].ends.append(at)
                parts[joint.child] = _Partial(joint.child, owner, at, pose, [joint])
                below.append((joint.child, joint.child, at))
        waiting.extend(reversed(below))
    return [_finished(part, description, poses) for part in parts.values()]


def _child_pose(parent: tuple[Vector, Matrix], joint: Joint) -> tuple[Vector, Matrix]:
    at = add(parent[0], rotate(parent[1], joint.position))
    turned = compose(parent[1], joint.rotation)
    return at, turned or IDENTITY


def _finished(
    part: _Partial, description: Description, poses: dict[str, tuple[Vector, Matrix]]
) -> Segment:
    bodies: list[Inertial] = []
    for name in part.links:
        inertial = description.links[name].inertial
        if inertial is not None:
            bodies.append(moved(inertial, *_relative(part.pose, poses[name])))
    body = combined(bodies)
    edges = box(body)
    reach = _reach(part)
    return Segment(
        name=part.name,
        parent=part.parent,
        joints=tuple(part.joints),
        links=tuple(part.links),
        body=body,
        length=edges[0] if reach is None else float(norm(reach)),
        box=edges,
        centre=_centre(part, body, reach),
    )


def _reach(part: _Partial) -> Vector | None:
    """Vector from its start to the furthest joint of a child, else to the furthest fixed link [m].

    None if neither is at least a millimetre away.
    """
    for points in (part.ends, part.fixed):
        arms = [subtract(point, part.start) for point in points]
        furthest = max(arms, key=norm, default=ZERO)
        if norm(furthest) >= SHORTEST:
            return furthest
    return None


def _centre(part: _Partial, body: Inertial, reach: Vector | None) -> float:
    """Position of the centre of mass along the reach, as a share of it; NaN if it has none."""
    if reach is None or part.parent is None or body.mass <= 0:
        return math.nan
    com = add(part.pose[0], rotate(part.pose[1], body.com))
    share = float(dot(subtract(com, part.start), reach) / dot(reach, reach))
    # Rounded, because the last bits differ between libraries and the table must not.
    return round(share, DIGITS) + 0.0


def _relative(base: tuple[Vector, Matrix], other: tuple[Vector, Matrix]) -> tuple[Vector, Matrix]:
    """Pose of `other` in the frame of `base`."""
    back = transposed(base[1])
    turned = compose(back, other[1])
    return rotate(back, subtract(other[0], base[0])), turned or IDENTITY
