"""Structural mass of a design: mass of each rigid segment, distributed over its members."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from draft import geometry as g
from draft.design.design import SegmentMass
from draft.design.parts import Link
from draft.design.plan import Plan, Segment
from draft.design.reuse import Reuse
from draft.errors import Problem, ResolveError
from draft.geometry import Frame, Vector
from draft.spec import Spec
from draft.spec.evaluate import Evaluator
from draft.spec.primitives.basic import MemberPart
from draft.values import Value, clip, exp, is_array, maximum, some, sqrt

# Range of the centre of a rod of two halves: one half has no mass at its ends.
CENTRES = (0.25, 0.75)
LIGHTEST = 1e-12


@dataclass(frozen=True, slots=True)
class Skeleton:
    """Links and frames of a design without masses.

    Attributes:
        spec: the spec.
        plan: its plan.
        links: numbers of every body's link, mirrored.
        places: frame of every body in that of its parent.
    """

    spec: Spec
    plan: Plan
    links: Sequence[Link]
    places: Sequence[Frame]

    def from_head(self, head: int, body: int, point: Vector) -> Vector:
        """Transform a point of a body to the frame of a body above it, all joints at zero [m]."""
        while body != head:
            origin, rotation = self.places[body]
            point = g.add(origin, g.rotate(rotation, point))
            parent = self.spec.bodies[body].parent
            body = head if parent is None else parent
        return point


@dataclass(frozen=True, slots=True)
class Weighed:
    """Mass of a segment, and of each of its members and ends [kg]."""

    segment: SegmentMass
    members: list[Value]
    ends: list[Value]


def weigh(
    segment: Segment, skeleton: Skeleton, r: Evaluator, errors: Mapping[str, Value]
) -> Weighed:
    """Mass of a segment, predicted from its length or stated, and its distribution.

    The sphere or plate at the end takes its mass first; the members share the rest by length. An
    end with a stated mass above that of the segment increases the mass of the segment, and a part
    of one's own has its own mass in place of the share of its member.
    """
    own = [skeleton.links[i] for i in segment.members]
    length = _length(segment, skeleton, r)
    parts = [link.shape.mass if link.shape else None for link in own]
    stated = own[0].member.mass if own[0].member else None
    stated = parts[0] if stated is None else stated
    if segment.trend is None and stated is not None:
        mass = stated
    else:
        mass = _trend_mass(segment, length, skeleton)
        error = errors.get(segment.trend or "", 0.0)
        mass = mass * exp(error) if some(error != 0.0) else mass
    density = skeleton.plan.population.end_density
    ends: list[Value] = [
        k.end.weigh(mass, density) if k.end is not None and k.end.of_segment else 0.0 for k in own
    ]
    rest = maximum(mass - g.total(ends), 0.0)
    lengths = [link.member.length if link.member else 0.0 for link in own]
    span = g.total(lengths)
    if not is_array(span) and span == 0.0:
        members: list[Value] = [0.0 for _ in own]
        ends = [mass / len(own) for _ in own]
    else:
        members = [rest * length / span for length in lengths]
    # A part has its own mass, and leaves the others and the end what they have without it.
    members = [m if part is None else part for m, part in zip(members, parts, strict=True)]
    names = tuple(skeleton.spec.bodies[i].name for i in segment.members)
    mass = g.total(members) + g.total(ends)
    written = skeleton.spec.bodies[segment.members[0]].link.member
    kind = segment.trend or (written.fields.segment if written else None)
    copies = len(segment.copies)
    centre = _member_centre(segment, own, members[0], ends[0], skeleton)
    of_parts = g.total(part for part in parts if part is not None)
    by_law = any(part is None for part in parts)
    by_law = by_law or any(k.end and k.end.of_segment and k.end.mass is None for k in own)
    trend = segment.trend if by_law else None
    weighed = SegmentMass(segment.label, trend, kind, length, mass, centre, names, copies, of_parts)
    return Weighed(weighed, members, ends)


def _member_centre(
    segment: Segment, own: Sequence[Link], member: Value, end: Value, skeleton: Skeleton
) -> Value | None:
    """Centre of a member such that its segment, with the end at its tip, has that of the class.

    A share of the length of the member; None if the centre of the class is unknown, the segment
    has several members, or the member is a part, which has its own.
    """
    known = skeleton.plan.population.centres.get(segment.trend or "")
    if known is None or len(own) > 1 or own[0].member is None or own[0].shape is not None:
        return None
    centre = known.value
    return clip(centre - (1.0 - centre) * end / maximum(member, LIGHTEST), *CENTRES)


def drawn_radii(skeleton: Skeleton, member_mass: dict[int, Value], reuse: Reuse) -> list[Value]:
    """Drawn radius of the member of every body [m]: stated, or that at the density of the trunk."""
    link_of, density = skeleton.plan.link_of, skeleton.plan.population.trunk_density
    mass_of = {link_of[i]: mass for i, mass in member_mass.items()}
    known: dict[int, Value] = {}
    for k, link in zip(link_of, skeleton.links, strict=True):
        if k not in known:
            mass = mass_of.get(k, 0.0)
            known[k] = reuse.result(("radius", k), _drawn_radius, link.member, mass, density)
    return [known[k] for k in link_of]


def _drawn_radius(member: MemberPart | None, mass: Value, density: float) -> Value:
    if member is None:
        return 0.0
    if member.radius is not None:
        return member.radius
    volume, length = mass / density, member.length
    return clip(sqrt(volume / (math.pi * length)), 0.05 * length, 0.5 * length)


def _length(segment: Segment, skeleton: Skeleton, r: Evaluator) -> Value:
    """Joint-to-joint length of a segment [m]; to the furthest tip if no joint follows."""
    head = segment.head
    ends = [(i, g.ZERO) for i in segment.exits]
    if not ends:
        ends = [(i, skeleton.links[i].tip) for i in segment.members]
    length = maximum(*(g.norm(skeleton.from_head(head, i, point)) for i, point in ends))
    if is_array(length):
        r.mark(~(np.asarray(length) > 0))
    elif not length > 0 and segment.trend is not None:
        first = skeleton.spec.bodies[segment.members[0]]
        raise ResolveError(
            Problem(
                f"the segment of '{first.name}' has no length",
                first.link.where,
                "give its link a length",
            )
        )
    return length


def _trend_mass(segment: Segment, length: Value, skeleton: Skeleton) -> Value:
    """Structural mass of a segment by the trend of the population [kg]."""
    population = skeleton.plan.population
    trend = population.segments.get(segment.trend or "")
    if trend is None:
        link = skeleton.spec.bodies[segment.members[0]].link
        raise ResolveError(
            Problem(
                f"the {population.name} population has no segment class '{segment.trend}'",
                link.member.places["segment"] if link.member else link.where,
                f"use one of {', '.join(population.segments)}, or state the mass of the member",
            )
        )
    return trend(length)
