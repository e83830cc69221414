"""Masses of an MJCF model that its meshes give: stated ones, and densities times their volumes.

Source: MuJoCo's XML reference (asset/mesh/inertia): by default each face spans a tetrahedron with a
point inside, and all volumes count as positive.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from draft.description.description import Description, Geometry, Inertial, Link, MeshMass, Point
from draft.description.rigid import combined, moved
from draft.errors import Location, Problem, quoted
from draft.imports.meshes import Meshes
from draft.imports.plausibility import HEAVIEST
from draft.values import Array

ORIGIN: Point = (0.0, 0.0, 0.0)


def weighed(description: Description, meshes: Meshes) -> Description:
    """Give links the masses of their meshes, as far as the file states them or meshes can be read.

    Returns:
        The description, its `unweighed` and `unplaced` links those that are left.
    """
    links = dict(description.links)
    unweighed: list[str] = []
    unplaced: list[str] = []
    for name in description.unweighed:
        link = links[name]
        solids = [] if link.inertial is None else [link.inertial]
        for shape in link.geometries:
            if shape.weight is None:
                continue
            body = _body(shape, shape.weight, link, meshes)
            if body is None and shape.weight.mass is not None:
                unplaced.append(name)
                body = Inertial(shape.weight.mass, ORIGIN, (ORIGIN, ORIGIN, ORIGIN))
            if body is None:
                unweighed.append(name)
            else:
                solids.append(moved(body, shape.position, shape.rotation))
        links[name] = replace(link, inertial=combined(solids) if solids else None)
    return replace(
        description,
        links=links,
        unweighed=frozenset(unweighed),
        unplaced=frozenset(unplaced) - frozenset(unweighed),
        notes=(*description.notes, *_notes(description, unweighed, unplaced)),
    )


def _notes(
    description: Description, unweighed: Iterable[str], unplaced: Iterable[str]
) -> list[Problem]:
    where = Location(description.file)
    found: list[Problem] = []
    for names, cause in (
        (set(unweighed), "only meshes that are not read give the mass of"),
        (set(unplaced) - set(unweighed), "only meshes that are not read say where the mass is of"),
    ):
        ordered = [name for name in description.links if name in names]
        if ordered:
            remedy = "for a comparison of masses, add the meshes or an <inertial>"
            found.append(Problem(f"{cause} {quoted(ordered)}", where, remedy))
    return found


def _body(shape: Geometry, weight: MeshMass, link: Link, meshes: Meshes) -> Inertial | None:
    """Mass properties of a mesh in its geom's frame; None if they cannot be known."""
    mesh = meshes.mesh(shape, link.where) if shape.mesh else None
    if mesh is None:
        return None
    convex = weight.method == "convex"
    if convex and weight.mass is None:
        return None
    scaled = mesh.triangles * np.array(shape.scale, float)
    amount, com, inertia = _solid(scaled, "exact" if convex else weight.method)
    if not amount > 0:
        return None
    density = weight.density if weight.mass is None else weight.mass / amount
    if density * amount > HEAVIEST:
        return None  # The mesh is in millimetres, as `draft.imports.units` will say.
    at: Any = tuple(map(float, com))
    axes: Any = tuple(tuple(map(float, row)) for row in density * inertia)
    return Inertial(density * amount, at, axes)


def _solid(triangles: Array, method: str) -> tuple[float, Array, Array]:
    """Volume [m3], or area of a shell [m2], its centre [m], and its inertia about that by density.

    Args:
        triangles: shape (n, 3, 3).
        method: see `MeshMass`.
    """
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    middles = triangles.mean(axis=1)
    if method == "shell":
        return _sums(areas, triangles, 12.0)
    apex = areas @ middles / max(float(areas.sum()), 1e-300)
    centre = None
    if method == "legacy":
        # The centre of a first sum is where the tetrahedra of the second one meet.
        amount, apex, _ = _sums(np.abs(_volumes(triangles, apex)), _with(triangles, apex), 20.0)
        if not amount > 0:
            return 0.0, apex, np.zeros((3, 3))
        centre = apex
    volumes = _volumes(triangles, apex)
    volumes = volumes if method == "exact" else np.abs(volumes)
    return _sums(volumes, _with(triangles, apex), 20.0, centre)


def _volumes(triangles: Array, apex: Array) -> Array:
    """Volumes of the tetrahedra between triangles and a point [m3], negative on its other side."""
    a, b, c = (triangles[:, i] - apex for i in range(3))
    return np.einsum("ni,ni->n", a, np.cross(b, c)) / 6


def _with(triangles: Array, apex: Array) -> Array:
    """Corners of those tetrahedra, shape (n, 4, 3)."""
    return np.concatenate([triangles, np.broadcast_to(apex, (len(triangles), 1, 3))], axis=1)


def _sums(
    amounts: Array, corners: Array, share: float, centre: Array | None = None
) -> tuple[float, Array, Array]:
    """Sum of uniform simplices, its centre, and its inertia about that or another centre.

    The second moment of one is amount / share times that of its corners and their sum; `share` is
    12 for triangles and 20 for tetrahedra.
    """
    total = float(amounts.sum())
    if not total > 0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    mean: Array = np.einsum("n,nki->i", amounts, corners) / corners.shape[1] / total
    at = mean if centre is None else centre
    away = corners - at
    whole = away.sum(axis=1)
    second = np.einsum("n,nki,nkj->ij", amounts, away, away)
    second = (second + np.einsum("n,ni,nj->ij", amounts, whole, whole)) / share
    return total, at, np.trace(second) * np.eye(3) - second
