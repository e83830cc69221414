"""What a foot feels like to the floor, by M(q) of the compiled model in the crouch.

The robot floats, its joints are free, rotors count (MuJoCo's armature), and no force but the
impact acts. The apparent mass of a foot along a direction n is 1 / (n J M^-1 J' n) (Khatib 1987).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from draft.design.cached import once
from draft.design.legs import legs
from draft.metrics.registry import metric
from draft.values import Array

if TYPE_CHECKING:
    from draft.model import Model

_WENSING = "Wensing et al. 2017, IEEE T-RO 33(3), doi 10.1109/TRO.2016.2640183"
BASE = 6  # degrees of freedom of the floating base, which come first


@metric(
    unit="kg",
    formula="max over feet of 1 / (J_z M^-1 J_z') in the crouch, joints free",
    source=f"Khatib 1987, IEEE J-RA 3(1); {_WENSING}",
    better="less",
    needs="model",
)
def foot_inertia(model: Model) -> float:
    """Apparent mass of a foot along the vertical, rotors included [kg]."""
    return max((free for free, _ in apparent_masses(model).values()), default=math.nan)


@metric(
    unit="1",
    formula="min over feet of 1 - lambda_free / lambda_locked, vertical apparent masses",
    source=_WENSING,
    better="more",
    needs="model",
)
def impact_mitigation(model: Model) -> float:
    """Share of a vertical impact that yielding joints keep away [1].

    The impact mitigation factor in the crouch; of all feet the smallest.
    1 - lambda_free / lambda_locked: the share of an impact's impulse that the legs keep from the
    body because their joints give way. 0 with infinite rotors. Wensing's factor over all directions
    is det(I - Lambda_free Lambda_locked^-1); this is the same for one, the vertical.
    """
    pairs = apparent_masses(model).values()
    return min((1.0 - free / locked for free, locked in pairs), default=math.nan)


@metric(
    unit="1",
    formula="sum of N^2 J / trace of M(q) over the legs' driven joints, in the crouch",
    source=_WENSING,
    better="less",
    needs="model",
)
def reflected_share(model: Model) -> float:
    """Share of the rotors in the joint-space inertia of the legs [1]."""
    inertia, _ = inertia_and_rows(model)
    dofs = [
        int(model.mujoco.joint(name).dofadr[0])
        for leg in legs(model.design)
        for joint in leg.joints
        if joint.actuator is not None
        for name in joint.names
    ]
    if not dofs:
        return math.nan
    return float(model.mujoco.dof_armature[dofs].sum() / np.trace(inertia[np.ix_(dofs, dofs)]))


@once
def apparent_masses(model: Model) -> dict[str, tuple[float, float]]:
    """Apparent vertical mass of every foot [kg], joints free and joints locked, by body."""
    inertia, rows = inertia_and_rows(model)
    base = inertia[:BASE, :BASE]
    return {
        name: (
            float(1.0 / (row @ np.linalg.solve(inertia, row))),
            float(1.0 / (row[:BASE] @ np.linalg.solve(base, row[:BASE]))),
        )
        for name, row in rows.items()
    }


@once
def inertia_and_rows(model: Model) -> tuple[Array, dict[str, Array]]:
    """M(q) in the crouch, shape (nv, nv), and of every foot dz/dq, shape (nv,), by body.

    A foot is a point: the end of the leg's last link.
    """
    import mujoco

    robot, design = model.mujoco, model.design
    data = mujoco.MjData(robot)
    data.qpos[:] = 0.0
    data.qpos[3] = 1.0
    for leg in legs(design):
        for joint in leg.joints:
            for name in joint.names:
                data.qpos[robot.joint(name).qposadr[0]] = joint.angle
    mujoco.mj_forward(robot, data)
    inertia = np.empty((robot.nv, robot.nv))
    mujoco.mj_fullM(robot, data, inertia)
    rows: dict[str, Array] = {}
    jacobian = np.empty((3, robot.nv))
    for leg in legs(design):
        for foot in leg.feet:
            body = design.bodies[foot]
            here = robot.body(body.name).id
            tip = np.array(body.link.tip, dtype=float)
            point = data.xpos[here] + data.xmat[here].reshape(3, 3) @ tip
            mujoco.mj_jac(robot, data, jacobian, None, point, here)
            rows[body.name] = jacobian[2].copy()
    return inertia, rows
