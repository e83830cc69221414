"""Checks beyond the schema: names that are unknown, reserved or not unique."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain
from typing import TYPE_CHECKING, get_args

from draft.errors import Location, Problem, SpecError, suggest
from draft.laws.quantities import CORNER, QUANTITIES
from draft.spec.coupling import coupling_problems
from draft.spec.expressions import RESERVED, Expression
from draft.spec.graph import order
from draft.spec.links import Joint
from draft.spec.payload import KEYS, asks
from draft.spec.primitives.basic import Segment
from draft.spec.primitives.foot import PlatePart
from draft.spec.primitives.root import TrunkPart
from draft.spec.primitives.sphere import SpherePart
from draft.spec.primitives.wheel import WheelPart
from draft.spec.problems import first_few
from draft.spec.schema import STATED, TREND
from draft.spec.tree import Body

if TYPE_CHECKING:
    from draft.spec.spec import NamedDesign, Spec

# Names that every model already has.
TAKEN = {"links": "world", "joints": "floating_base"}
# Name of the site of what a robot stands on.
_FOOT = "foot"
_ADD_A_BOX = "add a link of 'type: box' at its tip"


def check_spec(spec: Spec) -> None:
    """Check a spec as a whole.

    Raises:
        SpecError: the problems found, each once, the first few of them.
    """
    problems = chain(
        _reserved_problems(spec),
        _parameter_problems(spec),
        _name_problems(spec),
        _duplicate_problems(spec),
        _actuator_problems(spec),
        _structure_problems(spec.bodies),
        _supply_problems(spec),
        _fixed_problems(spec),
        coupling_problems(spec.bodies),
        _allow_problems(spec),
        *(design_problems(spec, design) for design in spec.designs.values()),
    )
    found = first_few(problems) or first_few(_motor_problems(spec))
    if found:
        raise SpecError(found)
    order(spec.parameters, spec.actuators, {})


def expression_problem(spec: Spec, expression: Expression) -> Problem | None:
    """Problem of the first name of an expression that the spec does not define, if any."""
    for name in sorted(expression.names):
        owner, dot, quantity = name.partition(".")
        if not dot:
            if name in spec.parameters:
                continue
            known = [*spec.parameters, *spec.actuators]
            if name in spec.actuators:
                cause = f"'{name}' is an actuator class, not a number, in '{expression.text}'"
                remedy = suggest("", [f"{name}.{q}" for q in QUANTITIES], "read one of")
            else:
                inside = f" in '{expression.text}'" if expression.text != name else ""
                cause = f"unknown name '{name}'{inside}"
                remedy = suggest(name, known, "parameters and actuators")
                if name.lower().startswith(TREND):
                    remedy = f"only {CORNER} takes the word '{TREND}'; {remedy}"
        elif owner not in spec.actuators:
            cause = f"unknown actuator class '{owner}' in '{expression.text}'"
            remedy = suggest(owner, spec.actuators, "actuator classes")
        elif quantity not in QUANTITIES:
            cause = f"an actuator has no '{quantity}' to read, in '{expression.text}'"
            remedy = suggest(quantity, QUANTITIES)
        else:
            continue
        return Problem(cause, expression.where, remedy)
    return None


def design_problems(spec: Spec, design: NamedDesign) -> Iterator[Problem]:
    """Keys of a named design that the spec does not define."""
    for key, where in design.keys.items():
        problem = key_problem(spec, key, where)
        if problem is not None:
            yield problem


def key_problem(spec: Spec, key: str, where: Location | None) -> Problem | None:
    """Problem with a key of a table of values, if any."""
    first, _, rest = key.partition(".")
    owner, _, quantity = rest.partition(".")
    if key in spec.parameters or asks(spec, key):
        return None
    if key in KEYS and not spec.floating:
        cause, remedy = f"there is no trunk for a '{key}': the base is fixed", _ADD_A_BOX
    elif first in spec.actuators:
        cause, remedy = f"'{key}' is not a parameter", f"write 'actuators.{key}'"
    elif first != "actuators":
        cause = f"'{key}' is not a parameter"
        known = [*spec.parameters, *(f"actuators.{name}.QUANTITY" for name in spec.actuators)]
        remedy = suggest(key, known)
    elif owner not in spec.actuators:
        cause = f"there is no actuator class '{owner}' for '{key}'"
        remedy = suggest(owner, spec.actuators, "actuator classes")
    elif quantity not in (*STATED, "like"):
        cause = f"an actuator class has no '{quantity}' to state"
        if not quantity:
            cause = f"'{key}' is a whole actuator class: write '{key}.QUANTITY'"
        remedy = suggest(quantity, (*STATED, "like"))
    else:
        return None
    return Problem(cause, where, remedy)


def drives(spec: Spec) -> dict[int, int]:
    """Map the body index of each motor to the body index of the joint that it drives.

    A joint is driven by the motor that its transmission names; others by the nearest motor of their
    class above them that does not drive another joint.
    """
    taken: dict[int, int] = {}
    bodies = spec.bodies
    for named in (True, False):
        for index, body in enumerate(bodies):
            joint = body.link.joint
            if joint is None or joint.actuator is None or bool(motor_link(joint)) != named:
                continue
            for above in _above(spec, index):
                motor = bodies[above].link.motor
                same = motor is not None and motor.fields.actuator == joint.actuator
                here = not named or above == _named(spec, body, motor_link(joint))
                if same and here and above not in taken:
                    taken[above] = index
                    break
    return taken


def motor_link(joint: Joint) -> str:
    """Link that the transmission of a joint names as that of its motor; "" for none."""
    return (joint.transmission and joint.transmission.motor) or ""


def _above(spec: Spec, body: int) -> Iterator[int]:
    """Bodies from the parent of one to the base."""
    above = spec.bodies[body].parent
    while above is not None:
        yield above
        above = spec.bodies[above].parent


def _named(spec: Spec, body: Body, link: str) -> int | None:
    """Body of a link that a link of a chain names: one of its chain, else one of that full name."""
    names = {other.name: i for i, other in enumerate(spec.bodies)}
    return names.get(body.prefix + link, names.get(link))


def _supply_problems(spec: Spec) -> Iterator[Problem]:
    """Problems of the battery's numbers and of the power of the electronics."""
    stated = (*spec.battery.values(), spec.electronics_power)
    for expression in stated:
        if expression is not None and (found := expression_problem(spec, expression)) is not None:
            yield found


