"""Plan of a spec: its topology, prepared once for every resolve.

Bodies that move as one are grouped, structural members that share the mass of a segment are
collected, and pairs of actuators that could overlap are listed. Copies of a chain have the same key
and are treated once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from weakref import WeakKeyDictionary

from draft.design.reuse import Reuse
from draft.laws.actuators import Laws, laws, read_laws
from draft.laws.catalogue import Part, catalogue, with_rows
from draft.laws.structure import Population, population, read_population
from draft.spec import Spec
from draft.spec.check import expressions, rigid_bases
from draft.spec.coupling import leaders
from draft.spec.graph import order
from draft.spec.links import Link
from draft.spec.tree import Body, Placement

_plans: WeakKeyDictionary[Spec, Plan]


@dataclass(frozen=True, slots=True)
class Segment:
    """A rigid structural segment: the members of one class that move together.

    Attributes:
        label: name of the class, or of the first body if masses are stated.
        trend: segment class whose trend predicts its mass; None if every member states its mass.
        head: body at whose origin it begins: that of the joint, or the first member if it is fixed
            to the trunk or to a segment of another class.
        members: bodies with a structural member, or an end that is part of the segment.
        exits: bodies whose joints end it: first joints of the next segments.
        path: bodies below the head down to its exits, or down to its members without exits.
        copies: members of each copy, this one first.
    """

    label: str
    trend: str | None
    head: int
    members: tuple[int, ...]
    exits: tuple[int, ...]
    path: tuple[int, ...]
    copies: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True)
class Consecutive:
    """Two actuators with no other between them on the path from the trunk outwards.

    Attributes:
        first, second: their bodies.
        path: bodies below the first one, down to the second one.
        joint: place in the path of the body of the single joint between them; None if they are
            fixed to each other.
    """

    first: int
    second: int
    path: tuple[int, ...]
    joint: int | None


@dataclass(frozen=True, slots=True)
class Plan:
    """Topology of a spec, prepared for resolving.

    Attributes:
        order: parameters and actuator classes, each after its inputs.
        links: unique links; `link_of` holds the index for each body.
        placements: unique placements; `placement_of` holds the index for each body.
        link_reads, placement_reads, root_reads: names of the numbers that each reads.
        segments: unique structural segments.
        consecutive: unique pairs of consecutive actuators.
        limbs: serial runs of bodies.
        limb_pairs: unique pairs of limbs of which neither is below the other.
        population: structure trends, with the law of the trunk that holds.
        laws: actuator trends.
        leaders: body of the joint that each coupled joint follows, by the body of the coupled one;
            each after the one that it follows.
        own: modules of the spec's own table.
        last: results of the last single design.
    """

    order: list[str]
    links: tuple[Link, ...]
    link_of: tuple[int, ...]
    placements: tuple[Placement, ...]
    placement_of: tuple[int, ...]
    link_reads: tuple[tuple[str, ...], ...]
    placement_reads: tuple[tuple[str, ...], ...]
    root_reads: tuple[str, ...]
    segments: tuple[Segment, ...]
    consecutive: tuple[Consecutive, ...]
    limbs: tuple[tuple[int, ...], ...]
    limb_pairs: tuple[tuple[int, int], ...]
    population: Population
    laws: Laws
    leaders: Mapping[int, int] = field(default_factory=dict)
    own: tuple[Part, ...] = ()
    last: Reuse = field(default_factory=Reuse)

    def reuse(self, count: int | None) -> Reuse:
        """Results that a design of the spec takes over; of N designs none."""
        return self.last if count is None else _NOTHING


_NOTHING = Reuse(keeps=False)
_plans = WeakKeyDictionary()


def plan(spec: Spec) -> Plan:
    """Plan of a spec, computed on first use."""
    known = _plans.get(spec)
    if known is None:
        known = _plans[spec] = _make(spec)
    return known


def _make(spec: Spec) -> Plan:
    bodies = spec.bodies
    links = list({id(b.link): b.link for b in bodies}.values())
    by_text = {_text(b.placement): b.placement for b in reversed(bodies)}
    placements = list(by_text.values())
    link_index = {id(link): i for i, link in enumerate(links)}
    placement_index = {text: i for i, text in enumerate(by_text)}
    link_of = tuple(link_index[id(b.link)] for b in bodies)
    placement_of = tuple(placement_index[_text(b.placement)] for b in bodies)
    keys = list(zip(link_of, placement_of, strict=True))
    limbs = _limbs(bodies)
    return Plan(
        order=order(spec.parameters, spec.actuators, {}),
        links=tuple(links),
        link_of=link_of,
        placements=tuple(placements),
        placement_of=placement_of,
        link_reads=tuple(map(_reads, links)),
        placement_reads=tuple(map(_reads, placements)),
        root_reads=_reads(spec.root),
        segments=_segments(bodies, keys),
        consecutive=_consecutive(bodies, keys),
        limbs=limbs,
        limb_pairs=_limb_pairs(bodies, limbs, keys),
        population=_population(spec),
        laws=laws(spec.trends) if isinstance(spec.trends, str) else read_laws(spec.trends),
        leaders=leaders(bodies),
        own=_own(spec),
    )


def _reads(written: object) -> tuple[str, ...]:
    """Names that the expressions of a part as written read."""
    return tuple(sorted({name for each in expressions(written, set()) for name in each.names}))


def _own(spec: Spec) -> tuple[Part, ...]:
    """Modules of the table that the spec names, besides the shipped ones."""
    if spec.catalogue is None:
        return ()
    parts, _ = with_rows([spec.catalogue])
    return tuple(part for name, part in parts.items() if name not in catalogue())


def _population(spec: Spec) -> Population:
    if isinstance(spec.structure, str):
        return population(spec.population, spec.structure)
    return read_population(spec.population, spec.structure)


def _text(placement: Placement) -> tuple[tuple[str, ...] | None, ...]:
    """Text of a placement; placements with the same text have the same numbers."""
    return tuple(
        None if triple is None else tuple(e.text for e in triple)
        for triple in (placement.at, placement.rpy)
    )


def _segments(bodies: tuple[Body, ...], keys: list[tuple[int, int]]) -> tuple[Segment, ...]:
    """Collect the members that share a class and move together; one segment per set of copies."""
    base = rigid_bases(bodies)
    groups: dict[tuple[int, str | int], list[int]] = {}
    leading: dict[int, str] = {}
    for i, body in enumerate(bodies):
        member = body.link.member
        if not body.link.structural:
            continue
        classed = member is not None and member.fields.segment is not None
        stated = member is not None and "mass" in member.numbers
        if stated or (body.link.states_mass and not classed):
            groups[(base[i], i)] = [i]
            continue
        name = (member.fields.segment if member else None) or leading[base[i]]
        leading.setdefault(base[i], name)
        groups.setdefault((base[i], name), []).append(i)
    copies: dict[object, list[Segment]] = {}
    for (head, name), members in groups.items():
        leads = leading.get(head) == name
        exits = [
            j
            for j, other in enumerate(bodies)
            if leads
            and other.link.joint is not None
            and j != head
            and other.parent is not None
            and base[other.parent] == head
        ]
        trend = name if isinstance(name, str) else None
        first = head if leads else members[0]
        path = sorted({k for j in (exits or members) for k in _between(bodies, first, j)})
        label = trend or bodies[members[0]].name
        segment = Segment(label, trend, first, tuple(members), tuple(exits), tuple(path), ())
        shape = tuple((keys[j], _relative(bodies, first, j)) for j in (*members, *exits))
        copies.setdefault((keys[first], trend, shape), []).append(segment)
    return tuple(
        replace(same[0], copies=tuple(segment.members for segment in same))
        for same in copies.values()
    )


def _between(bodies: tuple[Body, ...], head: int, body: int) -> list[int]:
    """Bodies below one body, down to another that is below it; none from a body to itself."""
    path: list[int] = []
    while body != head:
        path.append(body)
        body = bodies[body].parent or head
    return path[::-1]


def _relative(bodies: tuple[Body, ...], a: int, b: int) -> tuple[float, ...]:
    """Mirror signs of a body relative to those of another."""
    return tuple(x * y for x, y in zip(bodies[a].signs, bodies[b].signs, strict=True))


def _consecutive(bodies: tuple[Body, ...], keys: list[tuple[int, int]]) -> tuple[Consecutive, ...]:
    """Pair each motor with the next one above it, if at most one joint is between them."""
    found: dict[object, Consecutive] = {}
    for i, body in enumerate(bodies):
        if body.link.motor is None:
            continue
        joints: list[int] = []
        path: list[object] = [keys[i]]
        here = i
        while (parent := bodies[here].parent) is not None and len(joints) <= 1:
            if bodies[here].link.joint is not None:
                joints.append(here)
            here = parent
            path.append((keys[here], _relative(bodies, i, here)))
            if bodies[here].link.motor is not None:
                if len(joints) <= 1:
                    between = tuple(_between(bodies, here, i))
                    joint = between.index(joints[0]) if joints else None
                    pair = Consecutive(here, i, between, joint)
                    found.setdefault(tuple(path), pair)
                break
    return tuple(found.values())


def _limbs(bodies: tuple[Body, ...]) -> tuple[tuple[int, ...], ...]:
    """Split the tree into serial runs, which end at bodies with several children."""
    children: dict[int, int] = {}
    for body in bodies:
        if body.parent is not None:
            children[body.parent] = children.get(body.parent, 0) + 1
    runs: list[list[int]] = []
    run_of: dict[int, int] = {}
    for i, body in enumerate(bodies):
        if body.parent is None:
            continue
        if body.parent in run_of and children[body.parent] == 1:
            run_of[i] = run_of[body.parent]
            runs[run_of[i]].append(i)
        else:
            run_of[i] = len(runs)
            runs.append([i])
    return tuple(tuple(run) for run in runs)


def _limb_pairs(
    bodies: tuple[Body, ...],
    limbs: tuple[tuple[int, ...], ...],
    keys: list[tuple[int, int]],
) -> tuple[tuple[int, int], ...]:
    """Pairs of limbs of which neither is below the other, one per set of mirror images."""
    above: list[set[int]] = []
    for limb in limbs:
        ancestors: set[int] = set()
        parent = bodies[limb[0]].parent
        while parent is not None:
            ancestors.add(parent)
            parent = bodies[parent].parent
        above.append(ancestors)
    unique: dict[object, tuple[int, int]] = {}
    for i, first in enumerate(limbs):
        for j in range(i + 1, len(limbs)):
            second = limbs[j]
            if above[j] & set(first) or above[i] & set(second):
                continue
            relative = _relative(bodies, first[0], second[0])
            shared = above[i] == above[j]
            ends = (tuple(keys[k] for k in first), tuple(keys[k] for k in second))
            key = (frozenset(ends), relative) if shared else (i, j)
            unique.setdefault(key, (i, j))
    return tuple(unique.values())
