"""Parts of all links (joint, member, motor, pulley), and the basic link.

The other primitives add an end at the tip of the link.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, NamedTuple, Self, get_args

from pydantic import Discriminator, Field, Tag, model_validator

from draft import geometry as g
from draft.errors import Problem, ResolveError
from draft.geometry import Frame, Vector
from draft.spec.evaluate import Evaluator
from draft.spec.field_types import Axis, Model, Name, Number, NumberVector, broken_rule
from draft.spec.primitives.base import End, Geom, Written
from draft.spec.primitives.shape import LinkShape
from draft.values import Value, every, is_array, maximum, some, where

if TYPE_CHECKING:
    from draft.spec.schema import Node

Segment = Literal[
    "thigh",
    "shank",
    "foot",
    "hip_link",
    "upper_arm",
    "forearm",
    "hand",
    "shoulder_link",
    "wrist_link",
    "waist_link",
    "head",
    "finger",
    "cobot_link",
    "light_link",
    "other",
]


class Transmission(Model):
    """What is between an actuator and its joint: a belt, a tendon over pulleys, a linkage."""

    motor: Name | None = None
    """Link of the actuator, a name in its chain or a full name with its prefix: it is between the
    base and the joint. Default: the nearest one of the class that drives no other joint."""
    ratio: Number = 1.0
    """Turns of the actuator's output per turn of the joint: torque grows with it, speed falls."""
    efficiency: Number = 1.0
    """Share of the actuator's torque that arrives, above 0 and at most 1."""


class Joint(Model):
    """A hinge or a slide at the link's origin.

    A slide is passive, because actuator classes are rotary.
    """

    name: Name
    """Name, after the prefix of the chain."""
    type: Literal["hinge", "slide", "continuous"] = "hinge"
    """Rotation about the axis, translation along it, or rotation without limits."""
    axis: Axis
    """Axis of positive rotation, or direction of positive motion, in the link's frame."""
    range: Annotated[list[Number], Field(min_length=2, max_length=2)]
    """Lowest and highest angle [rad]; for a slide, position [m]. A continuous joint has no limits:
    its range is the one that poses are sampled from."""
    actuator: Name | None = None
    """Actuator class that drives it. Omit it for a passive joint, and for a slide."""
    transmission: Transmission | None = None
    """Ratio between the actuator and the joint, and where the actuator is."""
    home: Number = 0.0
    """Angle [rad], or position of a slide [m], in the home pose."""


class Follows(Model):
    """Motion of a coupled joint: its position is ratio times that of another joint plus offset."""

    joint: Name
    """Joint that it follows: a name in its chain, or else a full name with its prefix."""
    ratio: Number
    """Motion per motion of that joint: positive for the same sense about each joint's own axis.
    [1]; m/rad for a slide that follows a hinge."""
    offset: Number = 0.0
    """Position where the other joint is at zero [rad]; of a slide [m]."""


_OF_LEADER = "that of the joint that it follows: remove it"


class CoupledJoint(Model):
    """A joint that follows another one by a fixed ratio, as the last joint of many fingers does.

    Its range and its position in the home pose follow from those of the other joint.
    """

    absent: ClassVar[Mapping[str, str]] = {
        "range": f"its range follows from {_OF_LEADER}",
        "home": f"its home position follows from {_OF_LEADER}",
        "actuator": "a joint that follows another has no drive of its own: remove it",
    }

    name: Name
    """Name, after the prefix of the chain."""
    type: Literal["hinge", "slide"] = "hinge"
    """Rotation about the axis, or translation along it."""
    axis: Axis
    """Axis of positive rotation, or direction of positive motion, in the link's frame."""
    follows: Follows
    """The joint that it follows, and how."""


def _joint_kind(value: object) -> str:
    return "(follows)" if isinstance(value, dict) and "follows" in value else "(free)"


AnyJoint = Annotated[
    Annotated[Joint, Tag("(free)")] | Annotated[CoupledJoint, Tag("(follows)")],
    Discriminator(_joint_kind),
]


class Member(Model):
    """The structural member of a link: a straight cylinder from the link's origin to its tip."""

    absent: ClassVar[Mapping[str, str]] = {"shape": "write it beside 'link', not in it"}

    axis: Axis
    """Direction from origin to tip."""
    length: Number
    """Distance from origin to tip [m]."""
    segment: Segment | None = None
    """Segment class, whose trend predicts the structural mass of the rigid segment; `other` has the
    median mass per metre of all segments of the population."""
    mass: Number | None = None
    """Structural mass of this member [kg]; overrides the trend."""
    radius: Number | None = None
    """Drawn radius [m]; it does not change the mass. Default: the radius at the density of the
    trunk."""


