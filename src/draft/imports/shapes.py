"""Dimensions of a vendor's trunk, feet, hands and heads.

Where meshes or primitives are there, they alone count; else the box with the link's inertia stands
in, of which only the edges are used: scaling mass and inertia together changes nothing.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from draft.description.description import Geometry, Inertial
from draft.description.rigid import combined, moved
from draft.errors import Problem
from draft.imports import solids, units
from draft.imports.meshes import Mesh, Meshes, shown
from draft.imports.reduce import Reduced
from draft.values import Array

SLICES = 7
# Cuts for the volume of a mesh.
CUTS = 15
LEAST = 0.005


@dataclass(frozen=True, slots=True)
class Slice:
    """A cross-section: place along the axis, centre and sizes across it [m], chamfer."""

    at: float
    centre: tuple[float, float]
    size: tuple[float, float]
    chamfer: float

    @property
    def area(self) -> float:
        """Area of the section [m2]."""
        a, b = self.size
        return a * b - 2 * (self.chamfer * min(a, b)) ** 2


class Shapes:
    """Shapes of a reduced robot's links, in the root's axes; `notes`: meshes in doubtful units."""

    def __init__(self, reduced: Reduced, meshes: Meshes) -> None:
        self.reduced = reduced
        self.meshes = meshes
        self.notes: list[Problem] = []
        self._thousandth: set[tuple[float, ...]] = set()

    def triangles(self, links: Iterable[str]) -> Array:
        """Triangles of the links' visible meshes, else of those that collide [m], (n, 3, 3).

        Meshes in millimetres are put right, and those that are far too large are left out.
        """
        links = list(links)
        own = [one for name in links for one in self._meshes(name)]
        scales = [tuple(map(float, shape.scale)) for _, shape, _ in own]
        extents = [mesh.extent(scale) for (_, _, mesh), scale in zip(own, scales, strict=True)]
        units_ = units.factors(extents, scales, self.span, self._reach(links), self._thousandth)
        found: list[Array] = []
        for (name, shape, mesh), extent, factor in zip(own, extents, units_, strict=True):
            if factor != 1:
                self._doubt(name, shape, factor, extent)
            if factor:
                position, rotation = self.reduced.poses[name]
                at = rotation @ np.array(shape.position, float) + position
                turn = rotation @ np.array(shape.rotation, float)
                scale = factor * np.array(shape.scale, float)
                # Not `@`: it wakes the threads of the linear algebra for a product this small.
                found.append(np.einsum("nij,kj->nik", mesh.triangles, turn * scale) + at)
        return np.concatenate(found) if found else np.zeros((0, 3, 3))

    def _meshes(self, name: str) -> list[tuple[str, Geometry, Mesh]]:
        """A link's visible meshes that can be read, else those that collide."""
        link = self.reduced.description.links[name]
        for use in ("visual", "collision"):
            shapes = [s for s in link.geometries if s.use == use and s.kind == "mesh"]
            read = [(name, s, self.meshes.mesh(s, link.where)) for s in shapes]
            found = [(name, s, mesh) for name, s, mesh in read if mesh is not None]
            if found:
                return found
        return []

    def _doubt(self, name: str, shape: Geometry, factor: float, extent: float) -> None:
        cause, remedy = units.words(factor, extent, self.span)
        where = self.reduced.description.links[name].where
        problem = Problem(f"mesh '{shown(shape.mesh or '')}' is {cause}", where, remedy)
        if problem not in self.notes:
            self.notes.append(problem)

    @cached_property
    def span(self) -> float:
        """Distance across the frames of the robot's links [m]: how large it is, without meshes."""
        places = np.array([at for at, _ in self.reduced.poses.values()])
        return float(np.linalg.norm(np.ptp(places, axis=0)))

    def _reach(self, links: Sequence[str]) -> float:
        """Distance across the joints of a body of these links [m]."""
        own, poses = set(links), self.reduced.poses
        children = self.reduced.description.children
        below = [joint.child for name in links for joint in children[name]]
        joints = [*links[:1], *(name for name in below if name not in own)]
        places = np.array([poses[name][0] for name in joints])
        return float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0

    def points(self, links: Iterable[str]) -> Array:
        """Points of the links' meshes, else of their primitives [m], shape (n, 3)."""
        links = list(links)
        triangles = self.triangles(links)
        if len(triangles):
            return triangles.reshape(-1, 3)
        found: list[Array] = []
        for name in links:
            position, rotation = self.reduced.poses[name]
            for shape in self.reduced.description.links[name].geometries:
                own = corners(shape)
                if own is not None:
                    found.append(own @ rotation.T + position)
        return np.concatenate(found) if found else np.zeros((0, 3))

    def primitives(self, links: Iterable[str]) -> Array:
        """Triangles of the links' primitives [m], shape (n, 3, 3): those that collide, if any."""
        found: list[Array] = []
        for name in links:
            position, rotation = self.reduced.poses[name]
            own = self.reduced.description.links[name].geometries
            for use in ("collision", "visual"):
                parts = [solids.triangles(shape) for shape in own if shape.use == use]
                parts = [part for part in parts if len(part)]
                if parts:
                    found += [part @ rotation.T + position for part in parts]
                    break
        return np.concatenate(found) if found else np.zeros((0, 3, 3))

    def spheres(self, links: Iterable[str]) -> list[tuple[Array, float]]:
        """Centres and radii of the links' spheres [m]."""
        found: list[tuple[Array, float]] = []
        for name in links:
            position, rotation = self.reduced.poses[name]
            for shape in self.reduced.description.links[name].geometries:
                if shape.kind == "sphere" and shape.size[0] >= LEAST:
                    centre = rotation @ np.array(shape.position, float) + position
                    found.append((centre, float(shape.size[0])))
        return found

    def box(self, links: Iterable[str]) -> Array:
        """Edges along the root's axes of the box with the links' inertia [m]; zero for none."""
        bodies: list[Inertial] = []
        for name in links:
            inertial = self.reduced.description.links[name].inertial
            if inertial is not None:
                position, rotation = self.reduced.poses[name]
                at = tuple(map(float, position))
                turn = tuple(tuple(map(float, row)) for row in rotation)
                bodies.append(moved(inertial, at, turn))  # type: ignore[arg-type]
        body = combined(bodies)
        if body.mass <= 0:
            return np.zeros(3)
        inertia = np.array(body.inertia) / body.mass
        moments, axes = np.linalg.eigh(inertia)
        squares = 6.0 * (moments.sum() - 2.0 * moments)
        edges = np.sqrt(np.maximum(squares, 0.0))
        return edges[_alignment(axes)]


