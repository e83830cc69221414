"""Limbs of a fixed base: the driven hinges from the base to a tip, as of an arm or a finger.

The joints that count are driven hinges; others stay at home. Where all of them are on one chain
that chain is an arm. Where the chain branches, the part before is an arm, if it has joints, and
each branch is a finger.

The tip of a limb is the site on what its last joint moves; of several sites, the last in
tree.yaml. Without a site it is the end of the last link there. An arm that ends in fingers takes
the end of the link of its last joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple
from weakref import WeakKeyDictionary

from draft import geometry as g
from draft.design.actuators import Actuator
from draft.design.cached import once
from draft.design.design import Design
from draft.design.legs import hangs_of, moments
from draft.geometry import Frame, Vector
from draft.spec import Spec
from draft.values import Value


@dataclass(frozen=True, slots=True)
class Limb:
    """A limb of a fixed base.

    Attributes:
        joints: indices of the bodies that its driven hinges move, from the base outwards.
        path: indices of all bodies from the base to the one with the tip.
        point: tip in the frame of the last of them [m].
        radius: radius of the ball at the tip [m]; 0 without one.
    """

    joints: tuple[int, ...]
    path: tuple[int, ...]
    point: Vector
    radius: Value


class Limbs(NamedTuple):
    """Limbs of a design: an arm, or None, and fingers, from their base or the end of the arm."""

    arm: Limb | None
    fingers: tuple[Limb, ...]

    @property
    def outer(self) -> tuple[Limb, ...]:
        """The arm, or the fingers if there is none."""
        return self.fingers if self.arm is None else (self.arm,)


class Branches(NamedTuple):
    """Driven hinges by the bodies that they move: of an arm, and of each finger."""

    arm: tuple[int, ...]
    fingers: tuple[tuple[int, ...], ...]


_branches: WeakKeyDictionary[Spec, Branches] = WeakKeyDictionary()


def branches(spec: Spec) -> Branches:
    """Driven hinges of a robot on a fixed base; found once per spec. None of one that floats."""
    found = _branches.get(spec)
    if found is None:
        found = Branches((), ()) if spec.floating else _found(spec)
        _branches[spec] = found
    return found


def _found(spec: Spec) -> Branches:
    paths: list[tuple[int, ...]] = []  # driven hinges down to each body, itself included
    for i, body in enumerate(spec.bodies):
        above = () if body.parent is None else paths[body.parent]
        joint = body.link.joint
        paths.append((*above, i) if joint is not None and joint.actuator is not None else above)
    inner = {path[:k] for path in paths for k in range(len(path))}
    ends = [path for path in dict.fromkeys(paths) if path and path not in inner]
    if len(ends) < 2:
        return Branches(ends[0] if ends else (), ())
    shared = 0
    while len({path[shared] for path in ends}) == 1:
        shared += 1
    return Branches(ends[0][:shared], tuple(path[shared:] for path in ends))


@once
def limbs(design: Design) -> Limbs:
    """Limbs of a design; neither arm nor fingers of one that floats."""
    arm, fingers = branches(design.spec)
    return Limbs(
        _limb(design, arm, bool(fingers)) if arm else None,
        tuple(_limb(design, joints, False) for joints in fingers),
    )


def _limb(design: Design, joints: tuple[int, ...], has_fingers: bool) -> Limb:
    bodies, last = design.bodies, joints[-1]
    moved = [last]  # by the last joint, and by no driven joint after it
    for i in range(last + 1, len(bodies)):
        joint = bodies[i].joint
        if bodies[i].parent in moved and (joint is None or joint.actuator is None):
            moved.append(i)
    sites = [i for i in moved if (end := bodies[i].link.end) is not None and end.site is not None]
    members = [i for i in moved if bodies[i].link.member is not None]
    at = (sites or (members and ([last] if has_fingers else members)) or [last])[-1]
    link = bodies[at].link
    point = link.end.site_places(link.tip)[0] if sites and link.end is not None else link.tip
    solid = bodies[at].end_geom
    radius = solid.size[0] if solid is not None and solid.form == "sphere" else 0.0
    path = [at]
    while (parent := bodies[path[0]].parent) is not None:
        path.insert(0, parent)
    return Limb(joints, tuple(path), point, radius)


class Column(NamedTuple):
    """A driven hinge of a limb in a pose, with the joints of the limb that follow it.

    Attributes:
        body: index of the body that it moves.
        name: full name of the joint.
        actuator: its actuator.
        axis: turn of the last link of the limb per angle, in the world: a unit axis, if no joint
            follows it.
        arm: motion of the tip per angle, a column of the Jacobian [m/rad].
        torque: torque that holds what it moves against gravity, per g [kg m].
    """

    body: int
    name: str
    actuator: Actuator
    axis: Vector
    arm: Vector
    torque: Value


def frames_at(design: Design, angles: Mapping[int, Value]) -> dict[int, Frame]:
    """Frames of all bodies in the world.

    Args:
        design: a design on a fixed base.
        angles: angles of joints by the bodies that they move [rad]; others are at home, or where
            the joint that they follow puts them.
    """
    bodies = design.bodies
    frames: dict[int, Frame] = {0: (bodies[0].position, bodies[0].rotation)}
    for i, body in enumerate(bodies[1:], start=1):
        placed = body.placed(frames[body.parent or 0], home=False)
        frames[i] = body.moved(placed, _position(design, i, angles))
    return frames


def _position(design: Design, body: int, angles: Mapping[int, Value]) -> Value:
    """Position of the joint of a body, of which angles of some are known [rad or m]."""
    joint = design.bodies[body].joint
    if joint is None:
        return 0.0
    if (follows := joint.follows) is not None:
        return follows.of(_position(design, follows.body, angles))
    return angles.get(body, joint.home)


def motion(design: Design, body: int, frames: Mapping[int, Frame], point: Vector) -> Vector:
    """Motion of a point per motion of the joint of a body alone, in the world [m/rad, or 1]."""
    axis = g.rotate(frames[body][1], design.bodies[body].joint_axis)
    joint = design.bodies[body].joint
    slides = joint is not None and joint.slide
    return axis if slides else g.cross(axis, g.subtract(point, frames[body][0]))


def columns(design: Design, limb: Limb, frames: Mapping[int, Frame]) -> tuple[Column, ...]:
    """Driven hinges of a limb in a pose, from the base outwards.

    Args:
        design: a design on a fixed base.
        limb: one of its limbs.
        frames: of all bodies, in the world.
    """
    hangs = hangs_of(design, frames, moments(design, frames))
    origin, rotation = frames[limb.path[-1]]
    tip = g.add(origin, g.rotate(rotation, limb.point))
    found = []
    for k in limb.joints:
        joint = design.bodies[k].joint
        actuator = None if joint is None else design.drive(joint)
        if joint is None or actuator is None:
            continue
        axis, arm = g.rotate(frames[k][1], joint.axis), motion(design, k, frames, tip)
        for i in limb.path:
            other = design.bodies[i].joint
            if other is None or other.follows is None or other.follows.body != k:
                continue
            ratio = other.follows.ratio
            arm = g.add(arm, g.scale(motion(design, i, frames, tip), ratio))
            if not other.slide:
                axis = g.add(axis, g.scale(g.rotate(frames[i][1], other.axis), ratio))
        found.append(
            Column(
                body=k,
                name=design.bodies[k].prefix + joint.name,
                actuator=actuator,
                axis=axis,
                arm=arm,
                torque=hangs[k],
            )
        )
    return tuple(found)


def home_columns(design: Design, limb: Limb) -> tuple[Column, ...]:
    """Driven hinges of a limb in the home pose."""
    return columns(design, limb, dict(enumerate(design.frames(home=True))))
