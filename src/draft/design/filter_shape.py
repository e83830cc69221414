"""Findings about the geometry of the home pose: feet, floor and sections of the trunk."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from draft import geometry as g
from draft.design.design import Body, Design
from draft.design.findings import Finding, note
from draft.design.plan import Plan
from draft.design.solids import Pose, Solid, depth, foot_depths, trunk_depths
from draft.spec.primitives.loft import Loft
from draft.values import Value, either, maximum, minimum, some

# Reported difference of the heights of feet: share of the deepest, and at least [m].
EVEN, LEAST_UNEVEN = 0.02, 0.005
# Reported distance of a section of the trunk from the next, in widths of the section.
FAR_OFF = 1.0
# Ends of a part along its link that are not reported, as shares of the link's length.
PART_ENDS = 0.75, 1.5


def feet(design: Design, plan: Plan, home: Pose) -> Iterator[Finding]:
    """Compare the heights of the feet of legs with knees, in the home pose."""
    feet = plan.reuse(design.count).result("uneven", lambda: _uneven(design, plan))
    if len(feet) < 2:
        return
    depths = foot_depths(design, home, feet)
    deepest = maximum(*depths)
    gap = deepest - minimum(*depths)
    yield from note(
        "uneven_feet",
        design.name,
        gap > maximum(EVEN * abs(deepest), LEAST_UNEVEN),
        "the feet differ in height by {value} in the home pose: the legs differ in length, "
        "attachment or home angles",
        "geometry of the home pose",
        1000.0 * gap,
        None,
        "mm",
    )


def below_floor(design: Design, plan: Plan, home: Pose) -> Iterator[Finding]:
    """Compare the lowest points of all parts with the feet, or the floor of a fixed base."""
    reuse = plan.reuse(design.count)
    distinct = reuse.result("distinct", lambda: _distinct(design, plan))
    feet, of = foot_depths(design, home, distinct), "feet"
    if not design.floating:
        feet, of = [0.0], "floor"
    if not feet:
        return
    floor = maximum(*feet)
    limit = floor + maximum(EVEN * abs(floor), LEAST_UNEVEN)
    for i in distinct:
        body, parts = design.bodies[i], home.solids(i)
        # The spheres around solids tell at once that most are above the floor.
        near = some(reuse.result(("reach", i), _reach, parts) > limit)
        depths = [depth(part) for part in parts] if near else []
        if body.parent is None:
            depths += trunk_depths(design)
        if not depths:
            continue
        lowest = maximum(*depths)
        yield from note(
            "below_floor",
            body.name,
            lowest > limit,
            f"a part of '{body.name}' is {{value}} below the {of} in the home pose",
            "geometry of the home pose",
            1000.0 * (lowest - floor),
            None,
            "mm",
        )


def _reach(parts: Sequence[Solid]) -> Value:
    """Distance from the trunk's origin down to the lowest point of spheres around solids [m]."""
    return maximum(-math.inf, *(part.reach - part.center[2] for part in parts))


def _distinct(design: Design, plan: Plan) -> list[int]:
    """Indices of the bodies of which no copy on the other side comes before."""
    paths: dict[int, tuple[object, ...]] = {}
    seen: set[object] = set()
    for i, body in enumerate(design.bodies):
        if body.parent is None:
            paths[i] = ()
        elif body.parent in paths:
            signs = design.spec.bodies[i].signs
            own = (plan.link_of[i], plan.placement_of[i], signs[0], signs[2])
            path = (*paths[body.parent], own)
            if path not in seen:
                seen.add(path)
                paths[i] = path
    return [*paths]


def off_tip(design: Design, plan: Plan) -> Iterator[Finding]:
    """Compare the drawn links of a segment with its length, which ends at the next joint.

    They differ where the `at` of the next joint is not the tip of its parent.
    """
    written, bodies = design.spec.bodies, design.bodies
    for segment, weighed in zip(plan.segments, design.segments, strict=True):
        stated = [j for j in segment.exits if written[j].placement.at is not None]
        if not stated:
            continue
        drawn: Value = 0.0
        for i in segment.members:
            point, here = bodies[i].link.tip, i
            while here != segment.head:
                point = g.add(bodies[here].position, g.rotate(bodies[here].rotation, point))
                here = bodies[here].parent or segment.head
            drawn = maximum(drawn, g.norm(point))
        name = weighed.bodies[0]
        yield from note(
            "off_tip",
            name,
            drawn > weighed.length * (1 + EVEN) + LEAST_UNEVEN,
            f"the links of '{name}' are drawn {{value}} long and count as {{limit}}, the distance "
            f"between their joints: 'at' of '{bodies[stated[0]].name}' is not at the tip",
            "tree.yaml",
            drawn,
            weighed.length,
            "m",
        )


def off_part(body: Body) -> Iterator[Finding]:
    """Compare the end of a part of one's own with the tip of its link, which may have moved."""
    member, shape = body.link.member, body.link.shape
    if member is None or shape is None:
        return
    along = np.stack(np.broadcast_arrays(*member.axis))
    reach = np.max(shape.mesh.vertices @ along, axis=0)
    value: Value = reach if np.ndim(reach) else float(reach)
    short, long = (share * member.length for share in PART_ENDS)
    yield from note(
        "off_part",
        body.name,
        either(value < short, value > long),
        f"'{shape.mesh.file}' of '{body.name}' ends at {{value}} along its link, whose tip is at "
        "{limit}: a part does not grow with its link",
        "tree.yaml",
        value,
        member.length,
        "m",
    )


def sections(design: Design, loft: Loft) -> Iterator[Finding]:
    """Compare the place of each section of the trunk with its own width."""
    written = design.spec.root
    if written is None or all(s.offset is None and s.polygon is None for s in written.sections):
        return  # All are centred on the axis of the loft.
    points = loft.vertices.reshape(loft.sections, loft.corners, *loft.vertices.shape[1:])
    across = [k for k, name in enumerate("xyz") if name != written.axis]
    low, high = points.min(axis=1)[:, across], points.max(axis=1)[:, across]
    centres, widths = (low + high) / 2, high - low
    for i in range(loft.sections):
        others = [centres[k] for k in range(loft.sections) if k != i]
        off = np.min([np.max(abs(centres[i] - c) / widths[i], axis=0) for c in others], axis=0)
        value: Value = off if np.ndim(off) else float(off)
        yield from note(
            "trunk_section",
            design.bodies[0].name,
            value > FAR_OFF,
            f"section {i + 1} of the trunk is {{value}} of its own widths beside the nearest one: "
            "look at its offset, in m",
            "root.yaml",
            value,
        )


def _uneven(design: Design, plan: Plan) -> list[int]:
    """Feet of the legs with knees; none if the legs are copies, whose feet have the same height."""
    kinds = {segment.label: segment.kind for segment in design.segments}
    feet: list[int] = []
    copies: set[object] = set()
    for i in design.feet:
        path = [i]
        while parent := design.bodies[path[-1]].parent:
            path.append(parent)
        if not any(kinds.get(design.bodies[k].segment or "") == "shank" for k in path):
            continue
        feet.append(i)
        own = [(k, design.spec.bodies[k].signs) for k in path]
        copies.add(tuple((plan.link_of[k], plan.placement_of[k], s[0], s[2]) for k, s in own))
    return feet if len(copies) > 1 else []