def _alignment(axes: Array) -> list[int]:
    """For each of x, y, z, the column of `axes` that lies along it."""
    weights = np.abs(axes)
    orders = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    return list(max(orders, key=lambda order: sum(weights[i, order[i]] for i in range(3))))


def corners(shape: Geometry) -> Array | None:
    """Corners of a primitive's box in its link's frame [m], shape (8, 3)."""
    if shape.kind == "box" and len(shape.size) == 3:
        half = np.array(shape.size) / 2
    elif shape.kind == "sphere" and shape.size:
        half = np.full(3, shape.size[0])
    elif shape.kind in ("cylinder", "capsule") and len(shape.size) == 2:
        radius, length = shape.size
        end = length / 2 + (radius if shape.kind == "capsule" else 0.0)
        half = np.array([radius, radius, end])
    else:
        return None
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return (signs * half) @ np.array(shape.rotation, float).T + np.array(shape.position, float)


def slices(triangles: Array, axis: int) -> list[Slice]:
    """Cross-sections of a mesh along an axis, lowest first, as chamfered rectangles.

    Each has the bounds of the cut and, by its chamfer, the area of the cut's convex hull.
    """
    places = triangles[:, :, axis]
    low, high = np.quantile(places, (0.002, 0.998))
    span = high - low
    found: list[Slice] = []
    for share in (np.arange(SLICES) + 0.5) / SLICES:
        cut = _cut(triangles, axis, low + share * span)
        if len(cut) >= 3:
            one = _rectangle(float(low + share * span), cut)
            if min(one.size) > LEAST:
                found.append(one)
    if len(found) >= 2:
        ends = ((low, found[0]), (high, found[-1]))
        first, last = (Slice(float(at), s.centre, s.size, s.chamfer) for at, s in ends)
        found = [first, *found[1:-1], last]
    return found


def volume(triangles: Array) -> float:
    """Volume of a mesh [m3]: the convex hulls of cuts across its longest extent; 0 for no mesh."""
    points = triangles.reshape(-1, 3)
    if len(triangles) < 4:
        return 0.0
    away = points - points.mean(axis=0)
    turn = np.linalg.eigh(np.einsum("ni,nj->ij", away, away))[1][:, ::-1]
    turned = np.einsum("nij,jk->nik", triangles, turn)
    low, high = np.quantile(turned[:, :, 0], (0.002, 0.998))
    places = low + (np.arange(CUTS) + 0.5) / CUTS * (high - low)
    return sum(_hull_area(_cut(turned, 0, at)) for at in places) * float(high - low) / CUTS


def _cut(triangles: Array, axis: int, at: float) -> Array:
    """Points where the triangles' edges pass a plane, in the other two coordinates, (n, 2)."""
    others = [(axis + 1) % 3, (axis + 2) % 3]
    points: list[Array] = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = triangles[:, i], triangles[:, j]
        below, above = a[:, axis] - at, b[:, axis] - at
        passes = below * above < 0
        share = below[passes] / (below[passes] - above[passes])
        crossing = a[passes] + share[:, None] * (b[passes] - a[passes])
        points.append(crossing[:, others])
    return np.concatenate(points)


def _rectangle(at: float, points: Array) -> Slice:
    low, high = points.min(axis=0), points.max(axis=0)
    size = high - low
    missing = max(float(np.prod(size)) - _hull_area(points), 0.0)
    shorter = max(float(size.min()), 1e-6)
    chamfer = min(float(np.sqrt(missing / 2)) / shorter, 0.45)
    centre = (low + high) / 2
    return Slice(
        at,
        (float(centre[0]), float(centre[1])),
        (float(size[0]), float(size[1])),
        chamfer,
    )


def _hull_area(points: Array) -> float:
    """Area of the convex hull of points in a plane (Andrew's monotone chain)."""
    ordered = sorted(set(map(tuple, np.round(points, 6).tolist())))
    if len(ordered) < 3:
        return 0.0
    area = 0.0
    for way in (ordered, ordered[::-1]):
        hull: list[tuple[float, ...]] = []
        for p in way:
            while len(hull) > 1 and _turn(hull[-2], hull[-1], p) <= 0:
                hull.pop()
            hull.append(p)
        pairs = itertools.pairwise(hull)
        area += sum(a[0] * b[1] - a[1] * b[0] for a, b in pairs) / 2
    return area


def _turn(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
