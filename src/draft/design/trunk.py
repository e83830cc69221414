"""The trunk of a design: its sections evaluated, lofted and weighed."""

from __future__ import annotations

import numpy as np

from draft.design import loft as lofting
from draft.design.design import Trunk
from draft.errors import Problem, ResolveError
from draft.spec.evaluate import Evaluator
from draft.spec.spec import Root, Section
from draft.trends.structure import Population
from draft.values import Value, is_array


def make_trunk(root: Root, people: Population, r: Evaluator) -> Trunk:
    """Loft the trunk and weigh it."""
    places: list[Value] = []
    sections: list[list[lofting.Pair]] = []
    plain = all(s.chamfer is None or s.chamfer.constant == 0.0 for s in root.sections)
    for section in root.sections:
        at = r.number(section.at, "place of a section")
        if places:
            r.require(
                at > places[-1],
                section.at,
                "place of a section",
                at,
                "must be beyond the section before",
            )
        places.append(at)
        sections.append(_corners(section, plain, r))
        if len(sections[-1]) != len(sections[0]):
            raise ResolveError(
                Problem(
                    f"a section of {len(sections[-1])} corners after one of {len(sections[0])}",
                    section.where,
                    "all sections need the same number; a chamfered rectangle has 8",
                )
            )
        if section.polygon is not None and len(sections) > 1:
            _check_pairing(section, sections[-2], sections[-1])
    convex = all(section.polygon is None for section in root.sections)
    solid = lofting.loft(root.axis, places, sections, convex)
    if root.density is None:
        density: Value = people.trunk_density
    else:
        density = r.positive(root.density, "density of the trunk")
    return Trunk(density, root.density is not None, density * solid.volume, solid)


def _check_pairing(
    section: Section, before: list[lofting.Pair], corners: list[lofting.Pair]
) -> None:
    """Refuse a loft that twists because a polygon's corners are counted from another one.

    Corners pair by their order, so of all ways to count them the given one must be the nearest.
    Many designs are not looked at: a twist of one is a mistake of the spec.
    """
    if any(is_array(x) for corner in (*before, *corners) for x in corner):
        return
    first, second = (np.array(points, dtype=np.float64) for points in (before, corners))
    first, second = first - first.mean(axis=0), second - second.mean(axis=0)
    distances = [
        float(np.sum((first - np.roll(second, -shift, axis=0)) ** 2))
        for shift in range(len(second))
    ]
    best = int(np.argmin(distances))
    if distances[best] < distances[0] * (1 - 1e-9):
        raise ResolveError(
            Problem(
                "the loft to this polygon twists: corners pair with those of the section before "
                "in their order",
                section.where,
                f"begin the list with what is now corner {best + 1}; a rectangle begins at its "
                "lower left",
            )
        )


def _corners(section: Section, plain: bool, r: Evaluator) -> list[lofting.Pair]:
    """Corners of one cross-section."""
    if section.rectangle is not None:
        a = r.positive(section.rectangle[0], "width of a section")
        b = r.positive(section.rectangle[1], "height of a section")
        chamfer = None
        if not plain and section.chamfer is not None:
            chamfer = r.at_least_zero(section.chamfer, "chamfer")
            r.require(
                chamfer < 0.5,
                section.chamfer,
                "chamfer",
                chamfer,
                "must be below 0.5 of the shorter side",
            )
        corners = lofting.rectangle(a, b, chamfer)
    else:
        corners = [(r.number(x), r.number(y)) for x, y in section.polygon or ()]
        _check_polygon(section, corners, r)
    if section.offset is None:
        return corners
    dx, dy = (r.number(x) for x in section.offset)
    return [(x + dx, y + dy) for x, y in corners]


def _check_polygon(section: Section, corners: list[lofting.Pair], r: Evaluator) -> None:
    crossed, edges = lofting.crossing(corners)
    if is_array(crossed):
        r.mark(crossed)
    elif edges is not None:
        raise ResolveError(
            Problem(
                f"edges {edges[0] + 1} and {edges[1] + 1} of this polygon cross",
                section.where,
                "list the corners in order around it",
            )
        )
    area = lofting.area(corners)
    if is_array(area):
        r.mark(~(np.asarray(area) > 0))
    elif not area > 0:
        raise ResolveError(
            Problem(
                "the corners of this polygon run clockwise, or enclose nothing",
                section.where,
                "list them counter-clockwise",
            )
        )
