"""A cylinder with an actuator at its far end: what every link may have, and the basic link.

Member, motor and pulley are parts of all links; the other primitives add what a link ends in.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, NamedTuple, get_args

from pydantic import Field

from draft import geometry as g
from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.primitives.base import End, Geom, Written
from draft.spec.words import Axis, Model, Name, Number, NumberVector
from draft.values import Value

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
    "other",
]


class Joint(Model):
    """A hinge or a slide at the link's origin.

    A slide moves freely within its range: actuator classes are rotary and drive none.
    """

    name: Name
    """Name; a chain's prefix is put before it."""
    type: Literal["hinge", "slide", "continuous"] = "hinge"
    """Whether the link turns about the axis, moves along it, or turns without end."""
    axis: Axis
    """Axis of positive rotation, or direction of positive motion, in the link's frame."""
    range: Annotated[list[Number], Field(min_length=2, max_length=2)]
    """Lowest and highest angle [rad]; of a slide, place [m]. Nothing stops a continuous joint
    there: poses are drawn from its range."""
    actuator: Name | None = None
    """Actuator class that drives it; none for a passive joint, and for every slide."""
    home: Number = 0.0
    """Angle [rad], or place of a slide [m], in the home pose."""


class Member(Model):
    """The structural member of a link: a straight cylinder from the link's origin to its tip."""

    axis: Axis
    """Direction from origin to tip."""
    length: Number
    """Distance from origin to tip [m]."""
    segment: Segment | None = None
    """Class whose trend gives the structural mass of the rigid segment; `other` for one of no
    class, which has the median mass per metre of all the population's segments."""
    mass: Number | None = None
    """Structural mass of this member [kg], stated instead of the trend's."""
    radius: Number | None = None
    """Drawn radius [m]; never changes mass. Default: as wide as the trunk's density makes it."""


class MemberPart(NamedTuple):
    """A structural member: unit direction, length [m] and drawn radius [m], None for default."""

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
        """Give its reflection."""
        return MemberPart(g.reflect(self.axis, signs), self.length, self.radius, self.mass)

    def geom(self, tip: Vector, radius: Value, mass: Value) -> Geom:
        """Give the whole rod.

        Args:
            tip: its far end [m].
            radius: its drawn radius [m].
            mass: what it weighs [kg].
        """
        return self._rod("_link", g.scale(tip, 0.5), self.length, radius, mass)

    def halves(self, tip: Vector, radius: Value, mass: Value, centre: Value) -> Iterator[Geom]:
        """Give two halves of the rod, heavier on the side of its centre of mass.

        Args:
            tip: its far end [m].
            radius: its drawn radius [m].
            mass: what it weighs [kg].
            centre: where it balances, as a share of its length.
        """
        # Halves balance at 1/4 and 3/4 of the length: these masses put the whole's centre there.
        for suffix, middle, share in (
            ("_link", 0.25, 1.5 - 2.0 * centre),
            ("_link_far", 0.75, 2.0 * centre - 0.5),
        ):
            at = g.scale(tip, middle)
            yield self._rod(suffix, at, self.length * 0.5, radius, mass * share)

    def _rod(self, suffix: str, at: Vector, length: Value, radius: Value, mass: Value) -> Geom:
        return Geom(suffix, "structure", "cylinder", at, (radius, length), mass, self.axis)


class Motor(Model):
    """An actuator bolted to the tip of a link.

    It drives the next joint down the tree that uses its class and has no actuator yet.
    """

    actuator: Name
    """Actuator class."""
    axis: Axis
    """Direction of its cylinder."""
    shift: NumberVector | None = None
    """Centre of the cylinder from the link's tip [m]."""


class MotorPart(NamedTuple):
    """An actuator's cylinder: centre in the link's frame [m] and unit axis."""

    actuator: str
    axis: Vector
    center: Vector

    @classmethod
    def read(cls, written: Written[Motor], link: str, tip: Vector, r: Evaluator) -> MotorPart:
        """Evaluate the axis and the centre; `tip` is the link's far end [m]."""
        center = tip
        if "shift" in written.numbers:
            center = g.add(tip, r.vector(written.triple("shift")))
        axis = r.axis(written.triple("axis"), f"the motor of {link}")
        return cls(written.words.actuator, axis, center)

    def mirrored(self, signs: Vector) -> MotorPart:
        """Give its reflection."""
        axis, center = g.reflect(self.axis, signs), g.reflect(self.center, signs)
        return MotorPart(self.actuator, axis, center)

    def geom(self, radius: Value, length: Value, mass: Value) -> Geom:
        """Give the module as a cylinder of its radius [m], length [m] and mass [kg]."""
        size = (radius, length)
        return Geom("_motor", "actuator", "cylinder", self.center, size, mass, self.axis)


class Pulley(Model):
    """A drawn output (belt pulley, linkage end) at the tip of a link. It weighs nothing."""

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
        """Give its reflection."""
        return PulleyPart(g.reflect(self.axis, signs), self.radius, self.length)

    def geom(self, tip: Vector) -> Geom:
        """Give the cylinder at the link's tip, which weighs nothing and touches nothing."""
        size = (self.radius, self.length)
        return Geom("_pulley", "drawn", "cylinder", tip, size, None, self.axis, collides=False)


class LinkBase(Model):
    """What every link may have; its `type` says what it ends in."""

    name: Name
    """Name of the body; a chain's prefix is put before it."""
    at: NumberVector | None = None
    """Origin in the parent's frame [m]. Default: the parent's tip."""
    rpy: NumberVector | None = None
    """Roll, pitch, yaw of the frame in the parent's [rad], as in URDF."""
    joint: Joint | None = None
    """The joint at its origin; without one the link is bolted to its parent."""
    link: Member | None = None
    """The structural member."""
    motor: Motor | None = None
    """The actuator at its tip."""
    pulley: Pulley | None = None
    """A weightless drawn output at its tip."""
    children: list[Node] = Field([])
    """What it carries besides the next link of its chain."""
    end: ClassVar[type[End] | None] = None

    @classmethod
    def type_name(cls) -> str:
        """Name of the primitive, as `type` says it."""
        return get_args(cls.model_fields["type"].annotation)[0]


class BasicLink(LinkBase):
    """A cylinder with, at its far end, the actuator that drives the next joint."""

    type: Literal["basic"] = "basic"
