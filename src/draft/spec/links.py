"""A link as written in tree.yaml: joint, member, motor, pulley and end, with compiled expressions.

`draft.design.parts` has the same classes with every expression evaluated.
"""

from __future__ import annotations

from dataclasses import dataclass

from draft.errors import Location, Problem, SpecError
from draft.spec.expressions import Expression, Triple, parse
from draft.spec.field_types import Model
from draft.spec.primitives.base import End, Written, compile_part, read_axis
from draft.spec.primitives.basic import CoupledJoint, LinkBase, Member, Motor, Pulley
from draft.spec.primitives.basic import Joint as JointFields
from draft.spec.primitives.shape import LinkShape
from draft.spec.primitives.wheel import WheelJoint
from draft.spec.reader import Path_, Source


@dataclass(frozen=True, slots=True)
class Coupling:
    """How a joint follows another one, as written: position = ratio x that of `joint` + offset."""

    joint: str
    ratio: Expression
    offset: Expression
    where: Location


@dataclass(frozen=True, slots=True)
class Transmission:
    """Ratio and efficiency between an actuator and its joint, as written, and the motor's link."""

    motor: str | None
    ratio: Expression
    efficiency: Expression
    where: Location


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint at the origin of a link, as written: a slide or continuous if true, else a hinge.

    The joint of a wheel has no range, nor has one that follows another joint.
    """

    name: str
    slide: bool
    axis: Triple
    range: tuple[Expression, Expression] | None
    actuator: str | None
    home: Expression
    where: Location
    actuator_where: Location
    continuous: bool = False
    follows: Coupling | None = None
    transmission: Transmission | None = None

    @property
    def rolls(self) -> bool:
        """Whether it is the joint of a wheel."""
        return self.range is None and self.follows is None


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """One link as written, shared by all copies of its chain.

    Attributes:
        end_type: class of the primitive at its end; None without one.
        end: that primitive as written.
        shape: part in place of its member, or of the trunk, as written.
    """

    name: str
    joint: Joint | None
    member: Written[Member] | None
    motor: Written[Motor] | None
    pulley: Written[Pulley] | None
    end_type: type[End] | None
    end: Written[Model] | None
    where: Location
    shape: Written[LinkShape] | None = None

    @property
    def states_mass(self) -> bool:
        """Whether the mass of its member is stated."""
        of_part = self.shape is not None and self.shape.fields.weighs
        return of_part or (self.member is not None and "mass" in self.member.numbers)

    @property
    def structural(self) -> bool:
        """Whether it has structural mass: a member, or an end that is part of a segment."""
        return self.member is not None or (self.end_type is not None and self.end_type.of_segment)

    @property
    def sites(self) -> list[tuple[str, Location]]:
        """Names of the sites of its end, and the place of the name."""
        if self.end_type is None or self.end is None:
            return []
        site = getattr(self.end.fields, "site", None)
        if site is None:
            return []
        return [(site + suffix, self.end.places["site"]) for suffix in self.end_type.sites]


def read_link(node: LinkBase, path: Path_, source: Source) -> Link:
    """Compile the expressions of one link.

    Raises:
        SpecError: an actuator class is to drive a slide, or a joint without one has a transmission.
    """
    joint = member = motor = pulley = end = shape = None
    if node.joint is not None:
        joint = _joint(node.joint, (*path, "joint"), source)
    if node.link is not None:
        member = compile_part(node.link, (*path, "link"), source)
    if node.motor is not None:
        motor = compile_part(node.motor, (*path, "motor"), source)
    if node.pulley is not None:
        pulley = compile_part(node.pulley, (*path, "pulley"), source)
    if node.shape is not None:
        shape = compile_part(node.shape, (*path, "shape"), source)
    if node.end is not None:
        end = compile_part(getattr(node, node.end.key), (*path, node.end.key), source)
    where = source.at((*path, "name"))
    return Link(node.name, joint, member, motor, pulley, node.end, end, where, shape)


def _joint(joint: JointFields | CoupledJoint | WheelJoint, path: Path_, source: Source) -> Joint:
    """Compile a joint; a slide cannot have an actuator class, which is rotary."""
    driven, where = source.at((*path, "actuator")), source.at((*path, "name"))
    axis = read_axis(joint.axis, (*path, "axis"), source)
    if isinstance(joint, WheelJoint):
        zero, transmission = parse(0.0, where), _transmission(joint, path, source)
        return Joint(
            joint.name,
            False,
            axis,
            None,
            joint.actuator,
            zero,
            where,
            driven,
            True,
            transmission=transmission,
        )
    slide = joint.type == "slide"
    if isinstance(joint, CoupledJoint):
        follows, place = joint.follows, (*path, "follows")
        ratio, offset = (
            parse(getattr(follows, key), source.at((*place, key))) for key in ("ratio", "offset")
        )
        coupling = Coupling(follows.joint, ratio, offset, source.at((*place, "joint")))
        home = parse(0.0, where)
        return Joint(joint.name, slide, axis, None, None, home, where, driven, follows=coupling)
    if slide and joint.actuator is not None:
        cause = (
            f"joint '{joint.name}' is a slide, and '{joint.actuator}' is a rotary actuator class"
        )
        remedy = "remove 'actuator', as a slide is passive, or write 'type: hinge'"
        raise SpecError(Problem(cause, driven, remedy))
    low, high = (parse(x, source.at((*path, "range", i))) for i, x in enumerate(joint.range))
    home = parse(joint.home, source.at((*path, "home")))
    return Joint(
        joint.name,
        slide,
        axis,
        (low, high),
        joint.actuator,
        home,
        where,
        driven,
        joint.type == "continuous",
        transmission=_transmission(joint, path, source),
    )


def _transmission(
    joint: JointFields | WheelJoint, path: Path_, source: Source
) -> Transmission | None:
    """Compile a transmission, which only a driven joint has."""
    written, path = joint.transmission, (*path, "transmission")
    if written is None:
        return None
    if joint.actuator is None:
        cause = f"joint '{joint.name}' has a transmission and no actuator"
        raise SpecError(Problem(cause, source.at(path), "add 'actuator: ...', or remove it"))
    ratio, efficiency = (
        parse(getattr(written, key), source.at((*path, key))) for key in ("ratio", "efficiency")
    )
    return Transmission(written.motor, ratio, efficiency, source.at((*path, "motor")))
