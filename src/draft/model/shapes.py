"""Visible shapes of a compiled model in the frames of their bodies, for exports and pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from draft.design.design import Design
from draft.spec.primitives import colors
from draft.values import Array

Form = Literal["mesh", "box", "cylinder", "sphere"]
_FORMS: dict[int, Form] = {
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
}


@dataclass(frozen=True, slots=True)
class Shape:
    """A visible shape.

    Attributes:
        name: name of its geom.
        body: index of its body in the compiled model.
        kind: kind of part, a key of `draft.spec.primitives.colors()`.
        form: "mesh" is the trunk, whose vertices are in the frame of the body.
        size: half sizes [m] in MuJoCo's convention, shape (3,); meaningless for a mesh.
        position: position of its frame in the frame of the body [m], shape (3,).
        rotation: rotation of its frame in the frame of the body, shape (3, 3).
        collides: whether it touches the floor and objects.
    """

    name: str
    body: int
    kind: str
    form: Form
    size: Array
    position: Array
    rotation: Array
    collides: bool


def shapes(model: mujoco.MjModel, design: Design) -> list[Shape]:
    """Return the shapes of a robot, in the order of the model's geoms."""
    visible = []
    # A compiled model has no geom classes, but colours, in single precision, identify them.
    kinds = {tuple(np.array(color, np.float32)): kind for kind, color in colors().items()}
    for i in range(model.ngeom):
        form = _FORMS[int(model.geom_type[i])]
        name = model.geom(i).name
        # MuJoCo moves a mesh into its principal frame; the loft is in the frame of the body.
        moved = form == "mesh"
        visible.append(
            Shape(
                name,
                int(model.geom_bodyid[i]),
                kinds[tuple(model.geom_rgba[i])],
                form,
                model.geom_size[i].copy(),
                np.zeros(3) if moved else model.geom_pos[i].copy(),
                np.eye(3) if moved else matrix(model.geom_quat[i]),
                bool(model.geom_contype[i] or model.geom_conaffinity[i]),
            )
        )
    return visible


def matrix(quaternion: ArrayLike) -> Array:
    """Rotation matrix, shape (3, 3), of a unit quaternion (w, x, y, z)."""
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, np.asarray(quaternion, dtype=np.float64))
    return flat.reshape(3, 3)
