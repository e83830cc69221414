"""Triangles of a robot, colour by colour."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import mujoco
import numpy as np

SIDES = 24
Color = tuple[int, int, int]


class Mesh(NamedTuple):
    """Vertices [m], shape (n, 3), and triangles, shape (k, 3)."""

    vertices: np.ndarray
    faces: np.ndarray


class Skin(NamedTuple):
    """What is seen of a robot in one colour.

    Attributes:
        vertices: in the frame of the body that each belongs to [m], shape (n, 3).
        bodies: that body, shape (n,).
        faces: triangles, shape (k, 3).
    """

    vertices: np.ndarray
    bodies: np.ndarray
    faces: np.ndarray

    def placed(self, data: mujoco.MjData) -> np.ndarray:
        """Vertices in the world, where a state has the bodies, shape (n, 3)."""
        frames = data.xmat.reshape(-1, 3, 3)[self.bodies]
        turned = np.einsum("nij,nj->ni", frames, self.vertices)
        return (turned + data.xpos[self.bodies]).astype(np.float32)


def skins(robot: mujoco.MjModel) -> dict[Color, Skin]:
    """What is seen of a robot, colour by colour: few meshes are drawn faster than many."""
    parts: dict[Color, list[tuple[Mesh, int]]] = {}
    for i in range(robot.ngeom):
        mesh = _geom(robot, i)
        if mesh is None:
            continue
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, robot.geom_quat[i])
        placed = mesh.vertices @ rotation.reshape(3, 3).T + robot.geom_pos[i]
        red, green, blue = (round(255 * float(x)) for x in robot.geom_rgba[i, :3])
        at = int(robot.geom_bodyid[i])
        parts.setdefault((red, green, blue), []).append((Mesh(placed, mesh.faces), at))
    return {color: _join(of) for color, of in parts.items()}


def _join(parts: list[tuple[Mesh, int]]) -> Skin:
    counts = [len(mesh.vertices) for mesh, _ in parts]
    starts = np.cumsum([0, *counts[:-1]])
    faces = [mesh.faces + start for (mesh, _), start in zip(parts, starts, strict=True)]
    return Skin(
        np.concatenate([mesh.vertices for mesh, _ in parts]),
        np.repeat([body for _, body in parts], counts),
        np.concatenate(faces).astype(np.uint32),
    )


def _geom(robot: mujoco.MjModel, i: int) -> Mesh | None:
    kinds: Any = mujoco.mjtGeom
    kind, size = robot.geom_type[i], robot.geom_size[i]
    if kind == kinds.mjGEOM_CYLINDER:
        return _scaled(_cylinder(), (size[0], size[0], size[1]))
    if kind == kinds.mjGEOM_SPHERE:
        return _scaled(_sphere(), (size[0],) * 3)
    if kind == kinds.mjGEOM_BOX:
        return _scaled(_box(), size)
    if kind == kinds.mjGEOM_MESH:
        return _solid(robot, int(robot.geom_dataid[i]))
    return None


def _scaled(mesh: Mesh, size: Any) -> Mesh:
    return Mesh(mesh.vertices * np.asarray(size), mesh.faces)


def _solid(robot: mujoco.MjModel, mesh: int) -> Mesh:
    """A mesh with corners of its own for each triangle, so that its edges look sharp."""
    at, count = robot.mesh_vertadr[mesh], robot.mesh_vertnum[mesh]
    first, faces = robot.mesh_faceadr[mesh], robot.mesh_facenum[mesh]
    vertices = robot.mesh_vert[at : at + count]
    corners = vertices[robot.mesh_face[first : first + faces].ravel()]
    return Mesh(corners, np.arange(3 * faces).reshape(-1, 3))


@lru_cache(maxsize=1)
def _cylinder() -> Mesh:
    """Radius 1, from z = -1 to 1; its caps have rims of their own, so that the edge looks sharp."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    low, high = (np.column_stack([ring, np.full(SIDES, z)]) for z in (-1.0, 1.0))
    vertices = np.concatenate([low, high, low, high, [[0, 0, -1], [0, 0, 1]]])
    i, j = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    bottom, top = np.full(SIDES, 4 * SIDES), np.full(SIDES, 4 * SIDES + 1)
    faces = [
        np.column_stack([i, j, j + SIDES]),
        np.column_stack([i, j + SIDES, i + SIDES]),
        np.column_stack([bottom, j + 2 * SIDES, i + 2 * SIDES]),
        np.column_stack([top, i + 3 * SIDES, j + 3 * SIDES]),
    ]
    return Mesh(vertices, np.concatenate(faces))


@lru_cache(maxsize=1)
def _sphere() -> Mesh:
    rows = SIDES // 2
    polar = np.pi * np.arange(rows + 1) / rows
    around = 2 * np.pi * np.arange(SIDES) / SIDES
    p, a = np.meshgrid(polar, around, indexing="ij")
    grid = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    k = np.arange(rows * SIDES)
    right = k - k % SIDES + (k + 1) % SIDES
    faces = [
        np.column_stack([k, k + SIDES, right + SIDES]),
        np.column_stack([k, right + SIDES, right]),
    ]
    return Mesh(grid.reshape(-1, 3), np.concatenate(faces))


@lru_cache(maxsize=1)
def _box() -> Mesh:
    quads = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            middle = side * np.eye(3)[axis]
            corners = [middle - u - v, middle + u - v, middle + u + v, middle - u + v]
            quads.append(corners if side > 0 else corners[::-1])
    start = 4 * np.arange(6)[:, None]
    faces = np.concatenate([start + np.array([0, 1, 2]), start + np.array([0, 2, 3])])
    return Mesh(np.array(quads).reshape(-1, 3), faces)
