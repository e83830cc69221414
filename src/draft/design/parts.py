"""The numbers of a link: what its expressions come to, checked, and mirrored once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from draft import geometry as g
from draft.geometry import Rotation, Vector
from draft.spec import links, tree
from draft.spec.evaluate import Evaluator
from draft.spec.tree import UNMIRRORED, Signs
from draft.values import Value, is_array


@dataclass(frozen=True, slots=True)
class Joint:
    """A hinge or a slide: unit axis in the link's frame, range and home value [rad or m]."""

    name: str
    slide: bool
    axis: Vector
    range: tuple[Value, Value]
    home: Value
    actuator: str | None


@dataclass(frozen=True, slots=True)
class Member:
    """A structural member: unit direction, length [m] and drawn radius [m], None for default."""

    axis: Vector
    length: Value
    radius: Value | None
    mass: Value | None


@dataclass(frozen=True, slots=True)
class Motor:
    """An actuator's cylinder: centre in the link's frame [m] and unit axis."""

    actuator: str
    axis: Vector
    center: Vector


@dataclass(frozen=True, slots=True)
class Pulley:
    """A drawn cylinder without mass: unit axis, radius and length [m]."""

    axis: Vector
    radius: Value
    length: Value


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere at the link's tip: radius [m], stated mass [kg], site."""

    radius: Value
    mass: Value | None
    site: str | None


@dataclass(frozen=True, slots=True)
class Plate:
    """A sole: full sizes [m] along x, y, z, forward offset [m], stated mass [kg], site."""

    size: Vector
    offset: Value
    mass: Value | None
    site: str


@dataclass(frozen=True, slots=True)
class Link:
    """One link's numbers in its own frame; `tip` is its far end [m]."""

    name: str
    joint: Joint | None
    member: Member | None
    motor: Motor | None
    pulley: Pulley | None
    end: Sphere | Plate | None
    tip: Vector


@dataclass(frozen=True, slots=True)
class Placement:
    """Frame of a link in its parent's: origin (None: the parent's tip) and rotation."""

    at: Vector | None
    rotation: Rotation


def read_placement(placement: tree.Placement, r: Evaluator) -> Placement:
    """Evaluate a placement."""
    at = None if placement.at is None else r.vector(placement.at)
    rotation = None if placement.rpy is None else g.from_rpy(*r.vector(placement.rpy))
    return Placement(at, rotation)


def read_link(link: links.Link, r: Evaluator) -> Link:
    """Evaluate a link.

    Raises:
        ResolveError: a length that is not positive, an empty joint range, an axis without length.
    """
    member = tip = None
    if link.member is not None:
        member = _member(link.member, link.name, r)
        tip = g.scale(member.axis, member.length)
    tip = tip or g.ZERO
    motor = pulley = None
    if (m := link.motor) is not None:
        center = tip if m.shift is None else g.add(tip, r.vector(m.shift))
        motor = Motor(m.actuator, r.axis(m.axis, f"the motor of {link.name}"), center)
    if (p := link.pulley) is not None:
        pulley = Pulley(
            r.axis(p.axis, f"the pulley of {link.name}"),
            r.positive(p.radius, f"pulley radius of {link.name}"),
            r.positive(p.length, f"pulley length of {link.name}"),
        )
    joint = _joint(link.joint, r) if link.joint is not None else None
    end = _end(link.end, link.name, r) if link.end is not None else None
    return Link(link.name, joint, member, motor, pulley, end, tip)


def mirrored(link: Link, signs: Signs) -> Link:
    """Reflect a link with its frame: all readers find its vectors as they are on that copy.

    Args:
        link: as written in its chain.
        signs: product of the mirrors above it, per axis.
    """
    if signs == UNMIRRORED:
        return link
    joint, member, motor, pulley, end = link.joint, link.member, link.motor, link.pulley, link.end
    if joint is not None:
        joint = replace(joint, axis=_mirrored_joint_axis(joint.axis, signs))
    if member is not None:
        member = replace(member, axis=g.multiply(member.axis, signs))
    if motor is not None:
        axis, center = g.multiply(motor.axis, signs), g.multiply(motor.center, signs)
        motor = replace(motor, axis=axis, center=center)
    if pulley is not None:
        pulley = replace(pulley, axis=g.multiply(pulley.axis, signs))
    if isinstance(end, Plate):
        end = replace(end, offset=end.offset * signs[0])
    return Link(link.name, joint, member, motor, pulley, end, g.multiply(link.tip, signs))


def _mirrored_joint_axis(axis: Vector, signs: Signs) -> Vector:
    """Axis of a joint on a mirrored copy.

    A mirror turns a slide's axis, a polar vector, into its reflection, and a hinge's, an axial
    one, into minus its reflection (two mirrors: plus). The line is the same, so one rule holds
    for both: of the reflection and its opposite the one on the original's side is taken. An
    axis along x, y or z stays as it is, and one sign means the same motion on every copy.
    """
    reflected = g.multiply(axis, signs)
    same_side = g.dot(axis, reflected)
    if is_array(same_side):
        flip = np.where(np.asarray(same_side) < 0, -1.0, 1.0)
        return g.scale(reflected, flip)
    return reflected if same_side >= 0 else g.scale(reflected, -1.0)


def _member(m: links.Member, name: str, r: Evaluator) -> Member:
    return Member(
        r.axis(m.axis, f"link {name}"),
        r.positive(m.length, f"length of {name}"),
        None if m.radius is None else r.positive(m.radius, f"drawn radius of {name}"),
        None if m.mass is None else r.at_least_zero(m.mass, f"mass of {name}"),
    )


def _joint(joint: links.Joint, r: Evaluator) -> Joint:
    low = r.number(joint.range[0], f"range of {joint.name}")
    high = r.number(joint.range[1], f"range of {joint.name}")
    r.require(
        low < high,
        joint.range[1],
        f"upper limit of {joint.name}",
        high,
        f"must be above the lower limit{'' if is_array(low) else f', {low:g}'}",
    )
    what = f"home {'place' if joint.slide else 'angle'} of {joint.name}"
    home = r.number(joint.home, what)
    inside = (low <= home) & (home <= high)
    limits = "" if is_array(low) or is_array(high) else f" [{low:g}, {high:g}]"
    rule = f"must lie in the joint's range{limits}"
    r.require(inside, joint.home, what, home, rule)
    axis = r.axis(joint.axis, joint.name)
    return Joint(joint.name, joint.slide, axis, (low, high), home, joint.actuator)


def _end(end: links.Sphere | links.Plate, name: str, r: Evaluator) -> Sphere | Plate:
    mass = None if end.mass is None else r.at_least_zero(end.mass, f"end mass of {name}")
    if isinstance(end, links.Sphere):
        return Sphere(r.positive(end.radius, f"sphere radius of {name}"), mass, end.site)
    size = tuple(
        r.positive(expression, f"plate {side} of {name}")
        for expression, side in zip(end.size, ("length", "width", "thickness"), strict=True)
    )
    offset = r.number(end.offset, f"plate offset of {name}")
    return Plate(size, offset, mass, end.site)  # type: ignore[arg-type]
