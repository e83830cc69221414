"""Many designs of one topology in one simulation: each world's model is that of its design.

The scene is compiled with the first design. Every other design is compiled alone, as it would be
in a scene, and all numbers in which they differ become per-world fields of mjlab's model. Viewers
draw the first design's trunk in every world, as meshes cannot differ between worlds; physics is
right, as the mesh does not collide and mass and inertia are those of each design. One number is
that of the first design in all worlds: the mean inertia that scales the solver's stopping
criterion, which mjlab does not hold per world.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np
import torch
from mjlab.managers.event_manager import RecomputeLevel, requires_model_fields

from draft.errors import DraftError, Problem
from draft.learn.config import Config
from draft.learn.lab.mdp.access import robot_of
from draft.learn.lab.robot import robot

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.quadruped import Quadruped

# Fields in which designs of one topology may differ, by kind of element.
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
# Fields that mjlab computes from those.
DERIVED = ("body_subtreemass", "body_invweight0", "dof_invweight0", "actuator_acc0")
# Fields that may differ without effect: meshes are only drawn; bounding volumes and equal frames
# are shortcuts of MuJoCo on the CPU; keyframes are not read, as a world starts from its own
# tensors; names are compared one by one; inertia at rest is for damping ratios, and lengths of
# degrees of freedom are for sleeping bodies, and there are neither.
UNUSED = (
    *("mesh_", "bvh_", "key_", "name"),
    *("body_sameframe", "geom_sameframe", "site_sameframe"),
    *("dof_M0", "dof_length"),
)


@requires_model_fields(*ALL_FIELDS, recompute=RecomputeLevel.set_const)
def assume_designs(env: ManagerBasedRlEnv, env_ids: torch.Tensor | None, config: Config) -> None:
    """Give every world the model of its design; must be the first event, as others change it.

    Args:
        env: the environment.
        env_ids: ignored: designs are for all worlds, and stay.
        config: the numbers.

    Raises:
        DraftError: a design differs in a field that one simulation cannot hold.
    """
    entity, sim = robot_of(env), env.sim
    models = compiled(entity.cfg.members, config)
    prefix = f"{entity.root_body.name.rpartition('/')[0]}/"
    here, there = rows(models[0], models[0]), rows(sim.mj_model, models[0], prefix)
    # Meshes stay those of the first design, with their frames and boxes.
    solid = models[0].geom_type[here["geom"]] != mujoco.mjtGeom.mjGEOM_MESH
    here["geom"], there["geom"] = here["geom"][solid], there["geom"][solid]
    for kind, names in FIELDS.items():
        ids = torch.from_numpy(there[kind]).to(env.device)
        for name in names:
            field = getattr(sim.model, name)
            each = np.stack([getattr(model, name)[here[kind]] for model in models])
            values = torch.from_numpy(each).to(env.device, field.dtype)[entity.member]
            field[:, ids] = values.reshape(field[:, ids].shape)
            # mjlab's own randomisation starts from these, not from the first design's.
            sim.default_model_fields[name] = field.clone()
            sim.per_world_default_fields.add(name)


def compiled(members: tuple[Quadruped, ...], config: Config) -> list[mujoco.MjModel]:
    """Compile each robot alone, with the actuators and colliding geoms of the scene.

    Args:
        members: the designs.
        config: the numbers.

    Raises:
        DraftError: a design differs in a field that one simulation cannot hold.
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


def differing(first: mujoco.MjModel, other: mujoco.MjModel) -> set[str]:
    """Names of the arrays that differ between two models, without those of UNUSED."""
    names = set()
    for name in dir(first):
        if name.startswith(("_", *UNUSED)):
            continue
        value = getattr(first, name)
        if isinstance(value, np.ndarray) and not np.array_equal(value, getattr(other, name)):
            names.add(name)
    return names | ({"names"} if _names(first) != _names(other) else set())


def _names(model: mujoco.MjModel) -> list[list[str]]:
    """Names of the elements of each kind."""
    kinds = {"body": model.nbody, "joint": model.njnt, "geom": model.ngeom}
    kinds |= {"site": model.nsite, "actuator": model.nu}
    return [[getattr(model, kind)(i).name for i in range(n)] for kind, n in kinds.items()]


def rows(model: mujoco.MjModel, robot: mujoco.MjModel, prefix: str = "") -> dict[str, np.ndarray]:
    """Indices of a robot's elements in a model, for each kind of FIELDS, in the robot's order.

    Args:
        model: a model with the robot in it.
        robot: model of the robot alone.
        prefix: prefix of its names in `model`.
    """
    joints = [model.joint(prefix + robot.joint(i).name) for i in range(robot.njnt)]
    indices = {
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
    return {kind: np.asarray(ids, dtype=np.int64) for kind, ids in indices.items()}


def _refused(cause: str) -> DraftError:
    remedy = "train them separately; a family may vary sizes, masses and drives of one tree"
    return DraftError(Problem(f"one simulation cannot hold this family: {cause}", None, remedy))
