"""Convex solids of a design, and their overlap.

Two convex solids are apart if some direction separates their extents. The directions tried first
separate nearly all pairs of cylinders; for the others a few steps of Frank and Wolfe's method on
the distance between the solids find a separating direction if there is a gap. All functions take
floats or arrays of shape (N,).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from draft import geometry as g
from draft.design.plan import plan
from draft.geometry import Frame, Vector
from draft.spec.primitives.base import Geom
from draft.values import (
    Mask,
    Value,
    both,
    clip,
    either,
    every,
    is_array,
    maximum,
    minimum,
    negate,
    some,
    sqrt,
    where,
)

if TYPE_CHECKING:
    from draft.design.design import Body, Design

# Solids are shrunk by this share before they are compared, so that faces may touch.
SLACK = 0.02
_STEPS = 60
_TINY = 1e-12
_SHORT = 1e-9
_DOWN: Vector = (0.0, 0.0, -1.0)


class Cylinder(NamedTuple):
    """A cylinder: centre, unit axis, radius, half length. Radius alone makes it a disc."""

    center: Vector
    axis: Vector
    radius: Value
    half: Value

    @property
    def reach(self) -> Value:
        """Radius of the sphere around it."""
        return sqrt(self.radius * self.radius + self.half * self.half)

    def extent(self, d: Vector) -> Value:
        """Half width along a unit direction."""
        along = g.dot(self.axis, d)
        across = maximum(1.0 - along * along, 0.0)
        return self.half * abs(along) + self.radius * sqrt(across)

    def support(self, d: Vector) -> Vector:
        """Furthest point along a direction."""
        along = g.dot(self.axis, d)
        across = g.subtract(d, g.scale(self.axis, along))
        size = maximum(g.norm(across), _TINY)
        end = where(along >= 0, self.half, -1.0 * self.half)
        rim = g.scale(across, self.radius / size)
        return g.add(self.center, g.add(g.scale(self.axis, end), rim))


class Ball(NamedTuple):
    """A sphere: centre and radius. It has no axis of its own."""

    center: Vector
    radius: Value
    axis: Vector = (0.0, 0.0, 1.0)

    @property
    def reach(self) -> Value:
        """Radius of the sphere around it."""
        return self.radius

    def extent(self, d: Vector) -> Value:
        """Half width along a unit direction."""
        return self.radius

    def support(self, d: Vector) -> Vector:
        """Furthest point along a direction."""
        return g.add(self.center, g.scale(d, self.radius / maximum(g.norm(d), _TINY)))


class Block(NamedTuple):
    """A box: centre, three unit edges and the half size along each; `axis` is the third edge."""

    center: Vector
    edges: tuple[Vector, Vector, Vector]
    halves: Vector

    @property
    def axis(self) -> Vector:
        """Direction that separates it from a solid above or below."""
        return self.edges[2]

    @property
    def reach(self) -> Value:
        """Radius of the sphere around it."""
        return g.norm(self.halves)

    def extent(self, d: Vector) -> Value:
        """Half width along a unit direction."""
        return g.total(h * abs(g.dot(e, d)) for e, h in zip(self.edges, self.halves, strict=True))

    def support(self, d: Vector) -> Vector:
        """Furthest point along a direction."""
        point = self.center
        for edge, half in zip(self.edges, self.halves, strict=True):
            point = g.add(point, g.scale(edge, where(g.dot(edge, d) >= 0, half, -1.0 * half)))
        return point


Solid = Cylinder | Ball | Block


def solid(geom: Geom, frame: Frame) -> Solid:
    """Solid of a geom, in the frame in which the frame of its body is given."""
    origin, rotation = frame
    at = g.add(origin, g.rotate(rotation, geom.center))
    if geom.form == "cylinder":
        radius, length = geom.size
        return Cylinder(at, g.rotate(rotation, geom.axis), radius, length / 2)
    if geom.form == "sphere":
        return Ball(at, geom.size[0])
    x, y, z = geom.size
    turn = g.compose(rotation, geom.rotation)
    first, second, third = (g.rotate(turn, axis) for axis in g.IDENTITY)
    return Block(at, (first, second, third), g.scale((x, y, z), 0.5))


class Pose:
    """Frames and solids of the bodies, in the frame of the trunk, or of the world on a fixed base.

    Args:
        design: the design.
        home: whether the joints are in the home pose; else all are at zero.
    """

    def __init__(self, design: Design, home: bool) -> None:
        self._bodies, self._home = design.bodies, home
        self._reuse = plan(design.spec).reuse(design.count)
        self._frames: dict[int, Frame] = {0: g.ORIGIN if design.floating else self._base()}

    def _base(self) -> Frame:
        """Frame of a fixed base in the world."""
        of = self._bodies[0].position, self._bodies[0].rotation
        return self._reuse.result(("frame", self._home, 0), lambda *frame: frame, *of)

    def frame(self, body: int) -> Frame:
        """Origin [m] and rotation of a body by its index."""
        known = self._frames.get(body)
        if known is None:
            one, home = self._bodies[body], self._home
            above = self.frame(one.parent or 0)
            known = self._reuse.result(("frame", home, body), type(one).placed, one, above, home)
            self._frames[body] = known
        return known

    def solids(self, body: int) -> Sequence[Solid]:
        """Solids of a body by its index: actuator, member and end."""
        of = self._bodies[body], self.frame(body)
        return self._reuse.result(("solids", self._home, body), _solids, *of)


def _solids(body: Body, frame: Frame) -> tuple[Solid, ...]:
    return tuple(solid(geom, frame) for geom in body.solids())


def overlap(a: Solid, b: Solid) -> Mask:
    """Whether two solids, each shrunk by `SLACK`, overlap."""
    a, b = _shrunk(a), _shrunk(b)
    c = g.subtract(b.center, a.center)
    distance = g.norm(c)
    apart: Mask = distance > a.reach + b.reach
    if every(apart):
        return negate(apart)
    for direction in _directions(a, b, c):
        gap = abs(g.dot(c, direction)) - a.extent(direction) - b.extent(direction)
        apart = either(apart, gap > 0)
        if every(apart):
            return negate(apart)
    if not is_array(apart):
        return not _separated(a, b)
    undecided = np.flatnonzero(~np.asarray(apart))
    touching = np.zeros(np.shape(apart), dtype=bool)
    rows_a, rows_b = _rows(a, undecided), _rows(b, undecided)
    touching[undecided] = ~np.broadcast_to(_separated(rows_a, rows_b), undecided.shape)
    return touching


def _directions(a: Solid, b: Solid, c: Vector) -> list[Vector]:
    """Unit directions that separate nearly all pairs that can be separated."""
    candidates = [*_normals(a), *_normals(b)]
    for raw in (
        c,
        g.subtract(c, g.scale(a.axis, g.dot(c, a.axis))),
        g.subtract(c, g.scale(b.axis, g.dot(c, b.axis))),
        *(g.cross(u, v) for u in _normals(a) for v in _normals(b)),
    ):
        size = g.norm(raw)
        if some(size > _SHORT):
            # A shorter vector stays shorter than a unit vector, and separates nothing.
            candidates.append(g.scale(raw, 1.0 / maximum(size, _SHORT)))
    return candidates


def _normals(solid: Solid) -> tuple[Vector, ...]:
    """Normals of its flat faces: with their products, they part any two boxes that are apart."""
    return solid.edges if isinstance(solid, Block) else (solid.axis,)


def _separated(a: Solid, b: Solid) -> Mask:
    """Search for a separating direction by Frank and Wolfe's method on the distance."""
    v = g.subtract(a.center, b.center)
    apart: Mask = False
    for _ in range(_STEPS):
        # A distance at the level of rounding has no direction: those solids overlap.
        distance = g.norm(v)
        toward = g.scale(v, 1.0 / maximum(distance, _SHORT))
        w = g.subtract(a.support(g.scale(toward, -1.0)), b.support(toward))
        apart = either(apart, both(g.dot(toward, w) > 0, distance > _SHORT))
        if every(apart):
            break
        step = g.subtract(w, v)
        t = clip(-1.0 * g.dot(v, step) / maximum(g.dot(step, step), _TINY), 0.0, 1.0)
        v = g.add(v, g.scale(step, t))
    return apart


