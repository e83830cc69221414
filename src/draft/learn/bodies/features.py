"""Features of a design: dimensionless numbers in which designs differ."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from draft.learn.bodies.family_fields import family_fields
from draft.learn.bodies.legged import CLASSES, REFERENCE_LEG, LeggedRobot
from draft.learn.bodies.payload import model_spec
from draft.model import pose

GRAVITY = 9.81
MASS = 30.0  # Approximate mass of a quadruped of scale one [kg].
FEATURES = (
    *("leg length", "mass", "height", "thigh", "stance length", "stance width"),
    *(
        f"{number} of {joint}"
        for joint in CLASSES
        for number in ("peak torque", "no-load speed", "inertia")
    ),
)
# Units of each feature of one body, by `readable`.
UNITS = ("m", "kg", *("m",) * 4, *("N m", "rad/s", "kg m2") * len(CLASSES))


def readable(logarithms: ArrayLike, member: LeggedRobot) -> NDArray[np.float64]:
    """Features in `UNITS`, for the leg length and mass of a body.

    Args:
        logarithms: features of this body or others, shape (..., features).
        member: the body.
    """
    length, mass = member.leg_length, member.mass
    joint = (mass * GRAVITY * length, math.sqrt(GRAVITY / length), mass * length**2)
    per = (REFERENCE_LEG, MASS * member.scale**3, *(length,) * 4, *joint * len(CLASSES))
    return np.exp(np.asarray(logarithms, float)) * per


def features(member: LeggedRobot, model: mujoco.MjModel | None = None) -> tuple[float, ...]:
    """Logarithms of the numbers of FEATURES, for a policy that observes its design.

    With leg length L, mass m and gravity g: leg length per 0.48 m; mass per 30 kg and cubed scale;
    height in the home pose, thigh, and distances between front and rear and between left and right
    feet per L; for each class of joints, as means over the legs, peak torque per m g L, no-load
    speed times sqrt(L / g), and inertia about the joint, limbs straight, with its rotor's, per
    m L^2.

    A robot that is no quadruped with three joints on every leg has none.

    Args:
        member: the body.
        model: its model; None to compile it.
    """
    if not member.is_quadruped:
        return ()
    own: mujoco.MjModel = model or model_spec(member).compile()
    return _features(member, own, mujoco.MjData(own))


def family_features(members: tuple[LeggedRobot, ...]) -> list[tuple[float, ...]]:
    """Features of each design of a family."""
    if len(members) == 1:
        return [features(members[0])]
    if not members[0].is_quadruped:
        return [()] * len(members)
    first, fields = family_fields(members)
    model, found = copy.copy(first), []
    data = mujoco.MjData(model)
    for i, member in enumerate(members):
        for name, values in fields.items():
            getattr(model, name)[:] = values[i]
        mujoco.mj_setConst(model, data)
        found.append(_features(member, model, data))
    return found


def _features(member: LeggedRobot, model: mujoco.MjModel, data: mujoco.MjData) -> tuple[float, ...]:
    length, mass = member.leg_length, member.mass
    inertia = [float(model.dof_M0[model.joint(name).dofadr[0]]) for name in member.joints]
    numbers = [member.scale, mass / member.scale**3 / MASS, member.height / length]
    numbers += [size / length for size in _sizes(model, data, member)]
    for joints in zip(*member.leg_joints, strict=True):
        numbers += [
            _mean(member.peak_torque, joints) / (mass * GRAVITY * length),
            _mean(member.no_load_speed, joints) * math.sqrt(length / GRAVITY),
            _mean(inertia, joints) / (mass * length**2),
        ]
    return tuple(math.log(number) for number in numbers)


def _mean(values: Sequence[float], joints: Sequence[int]) -> float:
    return sum(values[i] for i in joints) / len(joints)


def _sizes(
    model: mujoco.MjModel, data: mujoco.MjData, member: LeggedRobot
) -> tuple[float, float, float]:
    """Length of the thigh, and distances of the feet along and across in the home pose [m]."""
    pose.put(model, data, member.home)
    hip, knee = (
        np.array([data.xanchor[model.joint(member.joints[leg[i]]).id] for leg in member.leg_joints])
        for i in (1, 2)
    )
    feet = np.array([data.site_xpos[model.site(name).id] for name in member.feet])
    thigh = np.linalg.norm((knee - hip)[:, ::2], axis=1).mean()
    spread = 2 * np.abs(feet - feet.mean(axis=0)).mean(axis=0)
    return float(thigh), float(spread[0]), float(spread[1])
