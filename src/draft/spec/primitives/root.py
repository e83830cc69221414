"""The trunk: root of the tree, a solid lofted through the sections of root.yaml."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from draft import geometry as g
from draft.errors import Location, Problem, ResolveError, SpecError
from draft.spec.evaluate import Evaluator
from draft.spec.expressions import Expression, parse
from draft.spec.field_types import Model, Name, Number
from draft.spec.primitives import loft as lofting
from draft.spec.primitives.base import Geom
from draft.spec.primitives.shape import LinkShape, ShapePart
from draft.spec.reader import Path_, Source
from draft.values import Array, Value, is_array, maximum, minimum

if TYPE_CHECKING:
    from draft.spec.schema import Node

# Lengths of the trunk from its origin: MuJoCo holds a mesh in single precision, and its mass must
# agree to 1e-6.
FARTHEST = 20
TWISTED = (
    "the loft to this polygon twists: corners pair in order with those of the previous section"
)


class Trunk(Model):
    """The floating base. root.yaml describes its solid."""

    name: Name = "trunk"
    """Name of the body."""
    type: Literal["root"] = "root"
    shape: LinkShape | None = None
    """Part of your own in place of the solid of root.yaml, in the trunk's frame."""
    children: list[Node] = Field([])
    """Links attached to it."""


class Section(Model):
    """A cross-section of the trunk, perpendicular to the axis of the loft.

    Its two coordinates follow the axis cyclically: (y, z) for x, (z, x) for y, (x, y) for z.
    """

    at: Number
    """Position along the axis [m]."""
    rectangle: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None
    """Sizes of a rectangle in the two coordinates [m]."""
    chamfer: Number = 0.0
    """Corner cut of the rectangle, as a share of its shorter side, 0 to 0.5."""
    polygon: (
        Annotated[
            list[Annotated[list[Number], Field(min_length=2, max_length=2)]],
            Field(min_length=3, max_length=64),
        ]
        | None
    ) = None
    """Corners of a polygon in the two coordinates [m], counter-clockwise. They pair in order with
    those of the previous section; a rectangle begins at its lower left."""
    offset: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None
    """Shift of the section in the two coordinates [m]."""


class RootFile(Model):
    """root.yaml: the trunk as a loft through sections."""

    absent: ClassVar[Mapping[str, str]] = {"shape": "write it in tree.yaml, below 'type: root'"}

    axis: Literal["x", "y", "z"]
    """Direction of the loft."""
    density: Number = "population"
    """Mean density of the structure of the trunk [kg/m3], or 'population' for the trend."""
    leg_length: Number | None = None
    """Length of thigh plus shank at which the calibrated trend gives the density [m]: of an import,
    that of the robot it came from, so that the trunk keeps its mass when only legs change. Default:
    that of the design, with which the trunk gets denser on longer legs."""
    sections: Annotated[list[Section], Field(min_length=2, max_length=64)]
    """Cross-sections in order of position along the axis."""


@dataclass(frozen=True, slots=True)
class WrittenSection:
    """A cross-section of the trunk: `corners` of a polygon, or a chamfered `rectangle`."""

    at: Expression
    rectangle: tuple[Expression, Expression] | None
    chamfer: Expression | None
    polygon: tuple[tuple[Expression, Expression], ...] | None
    offset: tuple[Expression, Expression] | None
    where: Location


@dataclass(frozen=True, slots=True)
class WrittenRoot:
    """The loft of the trunk.

    `density` is None if the trend of the population gives it, and `leg_length` if that trend takes
    the legs of the design.
    """

    axis: str
    density: Expression | None
    leg_length: Expression | None
    sections: tuple[WrittenSection, ...]
    where: Location


def read_root(file: RootFile, source: Source) -> WrittenRoot:
    """Compile root.yaml.

    Raises:
        SpecError: a section is neither rectangle nor polygon, or both; an expression is invalid.
    """
    density = None
    if file.density != "population":
        density = parse(file.density, source.at(("density",)))
    leg_length = None
    if file.leg_length is not None:
        leg_length = parse(file.leg_length, source.at(("leg_length",)))
    sections = tuple(
        _section(section, ("sections", i), source) for i, section in enumerate(file.sections)
    )
    return WrittenRoot(file.axis, density, leg_length, sections, source.at(("sections",)))


def _section(section: Section, path: Path_, source: Source) -> WrittenSection:
    def pair(values: list, key: str, *more: int) -> tuple[Expression, Expression]:
        first, second = (
            parse(value, source.at((*path, key, *more, i))) for i, value in enumerate(values)
        )
        return (first, second)

    where = source.at(path)
    if (section.rectangle is None) == (section.polygon is None):
        raise SpecError(
            Problem(
                "a section is either a rectangle or a polygon",
                where,
                "give one of 'rectangle: [a, b]' and 'polygon: [[a, b], ...]'",
            )
        )
    rectangle = chamfer = polygon = None
    if section.rectangle is not None:
        rectangle = pair(section.rectangle, "rectangle")
        chamfer = parse(section.chamfer, source.at((*path, "chamfer")))
    else:
        corners = section.polygon or []
        polygon = tuple(pair(corner, "polygon", i) for i, corner in enumerate(corners))
    offset = pair(section.offset, "offset") if section.offset is not None else None
    at = parse(section.at, source.at((*path, "at")))
    return WrittenSection(at, rectangle, chamfer, polygon, offset, where)