def _shrunk(solid: Solid) -> Solid:
    factor = 1.0 - SLACK
    if isinstance(solid, Ball):
        return Ball(solid.center, solid.radius * factor)
    if isinstance(solid, Block):
        return Block(solid.center, solid.edges, g.scale(solid.halves, factor))
    return Cylinder(solid.center, solid.axis, solid.radius * factor, solid.half * factor)


def _rows(solid: Solid, rows: NDArray[np.intp] | None) -> Solid:
    """Rows of a solid of N designs; None for all."""
    if rows is None:
        return solid

    def take(value: Value) -> Value:
        return value[rows] if isinstance(value, np.ndarray) else value

    def vector(v: Vector) -> Vector:
        return (take(v[0]), take(v[1]), take(v[2]))

    if isinstance(solid, Ball):
        return Ball(vector(solid.center), take(solid.radius))
    if isinstance(solid, Block):
        x, y, z = solid.edges
        edges = (vector(x), vector(y), vector(z))
        return Block(vector(solid.center), edges, vector(solid.halves))
    return Cylinder(vector(solid.center), vector(solid.axis), take(solid.radius), take(solid.half))


Box = tuple[Vector, Vector]


def any_overlap(meet: Mask, first: Iterable[Solid], second: Iterable[Solid]) -> Mask:
    """Whether any solid of one group overlaps any of another.

    Args:
        meet: whether the boxes around the groups overlap; only those designs are checked.
        first: one group.
        second: the other.
    """
    if not some(meet):
        return meet
    rows = np.flatnonzero(meet) if is_array(meet) else None
    ours, theirs = ([_rows(s, rows) for s in group] for group in (first, second))
    boxes = [(solid, _box(solid)) for solid in theirs]
    hit: Mask = False
    for a in ours:
        box = _box(a)
        for b, other in boxes:
            near = boxes_meet(box, other)
            if some(near):
                hit = either(hit, _overlap_where(near, a, b))
            if hit is True:
                return True
    if rows is None or not isinstance(meet, np.ndarray):
        return hit
    touching = np.zeros(meet.shape, dtype=bool)
    touching[rows] = hit
    return touching


