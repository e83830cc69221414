"""The trunk of a design: its sections evaluated, lofted and weighed."""

from __future__ import annotations

import numpy as np

from draft.design import loft as lofting
from draft.design.design import Trunk
from draft.design.parts import Reader
from draft.errors import Problem, ResolveError
from draft.spec.spec import Root, Section
from draft.trends.structure import Population
from draft.values import Value, is_array


def make_trunk(root: Root, people: Population, r: Reader) -> Trunk:
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
    convex = all(section.polygon is None for section in root.sections)
    solid = lofting.loft(root.axis, places, sections, convex)
    if root.density is None:
        density: Value = people.trunk_density
    else:
        density = r.positive(root.density, "density of the trunk")
    return Trunk(density, root.density is not None, density * solid.volume, solid)


def _corners(section: Section, plain: bool, r: Reader) -> list[lofting.Pair]:
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


def _check_polygon(section: Section, corners: list[lofting.Pair], r: Reader) -> None:
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
