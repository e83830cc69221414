"""Fields of N compiled models from the numbers of their elements, by arrays.

They agree with MuJoCo's compiler to 1e-9: masses from densities, inertias composed over the geoms
of a body, boxes and spheres around geoms, and the trees of boxes that speed up collisions. Within
this module the last axis counts designs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.model.batch_layout import TYPES, Geoms, Index, Layout
from draft.model.decimals import rounded
from draft.model.principal import apply, composed, matrices, off_centre, principal, product, turned
from draft.spec.primitives.loft import Loft
from draft.values import Array

# Frames nearer than this count as one in MuJoCo's compiler.
_SAME_FRAME = 1e-6
_SAME, _SAME_ROTATION = 1.0, 3.0  # of mjtSameFrame
# What has less is left to MuJoCo, which may refuse it [kg], [kg m2], [m3].
_LEAST_MASS, _LEAST_INERTIA, _LEAST_VOLUME = 1e-9, 1e-13, 1e-9


class Patch(NamedTuple):
    """Values of a part of a field.

    Attributes:
        name: of the field of MjModel.
        flat: whether `ids` are indices in the flattened field, else along its first axis.
        ids: where the values belong, shape (k,).
        columns: along the field's second axis, if not all of it.
        values: shape (k, N) or (k, columns, N); N may be 1 for what all designs share.
    """

    name: str
    flat: bool
    ids: Index
    columns: slice
    values: Array | NDArray[np.int_]


class Compiled(NamedTuple):
    """Numbers of some designs.

    Attributes:
        patches: all that may differ from the template.
        mass: masses of the bodies [kg], shape (bodies, N).
        sound: whether MuJoCo is sure to accept a design, shape (N,).
    """

    patches: list[Patch]
    mass: Array
    sound: NDArray[np.bool_]


class Bodies(NamedTuple):
    """Masses, centres, principal frames and principal moments of all bodies, the world first."""

    mass: Array
    pos: Array
    quat: Array
    moments: Array


class Compiler:
    """Compiles designs of one layout."""

    def __init__(self, layout: Layout, template: mujoco.MjModel, loft: Loft | None) -> None:
        """Prepare what does not depend on the numbers.

        Args:
            layout: from `draft.model.batch_layout.layout`.
            template: the compiled model that the layout was matched with.
            loft: the trunk's solid, of one design or of N; None for a fixed base.
        """
        self.layout, self.template, self.loft = layout, template, loft
        geoms = layout.geoms
        self.meshes = np.flatnonzero(geoms.types == TYPES["mesh"])
        self.solids = np.flatnonzero(geoms.types != TYPES["mesh"])
        self.groups = [
            np.flatnonzero((geoms.bodies == b) & ~geoms.massless) for b in range(template.nbody)
        ]
        self.moving = np.flatnonzero(template.body_dofnum > 0)
        self.aligned = layout.numbers.are_constant(geoms.quat)
        self.tree = _Tree(template)

    def rows(self, rows: Index) -> Compiled:
        """Compile some of the N designs."""
        with np.errstate(all="ignore"):
            table = self.layout.numbers.table(rows)
            patches = [
                Patch(name, True, to, slice(None), table[of])
                for name, (to, of) in self.layout.plain.items()
            ]
            patches += [
                Patch(name, False, to, slice(None), _unit(table[of]))
                for name, (to, of) in self.layout.unit.items()
            ]
            sound = np.isfinite(table).all(axis=0) & self._ranges(table)
            solids, mass, accepted = self._solids(table, rows)
            patches += solids
        return Compiled(patches, mass, sound & accepted)

    def _ranges(self, table: Array) -> NDArray[np.bool_]:
        """Whether all ranges of joints are left after rounding."""
        found = self.layout.plain.get("jnt_range")
        if found is None:
            return np.ones(table.shape[1], dtype=bool)
        low, high = table[found[1][0::2]], table[found[1][1::2]]
        return np.asarray((low < high).all(axis=0))

    def _solids(self, table: Array, rows: Index) -> tuple[list[Patch], Array, NDArray[np.bool_]]:
        """Geoms, and what bodies get of them."""
        geoms = self.layout.geoms
        size, pos = table[geoms.size], table[geoms.pos]
        # Most geoms lie along axes of their bodies in all designs: one column does for all.
        quat = _unit(table[geoms.quat][..., : 1 if self.aligned else None])
        volume, moments = _measures(geoms, size)
        frames = quat
        # Parts of one's own weigh nothing: boxes have their inertia.
        lofts = self.meshes[~geoms.massless[self.meshes]]
        parts = self.meshes[geoms.massless[self.meshes]]
        volume[parts], moments[parts] = 1.0, 0.0
        if self.loft is not None and len(lofts):
            frames = np.repeat(quat, size.shape[-1] // quat.shape[-1], axis=-1)
            for k in lofts:
                volume[k], pos[k], frames[k], moments[k] = _mesh(self.loft, rows)
        sound = (volume[self.solids] > 0).all(axis=0)
        sound &= (volume[self.meshes] > _LEAST_VOLUME).all(axis=0)
        mass = np.where(geoms.massless[:, None], 0.0, table[geoms.density] * volume)
        moments *= mass[:, None]
        bodies = self._bodies(mass, pos, quat, frames, moments)
        self._place_massless(bodies, table)
        radius, half = _around(geoms, size)
        # The template's mesh has its own place and box; a part moves with its geom.
        t = self.template
        for k in self.meshes:
            own = geoms.ids[k]
            half[k] = t.geom_aabb[own, 3:, None]
            if k in parts:
                mesh = t.geom_dataid[own]
                pos[k] += apply(matrices(quat[k]), t.mesh_pos[mesh, :, None])
                quat[k] = composed(quat[k], t.mesh_quat[mesh, :, None])
            else:
                pos[k], quat[k] = t.geom_pos[own, :, None], t.geom_quat[own, :, None]
        ids, solid = geoms.ids[self.solids], self.solids
        whole, moved = slice(None), np.concatenate([solid, parts])
        patches = [
            Patch("geom_size", False, ids, whole, size[solid]),
            Patch("geom_pos", False, geoms.ids[moved], whole, pos[moved]),
            Patch("geom_quat", False, geoms.ids[moved], whole, quat[moved]),
            Patch("geom_rbound", False, ids, whole, radius[solid]),
            Patch("geom_aabb", False, ids, slice(3, 6), half[solid]),
            *self._body_patches(bodies),
            *self.tree.patches(geoms, bodies, pos, quat, half),
        ]
        same = self._same_frames(bodies)
        patches.append(Patch("body_sameframe", False, np.arange(1, len(same)), whole, same[1:]))
        # A body that floats alone has a diagonal M(q) if its frames agree, which MuJoCo relies on.
        simple = np.flatnonzero(t.body_simple[1:]) + 1
        sound &= (same[simple] == t.body_sameframe[simple, None]).all(axis=0)
        return patches, bodies.mass, sound & self._accepted(bodies)

    def _bodies(
        self, mass: Array, pos: Array, quat: Array, frames: Array, moments: Array
    ) -> Bodies:
        """Masses, centres and inertias of all bodies.

        Args:
            mass: of the geoms [kg].
            pos: their centres [m].
            quat: frames of those that are no mesh, maybe one for all designs.
            frames: frames of all geoms for every design.
            moments: principal moments of the geoms [kg m2].
        """
        t, n = self.template, mass.shape[1]
        found = Bodies(
            np.zeros((t.nbody, n)),
            np.zeros((t.nbody, 3, n)),
            np.zeros((t.nbody, 4, n)),
            np.zeros((t.nbody, 3, n)),
        )
        found.quat[:, 0] = 1.0
        alone = [body for body, group in enumerate(self.groups) if len(group) == 1]
        only = [self.groups[body][0] for body in alone]
        several = [body for body, group in enumerate(self.groups) if len(group) > 1]
        for to, values in zip(found, (mass, pos, frames, moments), strict=True):
            to[alone] = values[only]
        if several:
            if any(np.isin(self.meshes, self.groups[b]).any() for b in several):
                quat = frames
            combined = _combined([self.groups[b] for b in several], mass, pos, quat, moments)
            for to, values in zip(found, combined, strict=True):
                to[several] = values
        return found

    def _place_massless(self, bodies: Bodies, table: Array) -> None:
        """Give bodies without mass the inertial frame of MuJoCo, a copy of their place."""
        massless = [body for body, group in enumerate(self.groups) if body and not len(group)]
        if not massless:
            return
        to, places = self.layout.plain["body_pos"]
        ids, turns = self.layout.unit["body_quat"]
        for body in massless:
            bodies.pos[body] = table[places[to // 3 == body]]
            bodies.quat[body] = _unit(table[turns[ids == body]])[0]

    def _accepted(self, bodies: Bodies) -> NDArray[np.bool_]:
        """Whether MuJoCo is sure to accept the bodies."""
        mass, moments = bodies.mass[1:], bodies.moments[1:]
        a, b, c = (moments[:, k] for k in range(3))
        largest, least = np.maximum(np.maximum(a, b), c), np.minimum(np.minimum(a, b), c)
        # MuJoCo refuses moments that no body has; rounding alone can make a thin one such.
        fine = (mass > _LEAST_MASS) & (least > _LEAST_INERTIA) & (2 * largest <= a + b + c)
        return (fine | (mass == 0)).all(axis=0) & (bodies.mass[self.moving] > 0).all(axis=0)

    def _body_patches(self, bodies: Bodies) -> Iterator[Patch]:
        ids, whole = np.arange(1, self.template.nbody), slice(None)
        names = ("body_mass", "body_ipos", "body_iquat", "body_inertia")
        for name, values in zip(names, bodies, strict=True):
            yield Patch(name, False, ids, whole, values[1:])

    def _same_frames(self, bodies: Bodies) -> Array:
        """Mask of the bodies whose inertial frame is their own frame."""
        there = (abs(bodies.pos) < _SAME_FRAME).all(axis=1)
        along = (abs(bodies.quat[:, 1:]) < _SAME_FRAME).all(axis=1)
        along &= abs(abs(bodies.quat[:, 0]) - 1) < _SAME_FRAME
        return np.where(along, np.where(there, _SAME, _SAME_ROTATION), 0.0)


class _Tree:
    """Boxes around the geoms of each body in its inertial frame, nested as the template's."""

    def __init__(self, template: mujoco.MjModel) -> None:
        t = template
        count = int(t.body_bvhnum.sum())
        nodes = np.arange(count)
        self.leaves = nodes[t.bvh_nodeid[:count] >= 0]
        self.geoms = t.bvh_nodeid[self.leaves].astype(np.intp)
        self.bodies = t.geom_bodyid[self.geoms].astype(np.intp)
        starts = np.repeat(t.body_bvhadr, t.body_bvhnum)
        children = t.bvh_child[:count] + starts[:, None]
        # From the leaves up: those of one step do not hold each other.
        depth = t.bvh_depth[:count]
        inner = t.bvh_nodeid[:count] < 0
        self.steps = [
            (found, children[found, 0], children[found, 1])
            for level in range(int(depth.max(initial=0)), -1, -1)
            if len(found := nodes[inner & (depth == level)])
        ]
        self.nodes = nodes
        self.off_centre = t.geom_aabb[self.geoms, :3]

    def patches(
        self, geoms: Geoms, bodies: Bodies, pos: Array, quat: Array, half: Array
    ) -> Iterator[Patch]:
        """Boxes of all nodes."""
        order = np.empty(int(geoms.ids.max()) + 1, dtype=np.intp)
        order[geoms.ids] = np.arange(len(geoms.ids))
        own = order[self.geoms]
        axes = matrices(bodies.quat)[self.bodies].swapaxes(1, 2)
        turn = matrices(quat)[own]
        centre = pos[own] - bodies.pos[self.bodies]
        for k in np.flatnonzero(self.off_centre.any(axis=1)):  # a mesh
            centre[k] += apply(turn[k : k + 1], self.off_centre[k][None, :, None])[0]
        n = centre.shape[-1]
        low, high = np.empty((len(self.nodes), 3, n)), np.empty((len(self.nodes), 3, n))
        centre, size = apply(axes, centre), apply(abs(product(axes, turn)), half[own])
        low[self.leaves], high[self.leaves] = centre - size, centre + size
        for nodes, first, second in self.steps:
            low[nodes] = np.minimum(low[first], low[second])
            high[nodes] = np.maximum(high[first], high[second])
        yield Patch("bvh_aabb", False, self.nodes, slice(0, 3), (low + high) / 2)
        yield Patch("bvh_aabb", False, self.nodes, slice(3, 6), (high - low) / 2)


