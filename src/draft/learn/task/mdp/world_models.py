"""Many designs of one topology in one simulation: each world's model is that of its design.

The scene is compiled with the first design. The numbers in which the others differ are compiled by
arrays (`draft.model.batch_text`) and become per-world fields of mjlab's model, so that worlds can
also be given other designs while a simulation runs. Viewers draw the first design's trunk in every
world, as meshes cannot differ between worlds; physics is right, as the mesh does not collide and
mass and inertia are those of each design. One number is that of the first design in all worlds: the
mean inertia that scales the solver's stopping criterion, which mjlab does not hold per world.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import torch
from mjlab.managers.event_manager import RecomputeLevel, requires_model_fields

from draft.errors import DraftError, counted
from draft.learn.bodies.family_fields import family_fields
from draft.learn.bodies.legged import check_family
from draft.learn.task.world.access import robot_of
from draft.model.batch import indices, kind_of
from draft.model.batch_text import FIELDS as OF_ROBOTS

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.bodies.legged import LeggedRobot

ACTUATOR_FIELDS = ("actuator_forcerange", "actuator_ctrlrange")
# Fields in which designs of one topology may differ; none of those that learn has joints that
# follow others.
ROBOT_FIELDS = tuple(name for name in OF_ROBOTS if not name.startswith("eq_"))
FIELDS = (*ROBOT_FIELDS, *ACTUATOR_FIELDS)
_CENTRE = "body_ipos"


@requires_model_fields(*FIELDS, recompute=RecomputeLevel.set_const)
def assume_designs(env: ManagerBasedRlEnv, env_ids: torch.Tensor | None) -> None:
    """Give every world the model of its design; must be the first event, as others change it.

    Args:
        env: the environment.
        env_ids: ignored: designs are for all worlds, and stay.

    Raises:
        DraftError: a design differs in a field that one simulation cannot hold.
    """
    robot = robot_of(env)
    _check_meshes(env)
    _write(env, robot.cfg.members, torch.arange(env.num_envs, device=env.device), robot.member)


def redraw(env: ManagerBasedRlEnv, worlds: torch.Tensor, members: Sequence[LeggedRobot]) -> None:
    """Give some worlds other designs, without a compile of the scene; reset these worlds after it.

    Friction that was drawn for a world stays, and so does the shift of the trunk's centre of mass
    per leg length; inertia errors do not. `Robot.member` still tells which design a world began
    with.

    Args:
        env: the environment of a family, on any engine.
        worlds: indices of the worlds, each once, shape (k,).
        members: their designs, k quadrupeds of the family's topology.

    Raises:
        DraftError: the environment holds one design; the numbers of worlds and designs differ; or
            a design has another topology than the family.
    """
    robot = robot_of(env)
    first = robot.cfg.members[0]
    if not set(FIELDS) <= set(env.sim.expanded_fields):
        cause = f"the simulation holds one design, {first.name}, in all worlds"
        raise DraftError(cause, "make it with two designs or more")
    if len(members) != len(worlds):
        raise DraftError(
            f"{counted(len(members), 'design')} cannot fill {counted(len(worlds), 'world')}"
        )
    if not members:
        return
    check_family([first, *members])
    model: Any = env.sim.model  # mjlab's bridge of Warp arrays has no types.
    shift = model.body_ipos[worlds] - env.sim.default_model_fields[_CENTRE][worlds]
    scales = torch.tensor([member.scale for member in members], device=env.device)
    shift = shift * (scales / robot.leg_scale[worlds])[:, None, None]
    # The scene has the meshes of the first design, from which the numbers are found.
    places = torch.arange(1, len(members) + 1, device=env.device)
    _write(env, (first, *members), worlds, places)
    model.body_ipos[worlds] = model.body_ipos[worlds] + shift
    env.sim.recompute_constants(RecomputeLevel.set_const)
    robot.assume(worlds, members)
    for term in _terms(env):
        if hasattr(term, "rescale"):
            term.rescale()


def _terms(env: ManagerBasedRlEnv) -> list[Any]:
    """Commands, actions and events that may hold numbers of the designs."""
    events = env.event_manager
    held: list[Any] = [
        manager.get_term(name)
        for manager in (env.command_manager, env.action_manager)
        for name in manager.active_terms
    ]
    for names in events.active_terms.values():
        held += [events.get_term_cfg(name).func for name in names]
    return held


def _write(
    env: ManagerBasedRlEnv,
    members: Sequence[LeggedRobot],
    worlds: torch.Tensor,
    places: torch.Tensor,
) -> None:
    """Write the numbers of designs into the models of worlds.

    Args:
        env: the environment.
        members: the designs; the scene was compiled with the first.
        worlds: indices of the worlds, shape (k,).
        places: index of the design of each, shape (k,).
    """
    sim = env.sim
    prefix = f"{robot_of(env).root_body.name.rpartition('/')[0]}/"
    try:
        first, fields = family_fields(tuple(members))
    except DraftError as error:
        raise _refused(error.problems[0].cause) from None
    ids = indices(first, sim.mj_model, prefix)
    # Meshes stay those of the first design, with their frames and boxes.
    solid = first.geom_type[ids["own geom"]] != mujoco.mjtGeom.mjGEOM_MESH
    for key in ("geom", "own geom"):
        ids[key] = ids[key][solid]
    for name in ROBOT_FIELDS:
        kind = kind_of(name)
        own = fields[name] if name in fields else np.asarray(getattr(first, name))[None]
        each = np.broadcast_to(own, (len(members), *own.shape[1:]))[:, ids[f"own {kind}"]]
        _put(sim, name, ids[kind], worlds, each, places)
    actuators = np.array([sim.mj_model.actuator(prefix + name).id for name in members[0].joints])
    torque = np.array([member.peak_torque for member in members])
    for name in ACTUATOR_FIELDS:
        _put(sim, name, actuators, worlds, np.stack((-torque, torque), axis=-1), places)


def _put(
    sim: Any,
    name: str,
    ids: np.ndarray,
    worlds: torch.Tensor,
    each: np.ndarray,
    places: torch.Tensor,
) -> None:
    """Write a field of some elements in some worlds, now and as the default.

    mjlab's own randomisation starts from the default.
    """
    field = getattr(sim.model, name)
    device = worlds.device
    values = torch.from_numpy(np.ascontiguousarray(each)).to(device, field.dtype)[places]
    at = (worlds[:, None], torch.from_numpy(ids).to(device)[None, :])
    values = values.reshape(field[at].shape)
    field[at] = values
    if name not in sim.per_world_default_fields:
        sim.default_model_fields[name] = field.clone()
        sim.per_world_default_fields.add(name)
    sim.default_model_fields[name][at] = values


def _check_meshes(env: ManagerBasedRlEnv) -> None:
    """Check that no mesh of the robot collides: all worlds have that of the first design."""
    robot, scene = robot_of(env), env.sim.mj_model
    # By the tree: the indices that mjlab keeps are a tensor of the device.
    own = scene.body_rootid[scene.geom_bodyid] == scene.body(robot.root_body.name).rootid
    for i in np.flatnonzero(own):
        colliding = scene.geom_contype[i] or scene.geom_conaffinity[i]
        if colliding and scene.geom_type[i] == mujoco.mjtGeom.mjGEOM_MESH:
            name = scene.geom(i).name.rpartition("/")[2]
            raise _refused(f"'{name}' of {robot.cfg.members[0].name} is a mesh that collides")


def _refused(cause: str) -> DraftError:
    remedy = "train them separately; a family may vary sizes, masses and drives of one tree"
    return DraftError(f"one simulation cannot hold this family: {cause}", remedy)
