"""Many designs of one topology in one simulation: each world's model is that of its design.

The scene is compiled with the first design. Every other one is compiled alone, just as it would be
put into a scene, and all numbers in which they differ become per-world fields of mjlab's model.
What is seen is another matter: viewers draw the first design's trunk in every world, as a mesh
cannot differ between worlds here. It does not collide, and its mass and inertia are each design's
own, so physics is right. One number stays the first design's in all worlds: the mean inertia by
which the solver scales the error at which it stops, which mjlab does not hold per world.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import torch
from mjlab.managers.event_manager import RecomputeLevel, requires_model_fields

from draft.errors import DraftError, Problem
from draft.learn.config import Config
from draft.learn.lab.robot import robot

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.quadruped import Quadruped

# What designs of one topology may differ in, by whose number it is.
FIELDS = {
    "body": ("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia"),
    "joint": ("jnt_pos", "jnt_axis", "jnt_range", "jnt_actfrcrange"),
    "dof": ("dof_armature", "dof_damping", "dof_frictionloss"),
    "position": ("qpos0", "qpos_spring"),
    "geom": ("geom_size", "geom_pos", "geom_quat", "geom_rbound", "geom_aabb"),
    "site": ("site_pos", "site_quat"),
    "actuator": ("actuator_forcerange", "actuator_ctrlrange"),
}
ALL_FIELDS = tuple(name for names in FIELDS.values() for name in names)
# What mjlab works out from those once they are in place.
DERIVED = ("body_subtreemass", "body_invweight0", "dof_invweight0", "actuator_acc0")
# What may differ and does not matter: a mesh is only seen; trees of boxes and equal frames are
# short cuts of MuJoCo on the CPU; keyframes are not read, a world starts from its own tensors;
# names are compared one by one; inertia at rest serves damping ratios and lengths of degrees of
# freedom serve sleeping bodies, and there are neither.
IDLE = (
    *("mesh_", "bvh_", "key_", "name"),
    *("body_sameframe", "geom_sameframe", "site_sameframe"),
    *("dof_M0", "dof_length"),
)


@requires_model_fields(*ALL_FIELDS, recompute=RecomputeLevel.set_const)
def assume_designs(env: ManagerBasedRlEnv, env_ids: Any, config: Config) -> None:
    """Give every world the model of its design; the first event, as others add to it.

    Args:
        env: the environment.
        env_ids: not used, a design is for all worlds and for good.
        config: the numbers.

    Raises:
        DraftError: a design differs in what one simulation cannot hold.
    """
    entity, sim = env.scene["robot"], env.sim
    models = compiled(entity.cfg.members, config)
    prefix = f"{entity.root_body.name.rpartition('/')[0]}/"
    here, there = rows(models[0], models[0]), rows(sim.mj_model, models[0], prefix)
    # A mesh stays the first design's, with the frame and box that belong to it.
    solid = models[0].geom_type[here["geom"]] != mujoco.mjtGeom.mjGEOM_MESH
    here["geom"], there["geom"] = here["geom"][solid], there["geom"][solid]
    for kind, names in FIELDS.items():
        ids = torch.from_numpy(there[kind]).to(env.device)
        for name in names:
            field = getattr(sim.model, name)
            each = np.stack([getattr(model, name)[here[kind]] for model in models])
            values = torch.from_numpy(each).to(env.device, field.dtype)[entity.member]
            field[:, ids] = values.reshape(field[:, ids].shape)
            # mjlab's own randomisation scales and shifts these, not the first design's.
            sim.default_model_fields[name] = field.clone()
            sim.per_world_default_fields.add(name)


def compiled(members: tuple[Quadruped, ...], config: Config) -> list[Any]:
    """MuJoCo models of robots alone, with the actuators and colliding geoms of the scene.

    Args:
        members: the designs.
        config: the numbers.

    Raises:
        DraftError: a design differs in what one simulation cannot hold.
    """
    models = [robot((member,), config).build().compile() for member in members]
    first = models[0]
    colliding = (first.geom_contype | first.geom_conaffinity) != 0
    meshes = first.geom_type == mujoco.mjtGeom.mjGEOM_MESH
    if np.any(colliding & meshes):
        geom = first.geom(int(np.flatnonzero(colliding & meshes)[0])).name
        raise _refused(f"'{geom}' of {members[0].name} is a mesh that collides")
    for member, model in zip(members[1:], models[1:], strict=True):
        others = differing(first, model) - set(ALL_FIELDS) - set(DERIVED)
        if others:
            cause = f"{member.name} differs from {members[0].name} in {', '.join(sorted(others))}"
            raise _refused(cause)
    return models


def differing(first: Any, other: Any) -> set[str]:
    """Names of the arrays that differ between two models, without those of IDLE."""
    found = set()
    for name in dir(first):
        if name.startswith(("_", *IDLE)):
            continue
        value = getattr(first, name)
        if isinstance(value, np.ndarray) and not np.array_equal(value, getattr(other, name)):
            found.add(name)
    return found | ({"names"} if _names(first) != _names(other) else set())


def _names(model: Any) -> list[list[str]]:
    """Names of what has numbers of its own."""
    kinds = {"body": model.nbody, "joint": model.njnt, "geom": model.ngeom}
    kinds |= {"site": model.nsite, "actuator": model.nu}
    return [[getattr(model, kind)(i).name for i in range(n)] for kind, n in kinds.items()]


def rows(model: Any, robot: Any, prefix: str = "") -> dict[str, np.ndarray]:
    """Where a robot's numbers stand in a model, for each kind of FIELDS, in the robot's order.

    Args:
        model: a model with the robot in it.
        robot: the model of the robot alone.
        prefix: what stands before its names in `model`.
    """
    joints = [model.joint(prefix + robot.joint(i).name) for i in range(robot.njnt)]
    found = {
        "body": [model.body(prefix + robot.body(i).name).id for i in range(1, robot.nbody)],
        "joint": [joint.id for joint in joints],
        "dof": [int(joint.dofadr[0]) + k for joint in joints for k in range(joint.damping.size)],
        "position": [
            int(joint.qposadr[0]) + k for joint in joints for k in range(joint.qpos0.size)
        ],
        "geom": [model.geom(prefix + robot.geom(i).name).id for i in range(robot.ngeom)],
        "site": [model.site(prefix + robot.site(i).name).id for i in range(robot.nsite)],
        "actuator": [model.actuator(prefix + robot.actuator(i).name).id for i in range(robot.nu)],
    }
    return {kind: np.asarray(ids, dtype=np.int64) for kind, ids in found.items()}


def _refused(cause: str) -> DraftError:
    remedy = "a family varies sizes, masses and drives of one tree; train them apart"
    return DraftError(Problem(f"one simulation cannot hold this family: {cause}", None, remedy))