def _mesh(loft: Loft, rows: Index) -> tuple[Array, Array, Array, Array]:
    """Volume, centre, principal frame and principal moments per mass of the trunk."""
    vertices = loft.vertices
    vertices = vertices[:, :, rows] if vertices.ndim == 3 else vertices[:, :, None]
    # MuJoCo keeps the vertices of a mesh in single precision.
    stored = rounded(vertices).astype(np.float32).astype(np.float64)
    solid = replace(loft, vertices=stored)
    volume = np.asarray(solid.volume)
    moments, quat = principal(solid.inertia)
    return volume, solid.com, quat, moments / volume


def _unit(values: Array) -> Array:
    """Vectors along the axis before the last, at unit length."""
    return values / np.sqrt((values * values).sum(axis=-2, keepdims=True))


def _measures(geoms: Geoms, size: Array) -> tuple[Array, Array]:
    """Volumes [m3] and principal moments per mass [m2], shapes (geoms, N) and (geoms, 3, N)."""
    volume = np.empty((len(size), size.shape[-1]))
    moments = np.empty((len(size), 3, size.shape[-1]))
    k = np.flatnonzero(geoms.types == TYPES["sphere"])
    r = size[k, 0]
    volume[k] = 4 * np.pi * r * r * r / 3
    moments[k] = (2 * r * r / 5)[:, None]
    k = np.flatnonzero(geoms.types == TYPES["cylinder"])
    r, height = size[k, 0], 2 * size[k, 1]
    volume[k] = np.pi * r * r * height
    moments[k, 0] = moments[k, 1] = (3 * r * r + height * height) / 12
    moments[k, 2] = r * r / 2
    k = np.flatnonzero(geoms.types == TYPES["box"])
    x, y, z = (size[k, i] for i in range(3))
    volume[k] = 8 * x * y * z
    for i, (a, b) in enumerate(((y, z), (x, z), (x, y))):
        moments[k, i] = (a * a + b * b) / 3
    return volume, moments


