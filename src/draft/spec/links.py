"""One link as written in tree.yaml: joint, member, motor, pulley and end, expressions compiled.

Numbers come later: `draft.design.parts` has the same nouns with every expression evaluated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from draft.errors import Location, Problem, SpecError
from draft.spec import schema
from draft.spec.expressions import Expression, Triple, parse
from draft.spec.reader import Path_, Source

AXES: dict[str, tuple[float, float, float]] = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
}


@dataclass(frozen=True, slots=True)
class Joint:
    """A hinge or, where `slide` is true, a slide at a link's origin, as written."""

    name: str
    slide: bool
    axis: Triple
    range: tuple[Expression, Expression]
    actuator: str | None
    home: Expression
    where: Location
    actuator_where: Location


@dataclass(frozen=True, slots=True)
class Member:
    """A structural member, as written."""

    axis: Triple
    length: Expression
    segment: str | None
    mass: Expression | None
    radius: Expression | None
    where: Location


@dataclass(frozen=True, slots=True)
class Motor:
    """An actuator at a link's tip, as written."""

    actuator: str
    axis: Triple
    shift: Triple | None
    actuator_where: Location


@dataclass(frozen=True, slots=True)
class Pulley:
    """A weightless drawn output, as written."""

    axis: Triple
    radius: Expression
    length: Expression


@dataclass(frozen=True, slots=True)
class Sphere:
    """A contact sphere at a link's tip, as written."""

    radius: Expression
    mass: Expression | None
    site: str | None
    where: Location


@dataclass(frozen=True, slots=True)
class Plate:
    """A sole at a link's tip, as written."""

    size: Triple
    offset: Expression
    mass: Expression | None
    site: str
    where: Location


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """One link as written, shared by all copies of its chain."""

    name: str
    joint: Joint | None
    member: Member | None
    motor: Motor | None
    pulley: Pulley | None
    end: Sphere | Plate | None
    where: Location


def read_link(
    node: schema.BasicLink | schema.SphereLink | schema.FootLink, path: Path_, source: Source
) -> Link:
    """Compile the expressions of one link.

    Raises:
        SpecError: a slide that an actuator class is to drive.
    """

    def at(*steps: str | int) -> Location:
        return source.at((*path, *steps))

    def number(value: float | str, *steps: str | int) -> Expression:
        return parse(value, at(*steps))

    def perhaps(value: float | str | None, *steps: str | int) -> Expression | None:
        return None if value is None else number(value, *steps)

    joint = member = motor = pulley = end = None
    if node.joint is not None:
        joint = _joint(node.joint, (*path, "joint"), source)
    if (m := node.link) is not None:
        member = Member(
            _axis(m.axis, (*path, "link", "axis"), source),
            number(m.length, "link", "length"),
            m.segment,
            perhaps(m.mass, "link", "mass"),
            perhaps(m.radius, "link", "radius"),
            at("link", "segment"),
        )
    if (a := node.motor) is not None:
        axis = _axis(a.axis, (*path, "motor", "axis"), source)
        shift = read_triple(a.shift, (*path, "motor", "shift"), source)
        motor = Motor(a.actuator, axis, shift, at("motor", "actuator"))
    if (p := node.pulley) is not None:
        pulley = Pulley(
            _axis(p.axis, (*path, "pulley", "axis"), source),
            number(p.radius, "pulley", "radius"),
            number(p.length, "pulley", "length"),
        )
    if isinstance(node, schema.SphereLink):
        s = node.sphere
        radius = number(s.radius, "sphere", "radius")
        mass = perhaps(s.mass, "sphere", "mass")
        end = Sphere(radius, mass, s.site, at("sphere", "site"))
    elif isinstance(node, schema.FootLink):
        end = _plate(node.plate, number, perhaps, at("plate", "site"))
    return Link(node.name, joint, member, motor, pulley, end, at("name"))


def _joint(joint: schema.Joint, path: Path_, source: Source) -> Joint:
    """Compile a joint; actuator classes are rotary, so that a slide can have none."""
    slide, driven = joint.type == "slide", source.at((*path, "actuator"))
    if slide and joint.actuator is not None:
        cause = f"joint '{joint.name}' is a slide, and '{joint.actuator}' a rotary actuator class"
        remedy = "take 'actuator' away: a slide moves freely in its range; or make it 'type: hinge'"
        raise SpecError(Problem(cause, driven, remedy))
    low, high = (parse(x, source.at((*path, "range", i))) for i, x in enumerate(joint.range))
    axis = _axis(joint.axis, (*path, "axis"), source)
    home = parse(joint.home, source.at((*path, "home")))
    where = source.at((*path, "name"))
    return Joint(joint.name, slide, axis, (low, high), joint.actuator, home, where, driven)


def _plate(
    plate: schema.Plate,
    number: Callable[..., Expression],
    perhaps: Callable[..., Expression | None],
    where: Location,
) -> Plate:
    size = (
        number(plate.length, "plate", "length"),
        number(plate.width, "plate", "width"),
        number(plate.thickness, "plate", "thickness"),
    )
    offset = number(plate.offset, "plate", "offset")
    return Plate(size, offset, perhaps(plate.mass, "plate", "mass"), plate.site, where)


def read_triple(value: Sequence[float | str] | None, path: Path_, source: Source) -> Triple | None:
    """Compile three numbers; None where nothing is written."""
    if value is None:
        return None
    x, y, z = (parse(item, source.at((*path, i))) for i, item in enumerate(value))
    return (x, y, z)


def _axis(value: str | list[float | str], path: Path_, source: Source) -> Triple:
    if isinstance(value, str):
        x, y, z = (parse(component, source.at(path)) for component in AXES[value])
        return (x, y, z)
    triple = read_triple(value, path, source)
    if triple is None:  # pragma: no cover - the schema requires the axis
        raise SpecError(Problem("an axis is missing", source.at(path)))
    return triple
