"""Shade on the floor under robots, lit by lamps far away.

Points on the robots' surfaces are projected to the floor along the rays of many lamps. The share
of the rays that meet a robot is the shade: the mean of hundreds of hard shadows has no visible
steps, and costs a fraction of rendering it.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.values import Array

# Points on the surface per area of a cell of the floor: few enough cells stay empty.
DENSITY = 2.5
_SIDES = 32  # of a round surface
_BOX = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], float)
_FACES = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
_PLASTIC = 1.32471795724474602596  # Its powers spread points evenly (Roberts' R2 sequence).


@dataclass(frozen=True)
class Shade:
    """Shade on a rectangle of the floor.

    Attributes:
        values: share of the light that robots hold off [1], shape (x, y).
        corner: position of the first value [m], shape (2,).
        cell: distance of two values [m].
    """

    values: Array
    corner: Array
    cell: float

    def at(self, places: Array) -> Array:
        """Return the shade at places on the floor [m], shape (..., 2); zero outside."""
        x, y = np.moveaxis((places - self.corner) / self.cell, -1, 0)
        rows, columns = self.values.shape
        # NaN, where a line of sight misses the floor, is outside as well.
        inside = (x >= 0) & (y >= 0) & (x < rows - 1) & (y < columns - 1)
        found = np.zeros(x.shape)
        x, y = x[inside], y[inside]
        i, j = x.astype(int), y.astype(int)
        u, v = x - i, y - j
        near = (1 - v) * self.values[i, j] + v * self.values[i, j + 1]
        far = (1 - v) * self.values[i + 1, j] + v * self.values[i + 1, j + 1]
        found[inside] = (1 - u) * near + u * far
        return found


def shade(model: mujoco.MjModel, data: mujoco.MjData, rays: Array, cell: float) -> Shade:
    """Shade of all geoms except planes on the floor z = 0.

    Args:
        model: the scene.
        data: its poses; the positions of geoms must be up to date.
        rays: direction of each lamp's light, with -1 along z, shape (lamps, 3).
        cell: size of the smallest detail [m].
    """
    points = surface(triangles(model, data), cell**2 / DENSITY).astype(np.float32) / cell
    ground, height = points[:, :2], points[:, 2:].clip(min=0.0)
    low, high = rays[:, :2].min(axis=0), rays[:, :2].max(axis=0)
    corner = np.floor((ground + height * low).min(axis=0)) - 2
    ground -= corner
    shape = np.ceil((ground + height * high).max(axis=0)).astype(int) + 3
    total = np.zeros(shape, np.float32)
    for ray in rays.astype(np.float32):
        i, j = (ground + (height * ray[:2] + np.float32(0.5))).astype(np.int32).T
        hit = np.zeros(shape, bool)
        hit.ravel()[i * np.int32(shape[1]) + j] = True
        total += hit
    return Shade(_smooth(total / len(rays)), corner * cell, cell)


def _smooth(values: Array) -> Array:
    """Weigh each value 1/2 with its two neighbours 1/4, along both axes."""
    for axis in (0, 1):
        sides = np.roll(values, 1, axis) + np.roll(values, -1, axis)
        values = values / 2 + sides / 4
    return values


def surface(corners: Array, area: float) -> Array:
    """Points spread over triangles, shape (points, 3).

    Args:
        corners: of the triangles [m], shape (triangles, 3, 3).
        area: surface per point [m²]; small triangles share one.
    """
    a, b, c = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.linalg.norm(np.cross(b, c), axis=1) / 2
    counts = np.diff(np.floor(np.cumsum(areas / area)), prepend=0.0).astype(int)
    of = np.repeat(np.arange(len(counts)), counts)
    k = np.arange(len(of))
    u, v = (0.5 + k / _PLASTIC) % 1, (0.5 + k / _PLASTIC**2) % 1
    # The half of the parallelogram beyond the triangle is turned into it.
    beyond = u + v > 1
    u, v = np.where(beyond, 1 - u, u)[:, None], np.where(beyond, 1 - v, v)[:, None]
    return a[of] + u * b[of] + v * c[of]


def triangles(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Corners of triangles on the surfaces of all that is drawn except planes [m], (n, 3, 3)."""
    found = [np.empty((0, 3, 3))]
    for i in np.flatnonzero(model.geom_rgba[:, 3]).tolist():
        own = _solid(model, i)
        if own is not None:
            found.append(own @ data.geom_xmat[i].reshape(3, 3).T + data.geom_xpos[i])
    return np.concatenate(found)


def _solid(model: mujoco.MjModel, geom: int) -> Array | None:
    """Triangles of a geom in its own frame [m]; None for one without a surface here."""
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    arc = np.linspace(0, np.pi, _SIDES // 2 + 1)
    ball = np.column_stack([np.sin(arc), np.cos(arc)])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
        faces: NDArray[np.int32] = model.mesh_face[face : face + model.mesh_facenum[mesh]]
        return model.mesh_vert[first + faces].astype(float)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        quads = (_BOX * size)[np.array(_FACES)]
        return np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        r, h = size[:2]
        return _revolve(np.array([(0, h), (r, h), (r, -h), (0, -h)]))
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        ends = np.where(ball[:, 1] >= 0, size[1], -size[1])
        return _revolve(size[0] * ball + np.column_stack([0 * ends, ends]))
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return _revolve(size[0] * ball)
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return _revolve(ball) * size
    return None


def _revolve(profile: Array) -> Array:
    """Triangles of a profile of radii and heights [m], shape (n, 2), turned about z."""
    turn = np.linspace(0, 2 * np.pi, _SIDES + 1)
    x, y = (profile[:, :1] * f(turn) for f in (np.cos, np.sin))
    grid = np.stack([x, y, np.broadcast_to(profile[:, 1:], x.shape)], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    both = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)])
    return both.reshape(-1, 3, 3)