def _overlap_where(near: Mask, a: Solid, b: Solid) -> Mask:
    """Overlap in the designs of a mask; False for the others."""
    if not isinstance(near, np.ndarray):
        return overlap(a, b)
    rows = np.flatnonzero(near)
    touching = np.zeros(near.shape, dtype=bool)
    touching[rows] = overlap(_rows(a, rows), _rows(b, rows))
    return touching


def box_around(group: Iterable[Solid]) -> Box | None:
    """Box around solids; None without solids."""
    found: Box | None = None
    for solid in group:
        low, high = _box(solid)
        if found is not None:
            low = _each(_lower, low, found[0])
            high = _each(_higher, high, found[1])
        found = (low, high)
    return found


def _lower(a: Value, b: Value) -> Value:
    # Two floats are compared here because `minimum` takes three times as long.
    if type(a) is float and type(b) is float:
        return b if b < a else a
    return minimum(a, b)


def _higher(a: Value, b: Value) -> Value:
    if type(a) is float and type(b) is float:
        return b if b > a else a
    return maximum(a, b)


def _each(choose: Callable[[Value, Value], Value], a: Vector, b: Vector) -> Vector:
    return (choose(a[0], b[0]), choose(a[1], b[1]), choose(a[2], b[2]))


def _box(solid: Solid) -> Box:
    """Lowest and highest corner of the box around a solid."""
    if isinstance(solid, Cylinder):
        x, y, z = solid.axis
        r, h = solid.radius, solid.half
        half: Vector = (_side(x, r, h), _side(y, r, h), _side(z, r, h))
    elif isinstance(solid, Ball):
        half = (solid.radius, solid.radius, solid.radius)
    else:
        x, y, z = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        half = (solid.extent(x), solid.extent(y), solid.extent(z))
    return g.subtract(solid.center, half), g.add(solid.center, half)


def _side(along: Value, radius: Value, half: Value) -> Value:
    """Half width of a cylinder along a coordinate axis, from the component of its axis."""
    if not is_array(along):
        if along == 0.0:
            return radius
        if along * along == 1.0:
            return half
    return half * abs(along) + radius * sqrt(maximum(1.0 - along * along, 0.0))


def boxes_meet(a: Box, b: Box) -> Mask:
    """Whether two boxes overlap."""
    meet: Mask = True
    for k in range(3):
        meet = both(meet, both(a[0][k] < b[1][k], b[0][k] < a[1][k]))
        if meet is False:
            break
    return meet


def depth(part: Solid) -> Value:
    """Distance from the trunk's origin down to the lowest point of a solid [m]."""
    return part.extent(_DOWN) - part.center[2]


def lowest(design: Design, home: bool) -> Value:
    """Distance from the trunk's origin down to the lowest point of the feet [m].

    A robot without feet stands on its lowest solid.
    """
    pose, bodies = Pose(design, home), range(len(design.bodies))
    feet = foot_depths(design, pose, bodies)
    if feet:
        return maximum(*feet)
    depths = [depth(part) for i in bodies for part in pose.solids(i)]
    return maximum(*trunk_depths(design), *depths)


def trunk_depths(design: Design) -> list[Value]:
    """Distance from the trunk's origin down to its lowest point [m]; none for a fixed base."""
    if design.lofted is None:
        return []
    down = -1.0 * design.lofted.loft.vertices[:, 2].min(axis=0)
    return [down if is_array(down) else float(down)]


def foot_depths(design: Design, pose: Pose, bodies: Iterable[int]) -> list[Value]:
    """Distances from the trunk's origin down to the lowest point of each foot [m].

    Args:
        design: the design.
        pose: its pose.
        bodies: indices of the bodies whose feet are meant.
    """
    chosen = set(bodies)
    feet = [i for i in design.feet if i in chosen]
    return [depth(foot) for i in feet for foot in pose.solids(i)[-1:]]
