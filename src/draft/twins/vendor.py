"""A vendor's robot as a MuJoCo model of its own masses: what a twin is held against.

It is made from what the file says of links and joints, not by MuJoCo's own readers, so that
missing meshes, closed loops and inertias that no solid can have do not stand in the way.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import mujoco
import numpy as np

from draft.description.description import Description, Inertial
from draft.description.rigid import combined, moved
from draft.imports.reduce import Body, Pose, rigid_bodies
from draft.values import Array

BASE = "vendor_base"
FLOATING = "vendor_floating_base"


def body_name(link: str) -> str:
    """Name in the model of the body whose first link this is; the base's is `BASE`."""
    return f"body {link}"


def rigid(description: Description, links: Iterable[str], poses: dict[str, Pose]) -> Inertial:
    """Mass properties of links as one rigid body, in the frame that `poses` are given in."""
    parts: list[Inertial] = []
    for name in links:
        inertial = description.links[name].inertial
        if inertial is not None:
            position, rotation = poses[name]
            at: Any = tuple(map(float, position))
            turn: Any = tuple(tuple(map(float, row)) for row in rotation)
            parts.append(moved(inertial, at, turn))
    return combined(parts)


def vendor_model(description: Description, joints: Collection[str]) -> mujoco.MjModel:
    """Model of a description with the named joints and no others, on a floating base.

    All bodies have the axes of the root link in the zero pose; there is no armature, damping or
    friction. Joints are named as the file names them.
    """
    spec, root, poses = vendor_spec(description, joints)
    model = spec.compile()
    for body in root.all():
        index = BASE if body.parent is None else body_name(body.name)
        _set_inertia(model, model.body(index).id, rigid(description, body.links, poses), body)
    _set_subtree_masses(model)
    return model


def vendor_spec(
    description: Description, joints: Collection[str]
) -> tuple[mujoco.MjSpec, Body, dict[str, Pose]]:
    """Tree of a description with the named hinges, every body of unit mass, without shapes.

    Returns:
        The tree, its rigid bodies from the root, and the frame of every link in the root link's.
    """
    held = {joint.name for joint in description.moving} - set(joints)
    root, poses = rigid_bodies(description, held)
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    made: dict[Body, Any] = {}
    for body in root.all():
        if body.parent is None:
            own = spec.worldbody.add_body(name=BASE)
            own.add_freejoint(name=FLOATING)
        else:
            place = body.anchor - body.parent.anchor
            own = made[body.parent].add_body(name=body_name(body.name), pos=place)
            assert body.joint is not None
            kind = mujoco.mjtJoint.mjJNT_SLIDE if body.slides else mujoco.mjtJoint.mjJNT_HINGE
            own.add_joint(name=body.joint.name, axis=body.axis, type=kind)
        own.explicitinertial = True
        own.mass, own.inertia = 1.0, np.ones(3)
        made[body] = own
    return spec, root, poses


def _set_inertia(model: Any, i: int, inertial: Inertial, body: Body) -> None:
    """Give a compiled body its mass and inertia; MuJoCo's reader refuses some that files have."""
    moments, axes = np.linalg.eigh(np.array(inertial.inertia))
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, axes.ravel())
    model.body_mass[i] = inertial.mass
    model.body_ipos[i] = np.array(inertial.com) - body.anchor
    model.body_inertia[i] = moments
    model.body_iquat[i] = quat
    model.body_sameframe[i] = 0


def _set_subtree_masses(model: Any) -> None:
    total: Array = model.body_mass.copy()
    for i in range(model.nbody - 1, 0, -1):
        total[model.body_parentid[i]] += total[i]
    model.body_subtreemass[:] = total