def _around(geoms: Geoms, size: Array) -> tuple[Array, Array]:
    """Radii of spheres and half sizes of boxes around geoms, (geoms, N) and (geoms, 3, N) [m]."""
    half = size.copy()
    k = np.flatnonzero(geoms.types == TYPES["cylinder"])
    half[k, 2], half[k, 1] = size[k, 1], size[k, 0]
    radius = np.sqrt((half * half).sum(axis=1))
    radius[k] = np.sqrt(size[k, 0] ** 2 + size[k, 1] ** 2)
    k = np.flatnonzero(geoms.types == TYPES["sphere"])
    half[k], radius[k] = size[k, :1], size[k, 0]
    return radius, half


def _combined(
    groups: Sequence[Index], mass: Array, pos: Array, quat: Array, moments: Array
) -> Bodies:
    """Bodies of several geoms each.

    A geom without mass changes nothing; where only one has mass, the body has its frame.
    """
    most, n = max(map(len, groups)), mass.shape[-1]
    total, com = np.zeros((len(groups), n)), np.zeros((len(groups), 3, n))
    # Bodies that have a k-th geom, and which it is.
    steps = [
        (
            np.array([i for i, g in enumerate(groups) if len(g) > k]),
            [g[k] for g in groups if len(g) > k],
        )
        for k in range(most)
    ]
    for i, k in steps:
        total[i] += mass[k]
        com[i] += mass[k][:, None] * pos[k]
    com /= total[:, None]
    tensor = np.zeros((len(groups), 3, 3, n))
    for i, k in steps:
        tensor[i] += turned(moments[k], matrices(quat[k]))
        tensor[i] += off_centre(mass[k], pos[k] - com[i])
    inertia, frame = principal(tensor)
    found = Bodies(total, com, frame, inertia)
    count = np.zeros((len(groups), n), dtype=int)
    for i, k in steps:
        count[i] += mass[k] > 0
    if (count < 2).any():
        _exceptions(found, count, steps, Bodies(mass, pos, quat, moments))
    return found


def _exceptions(
    found: Bodies,
    count: NDArray[np.int_],
    steps: Sequence[tuple[Index, list[Index]]],
    geoms: Bodies,
) -> None:
    """Bodies with mass in one geom, which have its frame, and those without mass."""
    none = count == 0
    found.pos[:] = np.where(none[:, None], 0.0, found.pos)
    found.moments[:] = np.where(none[:, None], 0.0, found.moments)
    found.quat[:] = np.where(none[:, None], 0.0, found.quat)
    found.quat[:, 0] += none
    for i, k in steps:
        alone = ((count[i] == 1) & (geoms.mass[k] > 0))[:, None]
        for to, values in zip(found[1:], geoms[1:], strict=True):
            to[i] = np.where(alone, values[k], to[i])
