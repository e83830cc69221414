"""Another body in a scene: numbers of a compiled robot, without compiling the scene again."""

from __future__ import annotations

import copy

import mujoco

from draft.model.batch_text import DERIVED, FIELDS, arrays

# Numbers that a scene takes from its robot; those that follow from them are DERIVED.
_NUMBERS = {
    *FIELDS,
    *("mesh_vert", "mesh_normal", "mesh_polynormal", "mesh_pos", "mesh_quat", "bvh_aabb"),
    *("body_sameframe", "geom_sameframe", "site_sameframe", "dof_length"),
}


def swapped(
    scene: mujoco.MjModel, robot: mujoco.MjModel, other: mujoco.MjModel
) -> mujoco.MjModel | None:
    """A copy of a scene with another robot of the same topology in place of its own.

    After `mujoco.mj_setConst`, it is the model that compiling the scene with `other` gives; it
    comes in a quarter of the time. On MuJoCo 4, `stat` keeps the sizes that views go by.

    Args:
        scene: `robot` with geoms of the world added, such as a floor.
        robot: the model of that robot alone.
        other: the model of the robot to come, alone.

    Returns:
        The model; None if the robots differ in more than numbers, as by a part or by the faces of
        the trunk's mesh.
    """
    differing = {name for name in arrays() if _bytes(robot, name) != _bytes(other, name)}
    if differing - {*_NUMBERS, *DERIVED} or robot.names != other.names:
        return None
    model = copy.copy(scene)
    for name in differing & _NUMBERS:
        to, values = getattr(model, name), getattr(other, name)
        to[len(to) - len(values) :] = values  # What the world has comes first.
    model.stat.meaninertia = other.stat.meaninertia  # MuJoCo 4 does not derive it.
    return model


def _bytes(model: mujoco.MjModel, name: str) -> bytes:
    return getattr(model, name).tobytes()