class MemberPart(NamedTuple):
    """A structural member: unit direction, length [m], drawn radius [m] and stated mass [kg].

    Radius and mass are None by default.
    """

    axis: Vector
    length: Value
    radius: Value | None
    mass: Value | None

    @classmethod
    def read(cls, written: Written[Member], link: str, r: Evaluator) -> MemberPart:
        """Evaluate the axis, the length, the radius and the mass."""
        axis = r.axis(written.triple("axis"), f"link {link}")
        length = r.positive(written.number("length"), f"length of {link}")
        radius, mass = written.optional("radius"), written.optional("mass")
        return cls(
            axis,
            length,
            None if radius is None else r.positive(radius, f"drawn radius of {link}"),
            None if mass is None else r.at_least_zero(mass, f"mass of {link}"),
        )

    def mirrored(self, signs: Vector) -> MemberPart:
        """Return its reflection."""
        return MemberPart(g.reflect(self.axis, signs), self.length, self.radius, self.mass)

    def geom(self, tip: Vector, radius: Value, mass: Value) -> Geom:
        """Return the member as one rod.

        Args:
            tip: tip of the link [m].
            radius: drawn radius [m].
            mass: mass of the member [kg].
        """
        return self._rod("_link", g.scale(tip, 0.5), self.length, radius, mass)

    def halves(self, tip: Vector, radius: Value, mass: Value, centre: Value) -> Iterator[Geom]:
        """Return the member as two halves of different mass.

        Args:
            tip: tip of the link [m].
            radius: drawn radius [m].
            mass: mass of the member [kg].
            centre: centre of mass as a share of the length from the origin.
        """
        # The halves balance at 1/4 and 3/4 of the length; their masses give the wanted centre.
        for suffix, middle, share in (
            ("_link", 0.25, 1.5 - 2.0 * centre),
            ("_link_far", 0.75, 2.0 * centre - 0.5),
        ):
            at = g.scale(tip, middle)
            yield self._rod(suffix, at, self.length * 0.5, radius, mass * share)

    def _rod(self, suffix: str, at: Vector, length: Value, radius: Value, mass: Value) -> Geom:
        return Geom(suffix, "structure", "cylinder", at, (radius, length), mass, self.axis)


class Motor(Model):
    """An actuator fixed to the tip of a link.

    It drives the next joint down the tree that uses its class and has no other actuator. A module
    is a cylinder about its axis. A servo is a box whose axis is near one end of it: half of its
    shorter edge across the axis from that end.
    """

    absent: ClassVar[Mapping[str, str]] = {
        "shape": "all actuators of a class have the same: write it in parameters.yaml, in the class"
    }

    actuator: Name
    """Actuator class."""
    axis: Axis
    """Direction of its output axis."""
    shift: NumberVector | None = None
    """Middle of the actuator on its axis, from the link's tip [m]."""
    long: Axis | None = None
    """Direction in which the box of a servo extends from its axis, in the link's frame: the part
    of it across the axis counts. Default: back along the member; without one across the axis, -z,
    or -x if the axis is along z."""


class MotorPart(NamedTuple):
    """An actuator on its axis: middle in the link's frame [m], unit axis, and unit vector across.

    A cylinder is about the axis; a box extends from it along `long`.
    """

    actuator: str
    axis: Vector
    center: Vector
    long: Vector

    @classmethod
    def read(
        cls, written: Written[Motor], link: str, member: Vector, tip: Vector, r: Evaluator
    ) -> MotorPart:
        """Evaluate the axes and the middle.

        Args:
            written: the motor as written.
            link: name of its link, for messages.
            member: direction of the member of the link; zero without one.
            tip: tip of the link [m].
            r: evaluator of expressions.

        Raises:
            ResolveError: a number is invalid, or `long` is along the axis.
        """
        center = tip
        if "shift" in written.numbers:
            center = g.add(tip, r.vector(written.triple("shift")))
        axis = r.axis(written.triple("axis"), f"the motor of {link}")
        if "long" in written.numbers:
            long = r.axis(written.triple("long"), f"the long side of the motor of {link}")
            _require_across(written, link, long, axis, r)
            directions = [long]
        else:
            directions = [_REAR, _DOWN, g.scale(member, -1.0)]
        return cls(written.fields.actuator, axis, center, _last_across(directions, axis))

    def mirrored(self, signs: Vector) -> MotorPart:
        """Return its reflection."""
        axis, center = g.reflect(self.axis, signs), g.reflect(self.center, signs)
        return MotorPart(self.actuator, axis, center, g.reflect(self.long, signs))

    @property
    def frame(self) -> Frame:
        """Its frame in that of the link: in its middle, with z along the axis and x along `long`.

        It is turned on a mirrored copy, not mirrored: both sides have the same actuator.
        """
        return self.center, g.transposed((self.long, g.cross(self.axis, self.long), self.axis))

    def cylinder(self, radius: Value, length: Value, mass: Value) -> Geom:
        """Return a module as a cylinder of a radius [m], length [m] and mass [kg]."""
        size = (radius, length)
        return Geom("_motor", "actuator", "cylinder", self.center, size, mass, self.axis)

    def box(self, width: Value, height: Value, length: Value, mass: Value) -> Geom:
        """Return a servo as a box, whose x is along its long side and whose z is along its axis.

        Args:
            width: shorter edge across the axis [m].
            height: longer edge across the axis [m].
            length: edge along the axis [m].
            mass: its mass [kg].
        """
        center = g.add(self.center, g.scale(self.long, (height - width) / 2))
        size = (height, width, length)
        return Geom("_motor", "actuator", "box", center, size, mass, rotation=self.frame[1])


