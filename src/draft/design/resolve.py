"""Spec + values + trends -> Design."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from draft import geometry as g
from draft.design import loft as lofting
from draft.design.actuators import Actuator, size
from draft.design.design import Body, Design, SegmentMass, Trunk
from draft.design.filter import inspect
from draft.design.parts import Link, Placement, Plate, Reader, Sphere, read_link, read_placement
from draft.design.plan import Plan, Segment, plan
from draft.design.table import Table, read_table
from draft.errors import DraftError, Location, Problem, ResolveError
from draft.geometry import Vector
from draft.spec import Spec
from draft.spec.graph import READABLE
from draft.spec.spec import ActuatorClass, Parameter, Section
from draft.trends import catalogue
from draft.values import Value, clip, is_array, maximum, minimum, sqrt

# Solid rubber or polymer; the foot of a Go2 (40 g, radius 22 mm) has 900.
END_DENSITY = 1000.0
END_SHARE = 0.5


def resolve(
    spec: Spec,
    values: Mapping[str, object],
    label: str = "custom",
    places: Mapping[str, Location] | None = None,
) -> Design:
    """Give every number of a spec a value; see `Spec.resolve`."""
    p = plan(spec)
    table = read_table(spec, values, places or {}, p.order)
    with np.errstate(all="ignore"):
        return _Resolver(spec, p, table).run(label, values)


class _Resolver:
    def __init__(self, spec: Spec, p: Plan, table: Table) -> None:
        self.spec = spec
        self.plan = p
        self.table = table
        self.env: dict[str, Value] = {}
        self.r = Reader(self.env)
        self.actuators: dict[str, Actuator] = {}

    def run(self, label: str, values: Mapping[str, object]) -> Design:
        spec, p = self.spec, self.plan
        for name in self.table.order:
            if name.endswith("."):
                self.actuator(spec.actuators[name[:-1]])
            else:
                self.parameter(spec.parameters[name])
        links = [read_link(link, self.r) for link in p.links]
        placements = [read_placement(placement, self.r) for placement in p.placements]
        bodies, segments = self.bodies(links, placements)
        design = Design(
            spec=spec,
            label=label,
            values=dict(values),
            count=self.table.count,
            parameters={name: self.env[name] for name in spec.parameters},
            actuators={name: self.actuators[name] for name in spec.actuators},
            bodies=bodies,
            trunk=self.trunk(),
            segments=segments,
            findings=(),
        )
        return replace(design, findings=inspect(design, p, self.r.invalid))

    def parameter(self, parameter: Parameter) -> None:
        """Evaluate one parameter and hold it against its bounds."""
        name = parameter.name
        expression = self.table.replaced.get(name) or parameter.value
        value = self.table.arrays.get(name)
        if value is None:
            value = self.r.number(expression, name)
        self.env[name] = value
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
        raise ResolveError(
            Problem(
                f"{parameter.name} = {value:g}{unit}{came} is outside its range "
                f"[{low:g}, {high:g}]",
                self.table.place(parameter.name) or expression.where,
                f"range declared at {parameter.where}",
            )
        )

    def actuator(self, actuator: ActuatorClass) -> None:
        """Evaluate and size one actuator class."""
        name = actuator.name
        stated: dict[str, Value] = {}
        for quantity, expression in self.table.stated(actuator).items():
            what = f"actuators.{name}.{quantity}"
            may_be_zero = quantity in ("friction_loss", "damping")
            read = self.r.at_least_zero if may_be_zero else self.r.positive
            array = self.table.arrays.get(what)
            if array is None:
                stated[quantity] = read(expression, what)
                continue
            stated[quantity] = array
            if not np.all(array >= 0 if may_be_zero else array > 0):
                raise ResolveError(Problem(f"{what} has entries that are not above zero"))
        like = self.table.like.get(name, actuator.like)
        try:
            part = catalogue.find(like) if like is not None else None
        except DraftError as error:
            problem = error.problems[0]
            where = self.table.place(f"actuators.{name}.like") or actuator.like_where
            raise ResolveError(Problem(problem.cause, where, problem.remedy)) from None
        try:
            sized = size(name, stated, part, actuator.where)
        except OverflowError:
            raise ResolveError(
                Problem(f"the numbers of actuator '{name}' are too large", actuator.where)
            ) from None
        self.actuators[name] = sized
        for quantity in READABLE:
            self.env[f"{name}.{quantity}"] = getattr(sized, quantity)

    def bodies(
        self, links: list[Link], placements: list[Placement]
    ) -> tuple[tuple[Body, ...], tuple[SegmentMass, ...]]:
        """Place every body and share out the structural mass."""
        spec, p = self.spec, self.plan
        origins: list[Vector] = []
        for i, body in enumerate(spec.bodies):
            at = placements[p.placement_of[i]].at
            if at is None:
                at = links[p.link_of[body.parent]].tip if body.parent is not None else g.ZERO
            origins.append(at)
        member_mass: dict[int, Value] = {}
        end_mass: dict[int, Value] = {}
        label: dict[int, str] = {}
        segments = []
        for segment in p.segments:
            weighed = self.segment(segment, links, placements, origins)
            segments.append(weighed[0])
            for copy in segment.copies:
                for i, member, end in zip(copy, weighed[1], weighed[2], strict=True):
                    member_mass[i], end_mass[i], label[i] = member, end, segment.label
        radii = self.radii(links, p, member_mass)
        bodies = []
        for i, body in enumerate(spec.bodies):
            link = links[p.link_of[i]]
            position, rotation = origins[i], placements[p.placement_of[i]].rotation
            if body.signs != (1.0, 1.0, 1.0):
                position = g.multiply(position, body.signs)
                rotation = g.mirrored(rotation, body.signs)
            actuator = self.actuators[link.motor.actuator] if link.motor else None
            bodies.append(
                Body(
                    body.name,
                    body.prefix,
                    body.parent,
                    link,
                    body.signs,
                    position,
                    rotation,
                    member_mass.get(i, 0.0),
                    end_mass.get(i, 0.0),
                    radii[p.link_of[i]],
                    actuator,
                    label.get(i),
                )
            )
        return tuple(bodies), tuple(segments)

    def segment(
        self,
        segment: Segment,
        links: list[Link],
        placements: list[Placement],
        origins: list[Vector],
    ) -> tuple[SegmentMass, list[Value], list[Value]]:
        """Weigh one segment: its mass, and each member's and end effector's share of it."""
        p, bodies = self.plan, self.spec.bodies
        own = [links[p.link_of[i]] for i in segment.members]
        length = self.length(segment, links, placements, origins)
        stated = own[0].member.mass if own[0].member else None
        if segment.trend is None and stated is not None:
            mass = stated
        else:
            mass = self.trend_mass(segment, length)
        ends: list[Value] = []
        for link in own:
            ends.append(_end_mass(link.end, mass) if link.end is not None else 0.0)
        rest = maximum(mass - g.total(ends), 0.0)
        lengths = [link.member.length if link.member else 0.0 for link in own]
        span = g.total(lengths)
        if not is_array(span) and span == 0.0:
            members: list[Value] = [0.0 for _ in own]
            ends = [mass / len(own) for _ in own]
        else:
            members = [rest * length / span for length in lengths]
        mass = g.total(members) + g.total(ends)
        names = tuple(bodies[i].name for i in segment.members)
        weighed = SegmentMass(
            segment.label, segment.trend, length, mass, names, len(segment.copies)
        )
        return weighed, members, ends

    def trend_mass(self, segment: Segment, length: Value) -> Value:
        """Structural mass that the population's trend gives a segment [kg]."""
        name = segment.trend or ""
        trend = self.plan.population.segments.get(name)
        if trend is None:
            body = self.spec.bodies[segment.members[0]]
            known = ", ".join(self.plan.population.segments)
            raise ResolveError(
                Problem(
                    f"the {self.plan.population.name} population has no segment class '{name}'",
                    body.link.member.where if body.link.member else body.link.where,
                    f"use one of: {known}; or state the member's mass",
                )
            )
        return trend.mass(length)

    def length(
        self,
        segment: Segment,
        links: list[Link],
        placements: list[Placement],
        origins: list[Vector],
    ) -> Value:
        """Joint-to-joint length of a segment [m]; to the furthest tip where no joint follows."""
        p = self.plan
        reach: list[Value] = []
        for i in segment.exits:
            reach.append(g.norm(self._from_head(segment.head, i, g.ZERO, placements, origins)))
        if not reach:
            for i in segment.members:
                tip = links[p.link_of[i]].tip
                reach.append(g.norm(self._from_head(segment.head, i, tip, placements, origins)))
        length = maximum(*reach)
        name = self.spec.bodies[segment.members[0]].name
        if is_array(length):
            self.r.mark(~(np.asarray(length) > 0))
        elif not length > 0 and segment.trend is not None:
            where = self.spec.bodies[segment.members[0]].link.where
            raise ResolveError(
                Problem(f"the segment of '{name}' has no length", where, "give its link a length")
            )
        return length

    def _from_head(
        self,
        head: int,
        body: int,
        point: Vector,
        placements: list[Placement],
        origins: list[Vector],
    ) -> Vector:
        """A point of a body in the frame of the segment's head, all joints at zero."""
        while body != head:
            rotation = placements[self.plan.placement_of[body]].rotation
            point = g.add(origins[body], g.rotate(rotation, point))
            parent = self.spec.bodies[body].parent
            body = head if parent is None else parent
        return point

    def radii(self, links: list[Link], p: Plan, member_mass: dict[int, Value]) -> list[Value]:
        """Drawn radius of every link's member: stated, or as wide as trunk density makes it."""
        radii: list[Value] = [0.0] * len(links)
        mass_of = {p.link_of[i]: mass for i, mass in member_mass.items()}
        for k, link in enumerate(links):
            if link.member is None:
                continue
            if link.member.radius is not None:
                radii[k] = link.member.radius
                continue
            volume = mass_of.get(k, 0.0) / p.population.trunk_density
            length = link.member.length
            radii[k] = clip(sqrt(volume / (math.pi * length)), 0.05 * length, 0.5 * length)
        return radii

    def trunk(self) -> Trunk:
        """Loft the trunk and weigh it."""
        root = self.spec.root
        places: list[Value] = []
        sections: list[list[lofting.Pair]] = []
        plain = all(s.chamfer is None or s.chamfer.constant == 0.0 for s in root.sections)
        for section in root.sections:
            at = self.r.number(section.at, "place of a section")
            if places:
                self.r.require(
                    at > places[-1],
                    section.at,
                    "place of a section",
                    at,
                    "must be beyond the section before",
                )
            places.append(at)
            sections.append(self.section(section, plain))
            if len(sections[-1]) != len(sections[0]):
                raise ResolveError(
                    Problem(
                        f"a section of {len(sections[-1])} corners after one of {len(sections[0])}",
                        section.where,
                        "all sections need the same number; a chamfered rectangle has 8",
                    )
                )
        convex = all(section.polygon is None for section in root.sections)
        solid = lofting.loft(root.axis, places, sections, convex)
        if root.density is None:
            density: Value = self.plan.population.trunk_density
        else:
            density = self.r.positive(root.density, "density of the trunk")
        return Trunk(density, root.density is not None, density * solid.volume, solid)

    def section(self, section: Section, plain: bool) -> list[lofting.Pair]:
        """Corners of one cross-section."""
        if section.rectangle is not None:
            a = self.r.positive(section.rectangle[0], "width of a section")
            b = self.r.positive(section.rectangle[1], "height of a section")
            chamfer = None
            if not plain and section.chamfer is not None:
                chamfer = self.r.at_least_zero(section.chamfer, "chamfer")
                self.r.require(
                    chamfer < 0.5,
                    section.chamfer,
                    "chamfer",
                    chamfer,
                    "must be below 0.5 of the shorter side",
                )
            corners = lofting.rectangle(a, b, chamfer)
        else:
            corners = [(self.r.number(x), self.r.number(y)) for x, y in section.polygon or ()]
            self._check_polygon(section, corners)
        if section.offset is None:
            return corners
        dx, dy = (self.r.number(x) for x in section.offset)
        return [(x + dx, y + dy) for x, y in corners]

    def _check_polygon(self, section: Section, corners: list[lofting.Pair]) -> None:
        edges = lofting.crossing(corners)
        if edges is not None:
            raise ResolveError(
                Problem(
                    f"edges {edges[0] + 1} and {edges[1] + 1} of this polygon cross",
                    section.where,
                    "list the corners in order around it",
                )
            )
        area = lofting.area(corners)
        if is_array(area):
            self.r.mark(~(np.asarray(area) > 0))
        elif not area > 0:
            raise ResolveError(
                Problem(
                    "the corners of this polygon run clockwise, or enclose nothing",
                    section.where,
                    "list them counter-clockwise",
                )
            )


def _end_mass(end: Sphere | Plate, mass: Value) -> Value:
    """Mass of an end effector [kg]: stated, or a solid of 1000 kg/m3 and at most half."""
    if end.mass is not None:
        return minimum(end.mass, mass)
    if isinstance(end, Sphere):
        volume = 4 / 3 * math.pi * end.radius * end.radius * end.radius
    else:
        volume = end.size[0] * end.size[1] * end.size[2]
    return minimum(END_DENSITY * volume, END_SHARE * mass)