def _fixed_problems(spec: Spec) -> Iterator[Problem]:
    """What a robot that is bolted to the world cannot have: feet, and a battery in its trunk."""
    if spec.floating:
        return
    base = spec.bodies[0].name
    for expression in [*spec.battery.values()][:1]:
        cause = f"a battery, which is in a trunk: the base '{base}' is fixed"
        yield Problem(cause, expression.where, "remove 'battery'")
    for link in {id(body.link): body.link for body in spec.bodies}.values():
        end = link.end_type
        named = any(name.split("_")[-1] == _FOOT for name, _ in link.sites)
        on_ground = end is PlatePart or (end is WheelPart and bool(link.sites))
        if on_ground or (end is SpherePart and named):
            cause = f"'{link.name}' ends in a foot, and the base '{base}' is fixed"
            remedy = (
                "give the robot a trunk, 'type: root' and root.yaml, or end the link in "
                "'type: sphere' with another 'site' or none"
            )
            if end is WheelPart:
                remedy = "give the robot a trunk, 'type: root' and root.yaml, or remove 'site'"
            where = link.sites[0][1] if link.sites else link.where
            yield Problem(cause, where, remedy)


def _reserved_problems(spec: Spec) -> Iterator[Problem]:
    for item in (*spec.parameters.values(), *spec.actuators.values()):
        if item.name in RESERVED:
            yield Problem(
                f"'{item.name}' is reserved: a function, a constant or a keyword of expressions",
                item.where,
                "choose another name",
            )


