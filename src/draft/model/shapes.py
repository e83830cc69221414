"""The drawn shapes of a compiled model, each in its body's frame, for whatever draws them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import mujoco
import numpy as np

from draft.design.design import Design
from draft.model.mjcf import COLORS
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
    """One shape.

    Attributes:
        name: name of its geom.
        body: index of its body in the compiled model.
        kind: what it is of the robot, a key of `draft.model.mjcf.COLORS`.
        form: "mesh" is the trunk, whose vertices are in the body's frame already.
        size: half sizes [m] as MuJoCo counts them; none of a mesh's.
        position: of its frame in the body's [m], shape (3,).
        rotation: of its frame in the body's, shape (3, 3).
        collides: whether it meets the floor and objects.
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
    """Shapes of a robot, in the order of the model's geoms."""
    found = []
    trunk = design.bodies[0].name + design.trunk.suffix
    # MuJoCo keeps no classes of geoms; their colours, in single precision, are one to one.
    colors = {tuple(np.array(color, np.float32)): kind for kind, color in COLORS.items()}
    for i in range(model.ngeom):
        form = _FORMS[int(model.geom_type[i])]
        name = model.geom(i).name
        # MuJoCo moves a mesh into its principal frame; the loft is drawn as it was given.
        moved = name == trunk
        found.append(
            Shape(
                name,
                int(model.geom_bodyid[i]),
                colors[tuple(model.geom_rgba[i])],
                form,
                model.geom_size[i].copy(),
                np.zeros(3) if moved else model.geom_pos[i].copy(),
                np.eye(3) if moved else matrix(model.geom_quat[i]),
                bool(model.geom_contype[i] or model.geom_conaffinity[i]),
            )
        )
    return found


def matrix(quaternion: Any) -> Array:
    """Rotation matrix, shape (3, 3), of a unit quaternion (w, x, y, z)."""
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, np.asarray(quaternion, dtype=np.float64))
    return flat.reshape(3, 3)
