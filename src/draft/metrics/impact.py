"""Impact metrics of a foot or a tip, from the joint-space inertia M(q) of models.

A robot on feet is in the crouch and floats, an arm or a hand is at home. Joints are free, rotor
inertia is included (MuJoCo's armature), and no force but that of the impact acts. The apparent mass
along a direction n is 1 / (n J M^-1 J' n) (Khatib 1987).

For a batch of models MuJoCo computes M(q) one after another (10 microseconds each); the linear
algebra is done for all at once.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from draft.design.cached import once
from draft.design.legs import crouch, legs
from draft.design.limbs import limbs
from draft.geometry import Vector
from draft.metrics.registry import metric
from draft.metrics.tips import directions, outer_columns
from draft.values import Array, Value, scalar

if TYPE_CHECKING:
    import mujoco

    from draft.model import Model
    from draft.model.batch import ModelBatch

_WENSING = "Wensing et al. 2017, IEEE T-RO 33(3), doi 10.1109/TRO.2016.2640183"
BASE = 6  # degrees of freedom of the floating base, which come first


@metric(
    unit="kg",
    formula="max over feet of 1 / (J_z M^-1 J_z') in the crouch, joints free",
    source=f"Khatib 1987, IEEE J-RA 3(1); {_WENSING}",
    better="less",
    needs="model",
    batch=True,
    base="floating",
)
def foot_inertia(model: Model | ModelBatch) -> Value:
    """Apparent mass of a foot along the vertical, rotors included [kg]."""
    return _extreme(np.maximum, [free for free, _ in apparent_masses(model).values()], model)


@metric(
    unit="1",
    formula="min over feet of 1 - lambda_free / lambda_locked, vertical apparent masses",
    source=_WENSING,
    better="more",
    needs="model",
    batch=True,
    base="floating",
)
def impact_mitigation(model: Model | ModelBatch) -> Value:
    """Vertical impact mitigation factor, the smallest of all feet [1].

    1 - lambda_free / lambda_locked in the crouch: the share of the impulse of a vertical impact
    that the motion of the joints keeps from the body; 0 for infinite rotor inertia. Wensing's
    factor over all directions is det(I - Lambda_free Lambda_locked^-1); this is the same for the
    vertical alone.
    """
    pairs = apparent_masses(model).values()
    return _extreme(np.minimum, [1.0 - free / locked for free, locked in pairs], model)


@metric(
    unit="1",
    formula="sum of N^2 J / trace of M(q) over the legs' driven joints, in the crouch",
    source=_WENSING,
    better="less",
    needs="model",
    batch=True,
    base="floating",
)
def reflected_share(model: Model | ModelBatch) -> Value:
    """Share of rotor inertia in the joint-space inertia of the legs [1]."""
    found = crouch_inertia(model)
    robot = _template(model)
    dofs = [
        int(robot.joint(name).dofadr[0])
        for leg in legs(model.design)
        for joint in leg.joints
        if joint.actuator is not None
        for name in joint.names
    ]
    if not dofs:
        return _extreme(np.maximum, [], model)
    share = found.armature[:, dofs].sum(axis=1) / found.inertia[:, dofs, dofs].sum(axis=1)
    return _extreme(np.maximum, [share], model)


@metric(
    unit="kg",
    formula="max over directions u of 1 / (u J M^-1 J' u) at home, over those in which the tip "
    "can move",
    source="Khatib 1995, IJRR 14(1)",
    better="less",
    needs="model",
    batch=True,
    base="arm or hand",
)
def reflected_mass(model: Model | ModelBatch) -> Value:
    """Largest apparent mass of the tip in the home pose, rotors included [kg].

    Joints that are not of the limb are held. Of several fingers the heaviest counts.
    """
    design, robot = model.design, _template(model)
    outer = limbs(design).outer
    homes = {name: joint.home for name, joint in design.joints.items()}
    points = [(design.bodies[limb.path[-1]].name, limb.point) for limb in outer]
    found = pose_inertia(model, homes, points)
    masses: list[Array] = []
    for i, columns in enumerate(outer_columns(design)):
        dofs = [int(robot.joint(x.name).dofadr[0]) for x in columns]
        inertia, rows = found.inertia[:, dofs][:, :, dofs], found.jacobians[:, i][:, :, dofs]
        mobility = rows @ np.linalg.solve(inertia, rows.swapaxes(1, 2))
        # Ascending eigenvalues; those of directions in which it cannot move come first.
        least = np.linalg.eigvalsh(mobility)[:, 3 - directions(columns)]
        masses.append(np.asarray(1.0 / least, np.float64))
    return _extreme(np.maximum, masses, model)


def _many(model: Model | ModelBatch) -> ModelBatch | None:
    """A batch of models; None for one model. No type is asked for: that would load MuJoCo."""
    return None if model.design.count is None else cast("ModelBatch", model)


def _count(model: Model | ModelBatch) -> int:
    batch = _many(model)
    return 1 if batch is None else len(batch)


def _extreme(
    choose: Callable[[Any, Any], Any], values: list[Array], model: Model | ModelBatch
) -> Value:
    """Largest or smallest of values of shape (models,), as a float of one model; NaN of none."""
    found = functools.reduce(choose, values) if values else np.full(_count(model), math.nan)
    return float(found[0]) if _many(model) is None else found


class CrouchInertia(NamedTuple):
    """Inertia of one or more models in the crouch.

    Attributes:
        inertia: M(q), shape (models, nv, nv).
        rows: dz/dq of every foot by its body, shape (models, nv). A foot is a point: the end of
            the leg's last link.
        armature: of every degree of freedom, shape (models, nv).
    """

    inertia: Array
    rows: dict[str, Array]
    armature: Array


@once
def apparent_masses(model: Model | ModelBatch) -> dict[str, tuple[Array, Array]]:
    """Apparent vertical mass of every foot [kg], joints free and joints locked, by body.

    Returns:
        Two arrays of shape (models,) for each.
    """
    found = crouch_inertia(model)
    if not found.rows:
        return {}
    rows = np.stack(list(found.rows.values()), axis=1)
    free = _apparent(found.inertia, rows)
    locked = _apparent(found.inertia[:, :BASE, :BASE], rows[:, :, :BASE])
    return {name: (free[:, i], locked[:, i]) for i, name in enumerate(found.rows)}


def _apparent(inertia: Array, rows: Array) -> Array:
    """1 / (J M^-1 J') of rows J, shape (models, feet, nv)."""
    solved = np.linalg.solve(inertia, rows.swapaxes(1, 2)).swapaxes(1, 2)
    return 1.0 / (rows * solved).sum(axis=2)


@once
def crouch_inertia(model: Model | ModelBatch) -> CrouchInertia:
    """M(q) and the vertical motion of the feet in the crouch."""
    design = model.design
    feet = [design.bodies[foot] for leg in legs(design) for foot in leg.feet]
    found = pose_inertia(model, crouch(design), [(body.name, body.link.tip) for body in feet])
    rows = {body.name: found.jacobians[:, i, 2] for i, body in enumerate(feet)}
    return CrouchInertia(found.inertia, rows, found.armature)


class PoseInertia(NamedTuple):
    """Inertia of one or more models in a pose.

    Attributes:
        inertia: M(q), shape (models, nv, nv).
        jacobians: dx/dq of points in the world, shape (models, points, 3, nv).
        armature: of every degree of freedom, shape (models, nv).
    """

    inertia: Array
    jacobians: Array
    armature: Array


def pose_inertia(
    model: Model | ModelBatch, angles: Mapping[str, Value], points: Sequence[tuple[str, Vector]]
) -> PoseInertia:
    """M(q) and the motion of points in a pose.

    Args:
        model: one model, or a batch.
        angles: angles by joint [rad]; others are zero.
        points: name of the body of each point, and its place in the frame of that body [m].
    """
    import mujoco

    robot = copy.copy(_template(model))
    data = mujoco.MjData(robot)
    data.qpos[:] = 0.0
    if model.design.floating:
        data.qpos[3] = 1.0
    n = _count(model)
    joints = np.array([int(robot.joint(name).qposadr[0]) for name in angles], dtype=np.intp)
    poses = np.empty((n, len(angles)))
    for i, angle in enumerate(angles.values()):
        poses[:, i] = _each(model, angle)
    tips = np.empty((n, len(points), 3))
    for i, (_, point) in enumerate(points):
        for k, value in enumerate(point):
            tips[:, i, k] = _each(model, value)
    ids = [robot.body(name).id for name, _ in points]
    inertia = np.empty((n, robot.nv, robot.nv))
    jacobians, armature = np.empty((n, len(ids), 3, robot.nv)), np.empty((n, robot.nv))
    numbers = _numbers(model, robot)
    places, turns = data.xpos, data.xmat.reshape(-1, 3, 3)
    for k in range(n):
        for view, values in numbers:
            view[:] = values[k]
        data.qpos[joints] = poses[k]
        mujoco.mj_kinematics(robot, data)
        mujoco.mj_comPos(robot, data)
        mujoco.mj_makeM(robot, data)
        mujoco.mj_fullM(robot, data, inertia[k])
        armature[k] = robot.dof_armature
        for i, here in enumerate(ids):
            point = places[here] + turns[here] @ tips[k, i]
            mujoco.mj_jac(robot, data, jacobians[k, i], None, point, here)
    return _coupled(model, robot, PoseInertia(inertia, jacobians, armature))


def _coupled(model: Model | ModelBatch, robot: mujoco.MjModel, found: PoseInertia) -> PoseInertia:
    """Inertia with the joints that follow others: M' = G' M G and J' = J G for v = G v'.

    Joints that follow are degrees of freedom of their own with unit inertia that move nothing.
    """
    inertia, jacobians, armature = found
    motion = np.tile(np.eye(robot.nv), (len(inertia), 1, 1))
    followers: list[int] = []
    for name, joint in model.design.joints.items():
        if (follows := joint.follows) is None:
            continue
        dof, leader = (int(robot.joint(x).dofadr[0]) for x in (name, follows.joint))
        ratio = _each(model, follows.ratio)
        followers.append(dof)
        motion[:, dof, dof], motion[:, dof, leader] = 0.0, ratio
        armature[:, leader] += ratio**2 * armature[:, dof]
        armature[:, dof] = 0.0
    if not followers:
        return found
    inertia = motion.swapaxes(1, 2) @ inertia @ motion
    inertia[:, followers, followers] = 1.0
    return PoseInertia(inertia, jacobians @ motion[:, None], armature)


def _template(model: Model | ModelBatch) -> mujoco.MjModel:
    batch = _many(model)
    return cast("Model", model).mujoco if batch is None else batch.template


def _numbers(model: Model | ModelBatch, robot: mujoco.MjModel) -> list[tuple[Array, Array]]:
    """Arrays of the robot that M(q) depends on, and their values for every model of a batch.

    The trunk is put in its place, and geoms do not matter.
    """
    batch = _many(model)
    if batch is None:
        return []
    read = [f for f in batch.fields if f.startswith(("body_", "jnt_axis", "dof_armature"))]
    numbers = [(getattr(robot, name), batch.fields[name]) for name in read]
    # MuJoCo takes moments about the centre of mass, which it scales by this.
    below = batch.field("body_mass").copy()
    for body in range(robot.nbody - 1, 0, -1):
        below[:, robot.body_parentid[body]] += below[:, body]
    return [*numbers, (robot.body_subtreemass, below)]


def _each(model: Model | ModelBatch, value: Value) -> Array:
    """A number of the design for every model, shape (models,)."""
    batch = _many(model)
    if batch is None:
        return np.array([scalar(value)])
    return np.broadcast_to(value, (model.design.count or 1,))[batch.rows]
