"""Mass, centre and spread of every rigid body of a vendor's robot beside those of its twin.

All is in the trunk's frame, with every joint at zero.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.description.description import Inertial
from draft.description.rigid import combined, moved
from draft.imports.reduce import Body, Reduced
from draft.twins.vendor import rigid
from draft.values import Array, scalar

TRUNK = "trunk"
OTHER = "other"


@dataclass(frozen=True, slots=True)
class Side:
    """Mass [kg], centre of mass [m], shape (3,), and radius of gyration about it [m].

    The radius is the root mean square distance of the mass from its centre, sqrt(tr(I) / 2m).
    """

    mass: float
    com: Array
    gyration: float


@dataclass(frozen=True, slots=True)
class Pair:
    """One rigid body on both sides.

    Attributes:
        name: its first link, as the vendor calls it.
        joint: hinge above it, as the vendor calls it; "" for the trunk.
        group: class of its segment: "trunk", "thigh", ...; "other" where it has none.
        outboard: +1 on the left, -1 on the right, 0 in the middle.
        vendor, twin: the vendor's numbers and Draft's.
        anchor_gap: distance of the twin's hinge from the vendor's [m].
        axis_gap: angle between their axes [rad].
    """

    name: str
    joint: str
    group: str
    outboard: int
    vendor: Side
    twin: Side
    anchor_gap: float
    axis_gap: float

    @property
    def mass_ratio(self) -> float:
        """Vendor's mass over the twin's; nan where either has none."""
        return _ratio(self.vendor.mass, self.twin.mass)

    @property
    def gyration_ratio(self) -> float:
        """Vendor's radius of gyration over the twin's; nan where either has none."""
        return _ratio(self.vendor.gyration, self.twin.gyration)

    @property
    def com_shift(self) -> Array:
        """Vendor's centre of mass less the twin's: fore, outboard, up [m], shape (3,)."""
        side = self.outboard if self.outboard else 1
        return (self.vendor.com - self.twin.com) * np.array([1.0, side, 1.0])


def _ratio(a: float, b: float) -> float:
    return a / b if a > 0 and b > 0 else float("nan")


def side_of(body: Inertial) -> Side:
    """Sum up mass properties."""
    trace = float(np.trace(np.array(body.inertia)))
    gyration = np.sqrt(max(trace, 0.0) / (2 * body.mass)) if body.mass > 0 else 0.0
    return Side(body.mass, np.array(body.com), float(gyration))


def pairs(
    reduced: Reduced,
    vendor: mujoco.MjModel,
    twin: mujoco.MjModel,
    joints: Mapping[str, str],
) -> list[Pair]:
    """Pair the bodies of a vendor's robot with those of its twin, trunk first.

    Args:
        reduced: the vendor's robot, hung on the trunk and with its classes.
        vendor: the vendor's model, on its own base.
        twin: the twin's model; the trunk is its first body.
        joints: the twin's hinges by the vendor's names; bodies of others are left out.
    """
    data, own_data = _at_zero(vendor), _at_zero(twin)
    at, turn = reduced.base
    found: list[Pair] = []
    for body, own in counterparts(reduced, twin, joints):
        gaps = (0.0, 0.0)
        if body.joint is not None:
            theirs = vendor.joint(body.joint.name).id
            ours = twin.joint(joints[body.joint.name]).id
            # A hinge between the vendor's base and the trunk is seen from its other side.
            sense = np.sign((turn @ data.xaxis[theirs]) @ body.axis)
            gaps = _gaps(
                at + turn @ data.xanchor[theirs] - own_data.xanchor[ours],
                sense * turn @ data.xaxis[theirs],
                own_data.xaxis[ours],
            )
        found.append(
            Pair(
                name=body.name,
                joint=body.joint.name if body.joint else "",
                group=_group(body),
                outboard=_outboard(body),
                vendor=side_of(rigid(reduced.description, body.links, reduced.poses)),
                twin=side_of(_welded(twin, own_data, own)),
                anchor_gap=gaps[0],
                axis_gap=gaps[1],
            )
        )
    return found


def counterparts(
    reduced: Reduced, twin: mujoco.MjModel, joints: Mapping[str, str]
) -> Iterator[tuple[Body, int]]:
    """Yield each rigid body of a vendor's robot with its body in the twin's model, trunk first.

    Args:
        reduced: the vendor's robot.
        twin: the twin's model; the trunk is its first body.
        joints: the twin's hinges by the vendor's names; bodies of others are left out.
    """
    for body in reduced.root.all():
        if body.joint is None:
            yield body, 1
        elif body.joint.name in joints:
            yield body, int(twin.jnt_bodyid[twin.joint(joints[body.joint.name]).id])


def _group(body: Body) -> str:
    if body.joint is None:
        return TRUNK
    return body.kind or OTHER


def _outboard(body: Body) -> int:
    """Side that a limb is on: that of its first hinge away from the middle plane, from above."""
    way = [body]
    while way[-1].parent is not None and way[-1].parent.joint is not None:
        way.append(way[-1].parent)
    for one in reversed(way):
        if abs(float(one.anchor[1])) > 0.005:
            return 1 if one.anchor[1] > 0 else -1
    return 0


def _at_zero(model: Any) -> Any:
    """Data of a model with its first body at the origin and all joints at zero."""
    fixed = model.jnt_type[0] != mujoco.mjtJoint.mjJNT_FREE
    if fixed:
        model = copy.copy(model)
        model.body_pos[1], model.body_quat[1] = np.zeros(3), (1.0, 0.0, 0.0, 0.0)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    if not fixed:
        data.qpos[3] = 1.0
    mujoco.mj_forward(model, data)
    return data


def _gaps(between: Array, axis: Array, own: Array) -> tuple[float, float]:
    """Length of the way between two hinges [m], and the angle between their axes [rad]."""
    sine, cosine = float(np.linalg.norm(np.cross(axis, own))), float(axis @ own)
    return float(np.linalg.norm(between)), float(np.arctan2(sine, cosine))


def _welded(model: Any, data: Any, body: int) -> Inertial:
    """Mass properties of a body and all that is welded to it."""
    parts: list[Inertial] = []
    for i in np.flatnonzero(model.body_weldid == model.body_weldid[body]):
        inertia: Any = tuple(tuple(row) for row in np.diag(model.body_inertia[i]).tolist())
        own: Any = Inertial(scalar(model.body_mass[i]), (0.0, 0.0, 0.0), inertia)
        turn: Any = tuple(map(tuple, data.ximat[i].reshape(3, 3).tolist()))
        parts.append(moved(own, tuple(data.xipos[i].tolist()), turn))
    return combined(parts)