def _parameter_problems(spec: Spec) -> Iterator[Problem]:
    for parameter in spec.parameters.values():
        if parameter.bounds is None:
            if parameter.value.constant is not None:
                yield Problem(
                    f"parameter '{parameter.name}' has no range",
                    parameter.where,
                    "add 'range: [lowest, highest]': sliders and sweeps need it",
                )
        elif not parameter.bounds[0] < parameter.bounds[1]:
            low, high = parameter.bounds
            yield Problem(
                f"the range [{low:g}, {high:g}] of '{parameter.name}' is empty",
                parameter.where,
                "write the lower bound first",
            )


def _name_problems(spec: Spec) -> Iterator[Problem]:
    seen: set[int] = set()
    parts = (
        spec.parameters,
        spec.actuators,
        spec.root,
        [b.link for b in spec.bodies],
        [b.placement for b in spec.bodies],
    )
    for part in parts:
        for expression in expressions(part, seen):
            problem = expression_problem(spec, expression)
            if problem:
                yield problem


def expressions(value: object, seen: set[int]) -> Iterator[Expression]:
    """Every expression inside a value, each object once."""
    if isinstance(value, Expression):
        yield value
    elif isinstance(value, (str, float, int, Location)) or value is None:
        return
    elif id(value) not in seen:
        seen.add(id(value))
        if (fields := getattr(value, "__dataclass_fields__", None)) is not None:
            for name in fields:
                yield from expressions(getattr(value, name), seen)
        elif isinstance(value, Mapping):
            for item in value.values():
                yield from expressions(item, seen)
        elif isinstance(value, (tuple, list)):
            for item in value:
                yield from expressions(item, seen)


def _duplicate_problems(spec: Spec) -> Iterator[Problem]:
    """Names that MuJoCo would find twice."""
    bodies = spec.bodies
    for kind, names in (
        ("links", [(b.name, b.link.where) for b in bodies]),
        (
            "joints",
            [(b.prefix + b.link.joint.name, b.link.joint.where) for b in bodies if b.link.joint],
        ),
        ("sites", [site for b in bodies for site in _sites(b, spec.floating)]),
    ):
        first: dict[str, Location] = {}
        for name, where in names:
            if name == TAKEN.get(kind):
                yield Problem(f"every model already has '{name}'", where, "choose another name")
            if name in first:
                yield Problem(
                    f"two {kind} are called '{name}'",
                    where,
                    f"the other is at {first[name]}; rename one, or give a chain a prefix",
                )
            first.setdefault(name, where)


def _sites(body: Body, floating: bool) -> list[tuple[str, Location]]:
    if body.parent is None:
        return [(TrunkPart.site, body.link.where)] if floating else []
    return [(body.prefix + name, where) for name, where in body.link.sites]


def _actuator_problems(spec: Spec) -> Iterator[Problem]:
    for link in {id(b.link): b.link for b in spec.bodies}.values():
        users: list[tuple[str, str | None, Location]] = []
        if link.joint is not None:
            what = f"joint '{link.joint.name}'"
            users.append((what, link.joint.actuator, link.joint.actuator_where))
        if link.motor is not None:
            users.append(("motor", link.motor.fields.actuator, link.motor.places["actuator"]))
        for what, actuator, where in users:
            if actuator is None or actuator in spec.actuators:
                continue
            yield Problem(
                f"the {what} of '{link.name}' uses actuator class '{actuator}', "
                "which does not exist",
                where,
                suggest(actuator, spec.actuators, "actuator classes"),
            )


def _structure_problems(bodies: tuple[Body, ...]) -> Iterator[Problem]:
    """Structure whose mass neither its own segment class nor one above it gives."""
    with_class: set[int] = set()
    for body, base in zip(bodies, rigid_bases(bodies), strict=True):
        link, member, end = body.link, body.link.member, body.link.end_type
        stated = member is not None and "mass" in member.numbers
        if member is not None and member.fields.segment is not None and not stated:
            with_class.add(base)
        elif not link.structural or base in with_class:
            continue
        elif member is None and end is not None:
            yield Problem(
                f"the {end.key} of '{link.name}' needs a segment for its mass, and belongs to none",
                link.where,
                "add 'link: {axis: ..., length: ..., segment: ...}' to it, or fix it to a link "
                "with one",
            )
        elif member is not None and not link.states_mass:
            yield Problem(
                f"link '{link.name}' has neither a segment class nor a mass",
                member.places["segment"],
                f"add 'segment: ...' to its link: {', '.join(get_args(Segment))}",
            )