@dataclass(frozen=True, slots=True)
class TrunkPart:
    """The lofted trunk: density [kg/m3], mass [kg], and the solid.

    Attributes:
        leg_length: stated leg length for the trend of the density [m]; None for the design's own.
        suffix: suffix of the name of its geom, a mesh of kind "trunk".
        site: name of the site at its origin.
        shape: part in its place; None without one.
    """

    suffix: ClassVar[str] = "_trunk"
    site: ClassVar[str] = "imu"

    density: Value
    density_stated: bool
    mass: Value
    loft: lofting.Loft
    leg_length: Value | None = None
    shape: ShapePart | None = None

    def geoms(self) -> Iterator[Geom]:
        """Its solid, or the part in its place."""
        solid = Geom(self.suffix, "trunk", "mesh", g.ZERO, (), self.mass, mesh=self.loft)
        yield from (solid,) if self.shape is None else self.shape.geoms(solid)


def make_trunk(root: WrittenRoot, usual: float, r: Evaluator) -> TrunkPart:
    """Loft the trunk and weigh it.

    Args:
        root: the trunk as written in root.yaml.
        usual: density of the trunks of the population [kg/m3], the default.
        r: evaluator of expressions.

    Raises:
        ResolveError: sections are out of order or far from the origin, differ in their number of
            corners, or a polygon crosses itself.
    """
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
                "must be beyond the previous section",
            )
        places.append(at)
        sections.append(_corners(section, plain, r))
        if len(sections[-1]) != len(sections[0]):
            raise ResolveError(
                Problem(
                    f"a section has {len(sections[-1])} corners, the first {len(sections[0])}",
                    section.where,
                    "give all sections the same number; a chamfered rectangle has 8",
                )
            )
        if section.polygon is not None and len(sections) > 1:
            _check_pairing(section, sections[-2], sections[-1])
    reach = FARTHEST * (places[-1] - places[0])
    for section, at in zip(root.sections, places, strict=True):
        near = abs(at) <= reach
        rule = f"must be within {FARTHEST} lengths of the trunk from its origin"
        r.require(near, section.at, "place of a section", at, rule)
    _check_near(root, sections, r)
    convex = all(section.polygon is None for section in root.sections)
    solid = lofting.loft(root.axis, places, sections, convex)
    if root.density is None:
        density: Value = usual
    else:
        density = r.positive(root.density, "density of the trunk")
    leg = None
    if root.leg_length is not None:
        leg = r.positive(root.leg_length, "leg length for the density of the trunk")
    return TrunkPart(density, root.density is not None, density * solid.volume, solid, leg)


def _check_near(root: WrittenRoot, sections: list[list[lofting.Pair]], r: Evaluator) -> None:
    """Check that no section is far from the origin, in either of its coordinates."""
    for axis in (0, 1):
        values = [[corner[axis] for corner in corners] for corners in sections]
        lows, highs = ([of(*xs) for xs in values] for of in (minimum, maximum))
        widest = maximum(*(high - low for low, high in zip(lows, highs, strict=True)))
        for section, low, high in zip(root.sections, lows, highs, strict=True):
            written = section.offset or (section.polygon or ((),))[0]
            if written:
                farthest = maximum(-low, high)
                rule = f"must be within {FARTHEST} widths of the trunk from its origin"
                holds = farthest <= FARTHEST * widest
                r.require(holds, written[axis], "edge of a section", farthest, rule)


def _check_pairing(
    section: WrittenSection, before: list[lofting.Pair], corners: list[lofting.Pair]
) -> None:
    """Refuse a loft that twists because the list of corners begins at the wrong one.

    Corners pair by their order, so no other first corner may bring them closer together. Of many
    designs, those that twist are named when they are compiled.
    """
    if any(is_array(x) for corner in (*before, *corners) for x in corner):
        return
    first, second = (np.array(points, dtype=np.float64)[..., None] for points in (before, corners))
    distances = _distances(first, second)[:, 0]
    if _twist(distances):
        raise ResolveError(
            Problem(
                TWISTED,
                section.where,
                f"begin the list at corner {int(np.argmin(distances)) + 1}; a rectangle begins at "
                "its lower left",
            )
        )


def twists(first: Array, second: Array) -> NDArray[np.bool_]:
    """Whether the corners of two sections pair better if one list begins at another corner.

    Args:
        first: corners of the lower section [m], shape (corners, coordinates, N).
        second: corners of the upper section [m], of the same shape.
    """
    return _twist(_distances(first, second))


def _distances(first: Array, second: Array) -> Array:
    """Sum of squared distances of paired corners for each first corner [m2], (corners, N)."""
    first = first - first.mean(axis=0)
    second = second - second.mean(axis=0)
    shifts = (np.roll(second, -shift, axis=0) for shift in range(len(second)))
    return np.stack([((first - shifted) ** 2).sum(axis=(0, 1)) for shifted in shifts])


def _twist(distances: Array) -> NDArray[np.bool_]:
    return distances.min(axis=0) < distances[0] * (1 - 1e-9)


def _corners(section: WrittenSection, plain: bool, r: Evaluator) -> list[lofting.Pair]:
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


def _check_polygon(section: WrittenSection, corners: list[lofting.Pair], r: Evaluator) -> None:
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
