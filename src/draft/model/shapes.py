"""Shapes of a compiled model in the frames of their bodies, for exports and pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from draft.design.design import Design
from draft.spec.primitives import colors
from draft.spec.primitives.base import HIDDEN, Geom
from draft.spec.primitives.loft import Loft
from draft.spec.primitives.mesh import Mesh
from draft.values import Array, scalar

Form = Literal["mesh", "box", "cylinder", "sphere"]
_FORMS: dict[int, Form] = {
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
}


@dataclass(frozen=True, slots=True)
class Shape:
    """A shape.

    Attributes:
        name: name of its geom.
        body: index of its body in the compiled model.
        kind: kind of part, a key of `draft.spec.primitives.colors()`.
        form: "mesh" is the trunk, or a part of one's own.
        size: half sizes [m] in MuJoCo's convention, shape (3,); meaningless for a mesh.
        position: position of its frame in the frame of the body [m], shape (3,).
        rotation: rotation of its frame in the frame of the body, shape (3, 3).
        collides: whether it touches the floor and objects.
        mesh: the solid of a mesh, in the frame of the shape; None for other forms.
    """

    name: str
    body: int
    kind: str
    form: Form
    size: Array
    position: Array
    rotation: Array
    collides: bool
    mesh: Loft | Mesh | None = None

    @property
    def drawn(self) -> bool:
        """Whether it is seen; others only collide, or have the inertia of a part."""
        return self.kind != HIDDEN


def mesh_geoms(design: Design) -> dict[str, Geom]:
    """Geoms of a design that are meshes, by their names in a model."""
    trunk = () if design.lofted is None else design.lofted.geoms()
    found = {design.bodies[0].name + geom.suffix: geom for geom in trunk}
    found |= {body.name + geom.suffix: geom for body in design.bodies for geom in body.geoms()}
    return {name: geom for name, geom in found.items() if geom.mesh is not None}


def shapes(model: mujoco.MjModel, design: Design) -> list[Shape]:
    """Return the shapes of a robot, in the order of the model's geoms."""
    visible, meshes = [], mesh_geoms(design)
    # A compiled model has no geom classes, but colours, in single precision, identify them.
    kinds = {tuple(np.array(color, np.float32)): kind for kind, color in colors().items()}
    for i in range(model.ngeom):
        form = _FORMS[int(model.geom_type[i])]
        name = model.geom(i).name
        position, rotation, mesh = model.geom_pos[i].copy(), matrix(model.geom_quat[i]), None
        if form == "mesh":  # MuJoCo moves it into its principal frame.
            geom = meshes[name]
            mesh, position = geom.mesh, np.array([scalar(x) for x in geom.center])
            rotation = np.array(geom.rotation or np.eye(3), dtype=float)
        visible.append(
            Shape(
                name,
                int(model.geom_bodyid[i]),
                kinds[tuple(model.geom_rgba[i])],
                form,
                model.geom_size[i].copy(),
                position,
                rotation,
                bool(model.geom_contype[i] or model.geom_conaffinity[i]),
                mesh,
            )
        )
    return visible


def matrix(quaternion: ArrayLike) -> Array:
    """Rotation matrix, shape (3, 3), of a unit quaternion (w, x, y, z)."""
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, np.asarray(quaternion, dtype=np.float64))
    return flat.reshape(3, 3)
