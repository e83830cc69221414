"""Resolving of a spec and values into a design."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

from draft.design.actuators import Actuator, size
from draft.design.battery import trunk_with_battery
from draft.design.cached import hand_on
from draft.design.design import Body, Design, SegmentMass
from draft.design.filter import inspect
from draft.design.law_errors import LawErrors
from draft.design.overrides import Table, read_table
from draft.design.parts import (
    Link,
    Placement,
    coupled,
    mirrored,
    placed,
    read_link,
    read_placement,
)
from draft.design.plan import Plan, plan
from draft.design.reuse import Reuse
from draft.design.segments import Skeleton, drawn_radii, weigh
from draft.design.structure_law import leg_of_trunk, structure_laws
from draft.errors import DraftError, Location, Problem, ResolveError
from draft.geometry import Frame
from draft.laws import catalogue
from draft.laws.catalogue import MODULE, SERVO, Part
from draft.laws.quantities import QUANTITIES
from draft.laws.servos import servo_laws
from draft.laws.structure import MIDDLE
from draft.spec import Spec, tree
from draft.spec.evaluate import Evaluator
from draft.spec.expressions import Expression
from draft.spec.links import Link as WrittenLink
from draft.spec.payload import PLACE
from draft.spec.primitives.loft import Loft
from draft.spec.primitives.root import TrunkPart, make_trunk
from draft.spec.primitives.shape import ShapePart
from draft.spec.spec import ActuatorClass, Parameter
from draft.spec.tree import Signs
from draft.values import Value, exp, is_array, some

T = TypeVar("T")


def resolve(
    spec: Spec,
    values: Mapping[str, Value | str | None],
    label: str = "custom",
    places: Mapping[str, Location] | None = None,
    errors: LawErrors | None = None,
    judge: bool = True,
) -> Design:
    """Evaluate every number of a spec; see `Spec.resolve`.

    With errors, the laws err by these factors.
    """
    p = plan(spec)
    table = read_table(spec, values, places or {}, p.order)
    with np.errstate(all="ignore"):
        return _Resolver(spec, p, table, errors).run(label, values, judge)


def _by_law(design: Design, trunk: TrunkPart) -> TrunkPart:
    """Trunk of the density that the law that holds for it gives; a stated density stays.

    Args:
        design: the design.
        trunk: its trunk, weighed by the published median.
    """
    leg = leg_of_trunk(design, trunk)
    if leg is None:
        return trunk
    volume = trunk.loft.volume
    density = structure_laws(design).calibrated(volume, leg)
    return replace(trunk, density=density, mass=density * volume)


def _erring(trunk: TrunkPart, error: Value) -> TrunkPart:
    """The trunk, where the law of its density errs; a stated density does not."""
    if trunk.density_stated or not some(error != 0.0):
        return trunk
    fold = exp(error)
    return replace(trunk, density=trunk.density * fold, mass=trunk.mass * fold)


def top_of(loft: Loft) -> tuple[Value, Value, Value]:
    """Middle of the outline of the trunk seen from above, x and y, and its highest point [m]."""
    low, high = loft.vertices.min(axis=0), loft.vertices.max(axis=0)
    x, y, top = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[2]
    return (x, y, top) if is_array(top) else (float(x), float(y), float(top))


def _body(written: tree.Body, link: Link, place: Frame, *numbers: Any) -> Body:
    """Body of a design: as written, its link, its place on its parent, and its other numbers."""
    return Body(written.name, written.prefix, written.parent, link, *place, *numbers)


def _kind(actuator: ActuatorClass, part: Part | None) -> str:
    """Family of an actuator class.

    Raises:
        ResolveError: it states another than that of its part.
    """
    if part is None or catalogue.catalogue(SERVO).get(part.name) is not part:
        return actuator.kind or MODULE
    stated = actuator.kind or SERVO
    if stated != SERVO:
        raise ResolveError(
            Problem(
                f"actuator '{actuator.name}' is of kind {stated}, and '{part.name}' is a servo",
                actuator.where,
                "omit 'kind', or start from a module",
            )
        )
    return stated


def _quantities(actuator: Actuator) -> dict[str, Value]:
    """Quantities of an actuator class by their names in expressions."""
    return {f"{actuator.name}.{quantity}": getattr(actuator, quantity) for quantity in QUANTITIES}


class _Resolver:
    def __init__(self, spec: Spec, p: Plan, table: Table, errors: LawErrors | None) -> None:
        self.spec = spec
        self.plan = p
        self.table = table
        self.errors = errors or LawErrors()
        self.count = table.count or self.errors.count
        # With errors, nothing is that of the design before.
        self.reuse = p.reuse(self.count) if errors is None else Reuse(keeps=False)
        self.env: dict[str, Value] = {}
        self.r = Evaluator(self.env)
        self.actuators: dict[str, Actuator] = {}

    def run(self, label: str, values: Mapping[str, Value | str | None], judge: bool) -> Design:
        spec, p = self.spec, self.plan
        for name in self.table.order:
            if name.endswith("."):
                self.actuator(spec.actuators[name[:-1]])
            else:
                self.parameter(spec.parameters[name])
        density = p.population.trunk_density
        trunk = None
        if (root := spec.root) is not None:
            trunk = self.read("trunk", lambda: make_trunk(root, density, self.r), p.root_reads)
        if spec.payload is not None and trunk is not None:
            top = self.reuse.result("top", top_of, trunk.loft)
            self.env.update(zip(PLACE, top, strict=True))
        links = [
            self.read(("link", i), partial(read_link, link, spec.meshes, self.r), reads)
            for i, (link, reads) in enumerate(zip(p.links, p.link_reads, strict=True))
        ]
        if trunk is not None and (part := links[p.link_of[0]].shape) is not None:
            trunk = self.of_part(trunk, part)
        placements = [
            self.read(("placement", i), partial(read_placement, placement, self.r), reads)
            for i, (placement, reads) in enumerate(
                zip(p.placements, p.placement_reads, strict=True)
            )
        ]
        bodies, segments = self.bodies(links, placements)
        design = Design(
            spec=spec,
            label=label,
            values={key: self.table.arrays.get(key, value) for key, value in values.items()},
            count=self.count,
            parameters={name: self.env[name] for name in spec.parameters},
            actuators={name: self.actuators[name] for name in spec.actuators},
            bodies=bodies,
            lofted=trunk,
            segments=segments,
            findings=(),
            battery_stated={
                name: self.r.positive(expression, f"{name} of the battery")
                for name, expression in spec.battery.items()
            },
            electronics_stated=self.electronics(spec.electronics_power),
        )
        if trunk is not None:
            trunk = _erring(_by_law(design, trunk), self.errors.trunk)
            design = replace(design, lofted=trunk)
            design = replace(design, lofted=trunk_with_battery(design, trunk))
        elif not some(design.mass > 0):
            cause, where = f"{spec.name} weighs nothing", spec.bodies[0].link.where
            remedy = "add links to its base, or 'pedestal: {size: ..., mass: ...}'"
            raise ResolveError(Problem(cause, where, remedy))
        if not judge:
            return design
        judged = replace(design, findings=inspect(design, p, self.r.invalid))
        hand_on(design, judged)
        return judged

    def of_part(self, trunk: TrunkPart, part: ShapePart) -> TrunkPart:
        """The trunk with a part in place of its solid."""
        written = self.spec.bodies[0].link.shape
        if written is not None:
            low, high = (of(trunk.loft.vertices, axis=0) for of in (np.min, np.max))
            longest = np.max(high - low, axis=0)
            part.check_size(
                written, longest if longest.ndim else float(longest), "the trunk", self.r
            )
        trunk = replace(trunk, shape=part)
        if part.mass is None:
            return trunk
        density = part.mass / trunk.loft.volume
        return replace(trunk, mass=part.mass, density=density, density_stated=True)

    def electronics(self, stated: Expression | None) -> Value | None:
        return None if stated is None else self.r.positive(stated, "the power of the electronics")

    def read(self, place: object, read: Callable[[], T], reads: tuple[str, ...]) -> T:
        """Evaluate a part of the spec, or take it over if the numbers that it reads are the same.

        Args:
            place: the part.
            read: evaluates it.
            reads: names of these numbers.
        """
        return self.reuse.result(place, lambda *_: read(), *map(self.env.__getitem__, reads))

    def parameter(self, parameter: Parameter) -> None:
        """Evaluate a parameter and check its bounds."""
        name = parameter.name
        expression = self.table.replaced.get(name) or parameter.value
        value = self.table.arrays.get(name)
        if value is None:
            value = self.r.number(expression, name)
        self.env[name] = self.reuse.equal(name, value)
        if parameter.bounds is None:
            return
        low, high = parameter.bounds
        if is_array(value):
            inside = (value >= low) & (value <= high)
            if name in self.table.arrays and not np.all(inside):
                self._outside(parameter, float(np.asarray(value)[~np.asarray(inside)][0]))
            self.r.mark(~np.asarray(inside))
        elif not low <= value <= high:
            self._outside(parameter, float(value))

    def _outside(self, parameter: Parameter, value: float) -> None:
        expression = self.table.replaced.get(parameter.name) or parameter.value
        low, high = parameter.bounds or (-math.inf, math.inf)
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        came = (
            ""
            if expression.constant is not None or parameter.name in self.table.arrays
            else (f" (from '{expression.text}')")
        )
        written = parameter.where.line is not None  # the range of a payload stands in no file
        raise ResolveError(
            Problem(
                f"{parameter.name} = {value:g}{unit}{came} is outside its range "
                f"[{low:g}, {high:g}]",
                self.table.place(parameter.name) or expression.where,
                "stay inside" + (f", or change the range at {parameter.where}" if written else ""),
            )
        )

    def actuator(self, actuator: ActuatorClass) -> None:
        """Evaluate and size an actuator class."""
        name = actuator.name
        prefix = f"actuators.{name}."
        relative = {key for key in self.table.relative if key.startswith(prefix)}
        if relative:
            base = self.sized(actuator, self.table.without(relative))
            for key in relative:
                quantity = key.removeprefix(prefix)
                self.env[f"{name}.{quantity}"] = getattr(base, quantity)
        sized = self.sized(actuator, self.table)
        self.check_rated(sized, actuator)
        self.check_corner(sized, actuator)
        self.actuators[name] = sized
        self.env |= self.reuse.result((name, "quantities"), _quantities, sized)

    def sized(self, actuator: ActuatorClass, table: Table) -> Actuator:
        """Size an actuator class with the changes of a table."""
        name = actuator.name
        stated: dict[str, Value] = {}
        for quantity, expression in table.stated(actuator).items():
            what = f"actuators.{name}.{quantity}"
            may_be_zero = QUANTITIES[quantity].may_be_zero
            read = self.r.at_least_zero if may_be_zero else self.r.positive
            array = table.arrays.get(what)
            if array is None:
                stated[quantity] = read(expression, what)
                continue
            stated[quantity] = array
            if not np.all(np.isfinite(array) & (array >= 0 if may_be_zero else array > 0)):
                least = "zero or more" if may_be_zero else "above zero"
                raise ResolveError(f"{what} has entries that are not {least}")
        like = table.like.get(name, actuator.like)
        try:
            part = catalogue.find(like, self.plan.own) if like is not None else None
            kind = _kind(actuator, part)
        except DraftError as error:
            problem = error.problems[0]
            given = name in table.like
            where = table.place(f"actuators.{name}.like") if given else actuator.like_where
            raise ResolveError(Problem(problem.cause, where, problem.remedy)) from None
        shape = self.shape(actuator)
        if shape is not None and shape.mass is not None:
            stated.setdefault("mass", shape.mass)
        by_trend = self.reuse.equal((name, "by trend"), table.predicted(actuator))
        names = self.reuse.equal((name, "stated"), tuple(stated))
        numbers = (self.reuse.equal((name, each), value) for each, value in stated.items())

        def sized(*_: object) -> Actuator:
            errors = self.errors.actuators.get(name)
            laws = servo_laws() if kind == SERVO else self.plan.laws
            found = size(name, stated, part, actuator.where, laws, errors, by_trend)
            if shape is not None and actuator.shape is not None:
                shape.check_size(actuator.shape, found.longest, f"the solid of {name}", self.r)
            return replace(found, shape=shape)

        try:
            return self.reuse.result((name, "sized"), sized, part, by_trend, names, *numbers)
        except OverflowError:
            raise ResolveError(
                Problem(f"the numbers of actuator '{name}' are too large", actuator.where)
            ) from None

    def shape(self, actuator: ActuatorClass) -> ShapePart | None:
        """Part in place of an actuator class."""
        if (written := actuator.shape) is None:
            return None
        mesh = self.spec.meshes[written.fields.file, written.fields.unit]
        return ShapePart.read(written, mesh, actuator.name, self.r)

    def check_rated(self, sized: Actuator, actuator: ActuatorClass) -> None:
        """Check that a stated rated torque is not above the peak torque."""
        if sized.origins["rated_torque"].kind != "stated":
            return
        above = sized.rated_torque > sized.peak_torque
        if is_array(above):
            self.r.mark(np.asarray(above))
        elif above:
            raise ResolveError(
                Problem(
                    f"actuator '{sized.name}' states a rated torque of {sized.rated_torque:g} N m, "
                    f"above its peak torque of {sized.peak_torque:g}",
                    actuator.where,
                    "state a lower one, or omit it: the trend gives a share of the peak",
                )
            )

    def check_corner(self, sized: Actuator, actuator: ActuatorClass) -> None:
        """Check that the corner of the torque-speed line is below the no-load speed."""
        if not sized.has_corner:
            return
        beyond = sized.corner_speed >= sized.no_load_speed
        if is_array(beyond):
            self.r.mark(np.asarray(beyond))
        elif beyond:
            stated = self.table.stated(actuator).get("corner_speed")
            raise ResolveError(
                Problem(
                    f"actuator '{sized.name}' has its corner speed at {sized.corner_speed:g} "
                    f"rad/s, and its no-load speed is {sized.no_load_speed:g}",
                    (stated.where if stated else None) or actuator.where,
                    "state a lower one, 'trend' for that of modules of such a speed, or omit it "
                    "for a straight line",
                )
            )

    def bodies(
        self, links: list[Link], placements: list[Placement]
    ) -> tuple[tuple[Body, ...], tuple[SegmentMass, ...]]:
        """Place every body and distribute the structural mass."""
        spec, p = self.spec, self.plan
        skeleton = self.skeleton(links, placements)
        reuse = self.reuse
        member_mass: dict[int, Value] = {}
        # Mass of the end, centre of the member, label of the segment.
        shared: dict[int, tuple[Value, Value, str]] = {}
        segments = []
        for k, segment in enumerate(p.segments):
            weighed = reuse.result(
                ("segment", k),
                lambda *_, segment=segment: weigh(segment, skeleton, self.r, self.errors.segments),
                *(skeleton.links[i] for i in segment.members),
                *(skeleton.places[i] for i in segment.path),
            )
            segments.append(weighed.segment)
            centre = weighed.segment.member_centre
            middle = MIDDLE if centre is None else centre
            for copy in segment.copies:
                for i, member, end in zip(copy, weighed.members, weighed.ends, strict=True):
                    member_mass[i], shared[i] = member, (end, middle, segment.label)
        radii = drawn_radii(skeleton, member_mass, reuse)
        bodies = []
        for i, written in enumerate(spec.bodies):
            link = skeleton.links[i]
            actuator = self.actuators[link.motor.actuator] if link.motor else None
            self.check_long(written.link, actuator)
            end, middle, label = shared.get(i, (0.0, MIDDLE, None))
            if link.end is not None and not link.end.of_segment and link.end.mass is not None:
                end = link.end.mass

            member, place = member_mass.get(i, 0.0), skeleton.places[i]
            numbers = (link, place, member, end, middle, radii[i], actuator, label)
            bodies.append(reuse.result(("body", i), _body, written, *numbers))
        self.check_moving_masses(bodies)
        return tuple(bodies), tuple(segments)

    def skeleton(self, links: list[Link], placements: list[Placement]) -> Skeleton:
        """Place and mirror the link of every body; no later step uses the mirrors."""
        spec, p, reuse = self.spec, self.plan, self.reuse
        copies: dict[tuple[int, Signs], Link] = {}
        own: list[Link] = []
        places: list[Frame] = []
        for i, body in enumerate(spec.bodies):
            key = (p.link_of[i], body.signs)
            link = copies.get(key)
            if link is None:
                link = copies[key] = reuse.result(key, mirrored, links[key[0]], body.signs)
            own.append(link)
            above = None if body.parent is None else links[p.link_of[body.parent]]
            placement = placements[p.placement_of[i]]
            places.append(reuse.result(("place", i), placed, placement, above, body.signs))
        for i, k in p.leaders.items():
            leader, joint = spec.bodies[k], spec.bodies[k].link.joint
            name = leader.prefix + (joint.name if joint is not None else "")
            follow = partial(coupled, name=name, body=k)
            own[i] = reuse.result(("coupled", i), follow, own[i], own[k])
        return Skeleton(spec, p, own, places)

    def check_long(self, link: WrittenLink, actuator: Actuator | None) -> None:
        """Check that a stated long side is that of a box."""
        if link.motor is None or actuator is None or actuator.is_box or actuator.shape:
            return
        if link.motor.fields.long is not None:
            raise ResolveError(
                Problem(
                    f"the motor of {link.name} states its long side, and actuator "
                    f"'{actuator.name}' is a cylinder",
                    link.motor.places["long"],
                    "remove 'long', or give the class 'kind: servo'",
                )
            )

    def check_moving_masses(self, bodies: list[Body]) -> None:
        """Check that every joint moves a mass; the dynamics is singular otherwise."""
        mass: dict[int, Value] = {}
        mover: list[int] = []
        for i, body in enumerate(bodies):
            own = body.parent is None or body.joint is not None
            mover.append(i if own else mover[body.parent or 0])
            mass[mover[i]] = mass.get(mover[i], 0.0) + body.mass
        for i, moved in mass.items():
            if i == 0:
                continue
            if is_array(moved):
                self.r.mark(~(np.asarray(moved) > 0))
            elif not moved > 0:
                link = self.spec.bodies[i].link
                raise ResolveError(
                    Problem(
                        f"'{bodies[i].name}' moves but has no mass",
                        link.joint.where if link.joint else link.where,
                        "give it a member with a segment class or a mass, a motor, or no joint",
                    )
                )