_DOWN: Vector = (0.0, 0.0, -1.0)
_REAR: Vector = (-1.0, 0.0, 0.0)
# Sine of the angle to the axis below which a direction counts as along it.
_ALONG = 1e-6


def _across(direction: Vector, axis: Vector) -> Vector:
    """Part of a direction across a unit axis."""
    return g.subtract(direction, g.scale(axis, g.dot(direction, axis)))


def _last_across(directions: Iterable[Vector], axis: Vector) -> Vector:
    """Unit vector across an axis: the part of the last direction that is not along it."""
    found = g.ZERO
    for direction in directions:
        part = _across(direction, axis)
        size = g.norm(part)
        off = size > _ALONG
        if not some(off):
            continue
        unit = g.scale(part, 1.0 / maximum(size, _ALONG))
        if every(off):
            found = unit
        else:
            x, y, z = (where(off, a, b) for a, b in zip(unit, found, strict=True))
            found = (x, y, z)
    return found


def _require_across(
    written: Written[Motor], link: str, long: Vector, axis: Vector, r: Evaluator
) -> None:
    along = g.norm(_across(long, axis)) <= _ALONG
    if is_array(along):
        r.mark(along)
    elif along:
        other = "x" if abs(axis[2]) > abs(axis[0]) else "z"
        cause = f"'long' of the motor of {link} is along the motor's axis"
        remedy = f"give a direction across it, such as 'long: {other}', or omit 'long'"
        raise ResolveError(Problem(cause, written.places["long"], remedy))


class Pulley(Model):
    """A drawn output without mass (belt pulley, linkage end) at the tip of a link."""

    axis: Axis
    """Direction of its cylinder."""
    radius: Number
    """Drawn radius [m]."""
    length: Number
    """Drawn length [m]."""


class PulleyPart(NamedTuple):
    """A drawn cylinder without mass: unit axis, radius and length [m]."""

    axis: Vector
    radius: Value
    length: Value

    @classmethod
    def read(cls, written: Written[Pulley], link: str, r: Evaluator) -> PulleyPart:
        """Evaluate the axis, the radius and the length."""
        return cls(
            r.axis(written.triple("axis"), f"the pulley of {link}"),
            r.positive(written.number("radius"), f"pulley radius of {link}"),
            r.positive(written.number("length"), f"pulley length of {link}"),
        )

    def mirrored(self, signs: Vector) -> PulleyPart:
        """Return its reflection."""
        return PulleyPart(g.reflect(self.axis, signs), self.radius, self.length)

    def geom(self, tip: Vector) -> Geom:
        """Return the cylinder at the tip of the link, without mass or collision."""
        size = (self.radius, self.length)
        return Geom("_pulley", "drawn", "cylinder", tip, size, None, self.axis, collides=False)


class LinkBase(Model):
    """Parts of every link; `type` determines its end."""

    name: Name
    """Name of the body, after the prefix of the chain."""
    at: NumberVector | None = None
    """Origin in the frame of the parent [m]. Default: the tip of the parent."""
    rpy: NumberVector | None = None
    """Roll, pitch, yaw in the frame of the parent [rad], as in URDF."""
    joint: AnyJoint | None = None
    """Joint at its origin. Without one the link is fixed to its parent."""
    link: Member | None = None
    """Structural member."""
    shape: LinkShape | None = None
    """Part of your own in place of the member."""
    motor: Motor | None = None
    """Actuator at its tip."""
    pulley: Pulley | None = None
    """Drawn output without mass at its tip."""
    children: list[Node] = Field([])
    """Further links attached to it, besides the next link of its chain."""
    end: ClassVar[type[End] | None] = None

    @model_validator(mode="after")
    def _shape_of_a_member(self) -> Self:
        if self.shape is not None and self.link is None:
            remedy = "add 'link: ...' with its axis and length, or remove 'shape'"
            raise broken_rule("a shape without a member, whose place it takes", remedy)
        if self.shape and self.shape.weighs and self.link and self.link.mass is not None:
            raise broken_rule("the mass of 'link' and that of 'shape'", "remove one of them")
        return self

    @classmethod
    def type_name(cls) -> str:
        """Value of `type` that selects the primitive."""
        return get_args(cls.model_fields["type"].annotation)[0]


class BasicLink(LinkBase):
    """A cylinder with the actuator of the next joint at its tip."""

    type: Literal["basic"] = "basic"
