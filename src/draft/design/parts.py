"""Numbers of a link: its expressions evaluated, checked, and mirrored once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from draft import geometry as g
from draft.geometry import Frame, Rotation, Vector
from draft.spec import links, tree
from draft.spec.evaluate import Evaluator
from draft.spec.primitives.base import End
from draft.spec.primitives.basic import MemberPart, MotorPart, PulleyPart
from draft.spec.primitives.mesh import Mesh
from draft.spec.primitives.shape import ShapePart
from draft.spec.primitives.wheel import WheelPart
from draft.spec.tree import UNMIRRORED, Signs
from draft.values import Value, is_array, maximum, minimum, scalar

Meshes = Mapping[tuple[str, str | None], Mesh]
TURN = (-math.pi, math.pi)  # Angles of a wheel that sliders and poses have [rad].
_ALONG = 1e-6


class Coupling(NamedTuple):
    """Motion of a joint that follows another: position = ratio x that of the other + offset.

    Attributes:
        ratio: motion per motion of the other joint [1, or m/rad].
        offset: position with the other joint at zero [rad or m].
        joint: full name of the other joint, which follows none itself; "" until it is known.
        body: index of the body that the other joint moves.
    """

    ratio: Value
    offset: Value
    joint: str = ""
    body: int = 0

    def of(self, position: Value) -> Value:
        """Position at a position of the other joint [rad or m]."""
        return self.ratio * position + self.offset


class Transmission(NamedTuple):
    """What is between an actuator and its joint.

    Attributes:
        ratio: turns of the actuator's output per turn of the joint.
        efficiency: share of the actuator's torque that arrives.
    """

    ratio: Value
    efficiency: Value

    @classmethod
    def read(cls, written: links.Transmission, joint: str, r: Evaluator) -> Transmission:
        """Evaluate ratio and efficiency."""
        ratio = r.positive(written.ratio, f"ratio of {joint}")
        what = f"efficiency of {joint}"
        efficiency = r.positive(written.efficiency, what)
        r.require(efficiency <= 1, written.efficiency, what, efficiency, "must be at most 1")
        return cls(ratio, efficiency)


class Joint(NamedTuple):
    """A hinge or a slide: unit axis in the frame of the link; range and home [rad or m].

    One that rolls turns a wheel: it is continuous, its range is one turn, and if it is driven, then
    by a servo of its speed.
    """

    name: str
    slide: bool
    axis: Vector
    range: tuple[Value, Value]
    home: Value
    actuator: str | None
    continuous: bool = False
    rolls: bool = False
    follows: Coupling | None = None
    transmission: Transmission | None = None

    @property
    def kind(self) -> str:
        """Type of the joint as URDF calls it."""
        return "prismatic" if self.slide else "continuous" if self.continuous else "revolute"

    @property
    def moved_by(self) -> str:
        """Joint that it follows, or transmission, in words; "" for neither. Of a single design."""
        if self.follows is not None:
            offset = scalar(self.follows.offset)
            plus = f" {offset:+.3g}" if offset else ""
            return f"follows {self.follows.joint} x {scalar(self.follows.ratio):.3g}{plus}"
        if self.transmission is not None:
            ratio, efficiency = map(scalar, self.transmission)
            lossy = f" at {efficiency:.0%}" if efficiency < 1 else ""
            return f"through {ratio:.3g}:1{lossy}"
        return ""


class Link(NamedTuple):
    """Numbers of a link in its own frame.

    `tip` is the end of its member [m], and `shape` a part in place of the member, or of the trunk.
    """

    name: str
    joint: Joint | None
    member: MemberPart | None
    motor: MotorPart | None
    pulley: PulleyPart | None
    end: End | None
    tip: Vector
    shape: ShapePart | None = None


class Placement(NamedTuple):
    """Frame of a link in that of its parent: origin (None: the parent's tip) and rotation."""

    at: Vector | None
    rotation: Rotation


def read_placement(placement: tree.Placement, r: Evaluator) -> Placement:
    """Evaluate a placement."""
    at = None if placement.at is None else r.vector(placement.at)
    rotation = None if placement.rpy is None else g.from_rpy(*r.vector(placement.rpy))
    return Placement(at, rotation)


def read_link(link: links.Link, meshes: Meshes, r: Evaluator) -> Link:
    """Evaluate a link; `meshes` are those of its spec.

    Raises:
        ResolveError: a length is not positive, a joint range is empty, an axis is zero, a wheel
            does not turn about its own axis, a motor's long side is along its axis, or a part
            has not about the size of what it replaces.
    """
    name = link.name
    member = motor = pulley = end = shape = None
    tip = along = g.ZERO
    if link.member is not None:
        member = MemberPart.read(link.member, name, r)
        along, tip = member.axis, g.scale(member.axis, member.length)
    if link.shape is not None:
        fields = link.shape.fields
        shape = ShapePart.read(link.shape, meshes[fields.file, fields.unit], name, r)
        if member is not None:
            shape.check_size(link.shape, member.length, f"the member of {name}", r)
    if link.motor is not None:
        motor = MotorPart.read(link.motor, name, along, tip, r)
    if link.pulley is not None:
        pulley = PulleyPart.read(link.pulley, name, r)
    joint = _joint(link.joint, r) if link.joint is not None else None
    if link.end_type is not None and link.end is not None:
        end = link.end_type.read(link.end, name, r)
        if joint is not None and joint.rolls and isinstance(end, WheelPart):
            off = g.norm(g.cross(end.axis, joint.axis))
            what = f"sine of the angle between the axes of wheel '{name}' and joint '{joint.name}'"
            rule = "must be 0, as a wheel turns about its own axis"
            r.require(off < _ALONG, link.end.triple("axis")[0], what, off, rule)
    return Link(name, joint, member, motor, pulley, end, tip, shape)


def mirrored(link: Link, signs: Signs) -> Link:
    """Reflect a link with its frame, so that its vectors are those of the mirrored copy.

    Args:
        link: as written in its chain.
        signs: product of the mirrors above it, per axis.
    """
    if signs == UNMIRRORED:
        return link
    return Link(
        link.name,
        link.joint and _mirrored_joint(link.joint, signs),
        link.member and link.member.mirrored(signs),
        link.motor and link.motor.mirrored(signs),
        link.pulley and link.pulley.mirrored(signs),
        link.end and link.end.mirrored(signs),
        g.reflect(link.tip, signs),
        link.shape and link.shape.mirrored(signs),
    )


def coupled(link: Link, leader: Link, name: str, body: int) -> Link:
    """Link whose joint follows another one, with the range and the home position that follow.

    Args:
        link: the link.
        leader: link of the joint that it follows, whose own range is known.
        name: full name of that joint.
        body: index of its body.
    """
    joint, other = link.joint, leader.joint
    if joint is None or other is None or joint.follows is None:
        return link
    follows = joint.follows._replace(joint=name, body=body)
    low, high = (follows.of(end) for end in other.range)
    joint = joint._replace(
        range=(minimum(low, high), maximum(low, high)),
        home=follows.of(other.home),
        continuous=other.continuous and not joint.slide,
    )
    if (above := other.follows) is not None:  # Coupled itself: follow what that follows.
        follows = Coupling(
            follows.ratio * above.ratio, follows.of(above.offset), above.joint, above.body
        )
    return link._replace(joint=joint._replace(follows=follows))


def placed(placement: Placement, parent: Link | None, signs: Signs) -> Frame:
    """Frame of a body in that of its parent; of the trunk, which has none, the placement itself.

    Args:
        placement: of its link.
        parent: link of its parent, as written in its chain.
        signs: product of the mirrors above it, per axis.
    """
    at, rotation = placement
    if at is None:
        at = g.ZERO if parent is None else parent.tip
    if signs == UNMIRRORED:
        return at, rotation
    return g.reflect(at, signs), g.mirrored(rotation, signs)


def _mirrored_joint(joint: Joint, signs: Signs) -> Joint:
    """Joint on a mirrored copy.

    A mirror maps the axis of a slide, a polar vector, to its reflection, and the axis of a hinge,
    an axial vector, to minus its reflection (two mirrors: plus). Both lie on one line, so one rule
    holds for both: of the reflection and its opposite, take the one on the side of the original.
    Then an axis along x, y or z is unchanged, and one sign means the same motion on every copy.
    """
    reflected = g.reflect(joint.axis, signs)
    same_side = g.dot(joint.axis, reflected)
    if is_array(same_side):
        axis = g.scale(reflected, np.where(np.asarray(same_side) < 0, -1.0, 1.0))
    else:
        axis = reflected if same_side >= 0 else g.scale(reflected, -1.0)
    return joint._replace(axis=axis)


def _joint(joint: links.Joint, r: Evaluator) -> Joint:
    axis = r.axis(joint.axis, joint.name)
    transmission = joint.transmission and Transmission.read(joint.transmission, joint.name, r)
    if joint.follows is not None:
        what = f"ratio of {joint.name}"
        ratio = r.number(joint.follows.ratio, what)
        rule = "must not be 0: a joint that stays still needs no coupling"
        r.require(ratio != 0, joint.follows.ratio, what, ratio, rule)
        follows = Coupling(ratio, r.number(joint.follows.offset, f"offset of {joint.name}"))
        return Joint(joint.name, joint.slide, axis, TURN, 0.0, None, follows=follows)
    if joint.range is None:
        driver = joint.actuator
        return Joint(joint.name, False, axis, TURN, 0.0, driver, True, True, None, transmission)
    low = r.number(joint.range[0], f"range of {joint.name}")
    high = r.number(joint.range[1], f"range of {joint.name}")
    r.require(
        low < high,
        joint.range[1],
        f"upper limit of {joint.name}",
        high,
        f"must be above the lower limit{'' if is_array(low) else f', {low:g}'}",
    )
    what = f"home {'position' if joint.slide else 'angle'} of {joint.name}"
    home = r.number(joint.home, what)
    inside = (low <= home) & (home <= high)
    limits = "" if is_array(low) or is_array(high) else f" [{low:g}, {high:g}]"
    rule = f"must lie in the joint's range{limits}"
    r.require(inside, joint.home, what, home, rule)
    return Joint(
        joint.name,
        joint.slide,
        axis,
        (low, high),
        home,
        joint.actuator,
        joint.continuous,
        transmission=transmission,
    )
