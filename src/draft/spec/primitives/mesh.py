"""Closed triangle meshes of parts of one's own, with the mass properties of the uniform solid.

trimesh weighs a mesh of triangles; a part that is read from STEP has the numbers of its solids.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from draft.geometry import Vector
from draft.values import Array

# Of MuJoCo, halved: a robot is compiled from text, and its page and report carry every triangle.
MAX_TRIANGLES = 100_000
_MIRRORS = "xyz"
_FARTHEST = 1e5  # of a point from the origin [m]


class MeshError(ValueError):
    """A mesh that is no solid: `str` of it is the cause, `remedy` says what to do."""

    def __init__(self, cause: str, remedy: str) -> None:
        super().__init__(cause)
        self.remedy = remedy


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed solid of triangles in its own frame.

    Attributes:
        name: name of its files and assets, unique in a robot.
        file: path of its file in the robot's folder.
        vertices: shape (V, 3) [m].
        corners: vertices of each triangle, counter-clockwise from outside, shape (F, 3).
        volume: of the solid [m3].
        com: centre of mass of the uniform solid [m], shape (3,).
        inertia: about that centre per unit density [m5], shape (3, 3).
        step: content of its STEP file, whose solids are exact; None for a mesh.
        signs: of its reflection, per axis.
    """

    name: str
    file: str
    vertices: Array = field(repr=False)
    corners: NDArray[np.int64] = field(repr=False)
    volume: float
    com: Array
    inertia: Array
    step: bytes | None = field(default=None, repr=False)
    signs: Vector = (1.0, 1.0, 1.0)
    _mirrors: dict[Vector, Mesh] = field(default_factory=dict, repr=False)

    def faces(self) -> NDArray[np.int64]:
        """Vertices of the triangles, shape (F, 3)."""
        return self.corners

    @property
    def size(self) -> Array:
        """Edges of the box around it [m], shape (3,)."""
        return np.ptp(self.vertices, axis=0)

    @cached_property
    def vertex_text(self) -> str:
        """Its vertices as MJCF has them, in single precision."""
        return " ".join(f"{x:.9g}" for x in self.vertices.astype(np.float32).ravel().tolist())

    @cached_property
    def face_text(self) -> str:
        """Its triangles as MJCF has them."""
        return " ".join(map(str, self.corners.ravel().tolist()))

    def mirrored(self, signs: Vector) -> Mesh:
        """Return its reflection, whose triangles face outwards again."""
        known = self._mirrors.get(signs)
        if known is None:
            s = np.array(signs, dtype=float)
            axes = "".join(axis for axis, sign in zip(_MIRRORS, signs, strict=True) if sign < 0)
            known = self._mirrors[signs] = replace(
                self,
                name=f"{self.name}.{axes}",
                vertices=self.vertices * s,
                corners=self.corners[:, ::-1] if s.prod() < 0 else self.corners,
                com=self.com * s,
                inertia=self.inertia * np.outer(s, s),
                signs=signs,
                _mirrors={},
            )
        return known


def closed(triangles: Array, name: str, file: str) -> Mesh:
    """Solid that triangles enclose.

    Args:
        triangles: shape (n, 3, 3) [m].
        name: name of the mesh.
        file: path of its file.

    Raises:
        MeshError: there are too many of them, or they enclose no solid, or it is inside out.
    """
    vertices, corners = welded(triangles)
    pairs = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(pairs, axis=0, return_counts=True)
    bad = np.flatnonzero(uses != 2)
    if bad.size:
        at = ", ".join(f"{x:.4g}" for x in vertices[edges[bad[0]]].mean(axis=0))
        raise MeshError(
            f"the mesh is open: {len(bad)} of its edges belong to one triangle or to more than "
            f"two, the first near [{at}] m",
            "close it in the program that made it: every edge belongs to two triangles",
        )
    if not len(corners):
        raise MeshError(
            "the triangles of the mesh have no area",
            "state its 'unit', or export it with more digits",
        )
    import trimesh

    solid = trimesh.Trimesh(vertices, corners, process=False)
    if not solid.is_winding_consistent:
        raise MeshError(
            "neighbouring triangles of the mesh face opposite sides",
            "make its normals consistent in the program that made it",
        )
    # About its own middle, so that the distance to the origin takes no digits.
    middle = vertices.mean(axis=0)
    solid.vertices = vertices - middle
    found = solid.mass_properties
    volume = float(found.mass)
    if volume < 0:
        raise MeshError(
            f"the mesh is inside out: its volume is {volume:.3g} m3",
            "flip its normals: triangles run counter-clockwise as seen from outside",
        )
    if not volume > 0:
        raise MeshError("the mesh encloses nothing", "export a solid")
    com = np.asarray(found.center_mass) + middle
    return Mesh(name, file, vertices, corners, volume, com, np.asarray(found.inertia))


def welded(triangles: Array) -> tuple[Array, NDArray[np.int64]]:
    """Vertices, shape (V, 3), and triangles by them, shape (F, 3); those of one point are left out.

    Args:
        triangles: shape (n, 3, 3) [m].

    Raises:
        MeshError: there are too many, or one has a point far away.
    """
    if len(triangles) > MAX_TRIANGLES:
        raise MeshError(
            f"a mesh of {len(triangles)} triangles; the limit is {MAX_TRIANGLES}",
            "export it with fewer triangles, or a simpler part",
        )
    if not np.abs(triangles).max(initial=0.0) < _FARTHEST:  # Nor is it no number.
        raise MeshError(
            f"a point of the mesh is no number, or beyond {_FARTHEST:.0e} m",
            "export it again, or state its 'unit'",
        )
    import trimesh

    solid = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles), process=False)
    solid.merge_vertices()
    corners = np.asarray(solid.faces, dtype=np.int64)
    a, b, c = corners.T
    return np.asarray(solid.vertices), corners[(a != b) & (b != c) & (c != a)]