def rigid_bases(bodies: tuple[Body, ...]) -> list[int]:
    """First body of the rigid group of each body: one with a joint, or fixed to the trunk."""
    bases: list[int] = []
    for i, body in enumerate(bodies):
        own = body.link.joint is not None or body.parent in (None, 0)
        bases.append(i if own else bases[body.parent or 0])
    return bases


def _allow_problems(spec: Spec) -> Iterator[Problem]:
    """Unknown places in `allow`; a pair of bodies is written `a/b`."""
    bodies = {body.name for body in spec.bodies}
    places = [*spec.actuators, *bodies, spec.name]
    for item, where in spec.allow.items():
        _, colon, place = item.partition(":")
        if not colon or place in places:
            continue
        first, slash, second = place.partition("/")
        if not slash:
            remedy = suggest(place, places, "actuator classes and bodies")
            yield Problem(f"'allow' names no place '{place}' of this robot", where, remedy)
        for name in (first, second) if slash else ():
            if name not in bodies:
                cause = f"'allow' names no body '{name}', in '{place}'"
                yield Problem(cause, where, suggest(name, bodies, "bodies"))


def _motor_problems(spec: Spec) -> Iterator[Problem]:
    """Transmissions whose motor cannot drive; else motors without a joint, and joints without."""
    pairs = drives(spec)
    idle = {
        index: joint
        for index, body in enumerate(spec.bodies)
        if (joint := body.link.joint) is not None
        and joint.actuator is not None
        and index not in pairs.values()
    }
    remote = {index: joint for index, joint in idle.items() if motor_link(joint)}
    if remote:
        yield from (_remote_problem(spec, index, joint) for index, joint in remote.items())
        return
    for index, body in enumerate(spec.bodies):
        motor = body.link.motor
        if motor is not None and index not in pairs:
            yield Problem(
                f"the motor on '{body.name}' drives no joint",
                motor.places["actuator"],
                f"the next joint down the tree must use actuator '{motor.fields.actuator}'",
            )
        if (joint := idle.get(index)) is not None:
            yield Problem(
                f"no motor drives joint '{body.prefix}{joint.name}'",
                joint.actuator_where,
                f"put 'motor: {{actuator: {joint.actuator}, axis: ...}}' on a link above it",
            )


def _remote_problem(spec: Spec, index: int, joint: Joint) -> Problem:
    """Problem of the joint of a body whose transmission names a link that cannot drive it."""
    body, link = spec.bodies[index], motor_link(joint)
    where = joint.where if joint.transmission is None else joint.transmission.where
    what, at = f"joint '{body.prefix}{joint.name}'", _named(spec, body, link)
    way = [spec.bodies[i].name for i in _above(spec, index)]
    if at is None:
        near = [name.removeprefix(body.prefix) for name in way]
        remedy = suggest(link, near, "links between the base and the joint")
        return Problem(f"the motor of {what} is on '{link}', which does not exist", where, remedy)
    name = spec.bodies[at].name
    if name not in way:
        cause = f"the motor of {what} is on '{name}', which is not between it and the base"
        return Problem(cause, where, f"name one of {', '.join(way[::-1])}")
    motor = spec.bodies[at].link.motor
    if motor is None or motor.fields.actuator != joint.actuator:
        cause = f"the motor of {what} is on '{name}', which has no motor of '{joint.actuator}'"
        return Problem(
            cause, where, f"add 'motor: {{actuator: {joint.actuator}, axis: ...}}' to it"
        )
    cause = f"the motor on '{name}' is to drive {what} and another joint"
    return Problem(cause, where, "give each joint a motor, or let one joint follow the other")
