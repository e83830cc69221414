"""Places of joints in one layout for all legs, and the numbers that describe a body there.

A leg has a place by its side and by its order from front to rear, a joint of it one of six roles.
A policy of all legs observes and moves joints by these slots, so that it does not depend on names,
on the order of joints or on which way they turn. Joints that are on no leg, such as those of arms,
have no slot: they hold the home pose.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.learn.bodies.family_fields import family_fields
from draft.learn.bodies.features import GRAVITY, MASS
from draft.learn.bodies.knees import knee_of
from draft.learn.bodies.legged import REFERENCE_LEG, LeggedRobot
from draft.learn.bodies.payload import model_spec
from draft.model import pose
from draft.values import Array

# The joint above the knee whose axis is most parallel with the knee's lifts the leg.
ROLES = ("yaw", "roll", "pitch", "knee", "ankle pitch", "ankle roll")
_YAW, _ROLL, _PITCH, _KNEE, _ANKLE_PITCH, _ANKLE_ROLL = range(len(ROLES))
ROWS = ("front", "middle", "rear")
LEGS = tuple(f"{side} {row}" for row in ROWS for side in ("left", "right"))
SLOTS = len(LEGS) * len(ROLES)
# Numbers of each joint, of each leg, and of the body; see `slot_features`.
OF_JOINT = ("presence", "peak torque", "no-load speed", "inertia", "bend")
OF_LEG = ("hip ahead", "hip aside", "foot ahead", "foot aside", "thigh")
OF_BODY = ("leg length", "mass", "legs", "sole", "centre ahead", "centre above")
FEATURES = len(OF_JOINT) * SLOTS + len(OF_LEG) * len(LEGS) + len(OF_BODY)
# Units of them, by `readable_slots`.
_UNITS_OF_JOINT = ("", "N m", "rad/s", "kg m2", "rad")
_UNITS_OF_BODY = ("m", "kg", "", "m", "m", "m")
_UPRIGHT = 0.7  # Vertical part of an axis from which a joint turns the leg about the vertical.
_ALONE = "train a policy for this robot alone: 'draft train'"
_STRAIGHT = 0.02  # Angle of a knee below which a leg counts as straight [rad].
# A joint of a left leg counts as positive about an axis with a positive part along this.
_POSITIVE = np.array([1.0, 0.8, 0.5])
_LEANING = 0.4  # Vertical part of the axis of a yaw joint on a leg that leans far.


@dataclass(frozen=True)
class Slots:
    """Slots of a robot's joints and legs.

    Attributes:
        joints: slot of each joint; -1 for joints of no leg.
        signs: for each joint, -1 if it turns against the direction that counts as positive.
        legs: place of each leg among `LEGS`.
    """

    joints: tuple[int, ...]
    signs: tuple[float, ...]
    legs: tuple[int, ...]


def mirrored_slots() -> NDArray[np.intp]:
    """Slot on the other side, for each slot; the numbers of a mirrored pair have the same sign."""
    places = np.arange(SLOTS).reshape(len(ROWS), 2, len(ROLES))
    return places[:, ::-1].reshape(-1)


def mirrored_features() -> NDArray[np.intp]:
    """Index of the feature that the mirror image of a body has in its place, for each feature."""
    joints = np.arange(len(OF_JOINT) * SLOTS).reshape(len(OF_JOINT), SLOTS)[:, mirrored_slots()]
    legs = np.arange(len(OF_LEG) * len(LEGS)).reshape(len(OF_LEG), len(ROWS), 2)[..., ::-1]
    body = np.arange(len(OF_BODY))
    return np.concatenate(
        [joints.ravel(), joints.size + legs.ravel(), joints.size + legs.size + body]
    )


def owned(features: Array) -> NDArray[np.bool_]:
    """Whether bodies have the joint, the leg or the body that each number is of.

    Args:
        features: numbers of bodies, shape (..., FEATURES).
    """
    joints = features[..., :SLOTS] > 0
    legs = joints.reshape(*joints.shape[:-1], len(LEGS), len(ROLES)).any(axis=-1)
    parts = [np.ones_like(joints), *[joints] * (len(OF_JOINT) - 1), *[legs] * len(OF_LEG)]
    return np.concatenate([*parts, np.ones((*joints.shape[:-1], len(OF_BODY)), bool)], axis=-1)


def ranges(features: Array) -> Array:
    """Ends of each number over the bodies that have what it is of, shape (2, FEATURES).

    Zeros where none has it.

    Args:
        features: numbers of bodies, shape (bodies, FEATURES).
    """
    own = owned(features)
    low = np.where(own, features, np.inf).min(axis=0)
    high = np.where(own, features, -np.inf).max(axis=0)
    return np.where(own.any(axis=0), (low, high), 0.0)


def feature_names() -> list[str]:
    """Name of each number."""
    slots = [f"{leg} {role}" for leg in LEGS for role in ROLES]
    return [
        *(f"{slot} joints" for slot in slots),
        *(f"{number} of the {slot}" for number in OF_JOINT[1:] for slot in slots),
        *(f"{number} of the {leg} leg" for number in OF_LEG for leg in LEGS),
        *OF_BODY,
    ]


def feature_units() -> list[str]:
    """Unit of each number, by `readable_slots`."""
    of_joints = [unit for unit in _UNITS_OF_JOINT for _ in range(SLOTS)]
    return [*of_joints, *["m"] * (len(OF_LEG) * len(LEGS)), *_UNITS_OF_BODY]


def readable_slots(features: Array, member: LeggedRobot) -> Array:
    """Numbers in `feature_units`, for the leg length and mass of a body, shape (..., FEATURES).

    Args:
        features: numbers of this body or others, shape (..., FEATURES).
        member: the body.
    """
    length, mass = member.leg_length, member.mass
    shape = features.shape[:-1]
    joints = features[..., : len(OF_JOINT) * SLOTS].reshape(*shape, len(OF_JOINT), SLOTS).copy()
    sizes = (mass * GRAVITY * length, math.sqrt(GRAVITY / length), mass * length**2)
    joints[..., 1:4, :] = np.exp(joints[..., 1:4, :]) * np.array(sizes)[:, None]
    joints[..., 4, :] = np.arcsin(np.clip(joints[..., 4, :], -1.0, 1.0))
    rest = features[..., joints.shape[-2] * SLOTS :] * length
    body = features[..., -len(OF_BODY) :]
    first = rest.shape[-1] - len(OF_BODY)
    rest[..., first] = np.exp(body[..., 0]) * REFERENCE_LEG
    rest[..., first + 1] = np.exp(body[..., 1]) * MASS * member.scale**3
    rest[..., first + 2] = body[..., 2] * 4
    return np.concatenate([joints.reshape(*shape, -1), rest], axis=-1)


def slots_of(member: LeggedRobot, model: mujoco.MjModel | None = None) -> Slots:
    """Return the slots of a robot.

    Args:
        member: the robot.
        model: its model; None to compile it.

    Raises:
        DraftError: a leg has more than three joints above its knee or two below, or a driven wheel.
    """
    return _Pose(member, model).slots()


def servo_torque(member: LeggedRobot, slots: Slots, support: float) -> Array:
    """Torque that the gains of each servo are for [N m], shape (joints,).

    That is the motor's peak torque, and of hip pitch and knee at least a share of m g L, on n legs
    of 4 / n of that: gains by the motor alone let a robot with weak motors sink under its weight.
    Robots on two legs have those of their motors: their ankles would have to become stiffer too.

    Args:
        member: the robot.
        slots: its slots.
        support: the share on four legs; 0 for the motors alone.
    """
    places, peak = np.array(slots.joints), np.array(member.peak_torque)
    legs = len(member.feet)
    if legs <= 2:
        return peak
    lifts = (places >= 0) & np.isin(places % len(ROLES), (_PITCH, _KNEE))
    least = 4 / legs * support * member.own_mass * GRAVITY * member.leg_length
    return np.where(lifts, np.maximum(peak, least), peak)


def describe(member: LeggedRobot, model: mujoco.MjModel | None = None) -> tuple[Slots, Array]:
    """Return the slots of a robot and its numbers by slots, shape (FEATURES,); see `slot_features`.

    Args:
        member: the robot.
        model: its model; None to compile it.

    Raises:
        DraftError: as `slots_of`.
    """
    pose = _Pose(member, model)
    slots = pose.slots()
    return slots, pose.features(slots)


class _Pose:
    """A robot in its home pose."""

    def __init__(self, member: LeggedRobot, model: mujoco.MjModel | None = None) -> None:
        own: mujoco.MjModel = model or model_spec(member).compile()
        data = mujoco.MjData(own)
        pose.put(own, data, member.home)
        ids = [own.joint(name).id for name in member.joints]
        self.member, self.model = member, own
        self.axes, self.anchors = data.xaxis[ids].copy(), data.xanchor[ids].copy()
        self.feet = np.array([data.site_xpos[own.site(name).id] for name in member.feet])
        self.inertia = own.dof_M0[[own.joint(name).dofadr[0] for name in member.joints]]
        self.centre = own.body_mass @ data.xipos / own.body_mass.sum()
        self.left = self.feet[:, 1] > 0

    def knee(self, leg: int) -> tuple[int, float]:
        """Place of the knee among the joints of a leg, and its angle from the straight leg."""
        joints = list(self.member.leg_joints[leg])
        return knee_of(np.array([*self.anchors[joints], self.feet[leg]]), self.axes[joints])

    def roles(self, leg: int) -> list[int]:
        """Role of each joint of a leg, from the trunk outwards."""
        joints = self.member.leg_joints[leg]
        return _roles(self.member, self.axes[list(joints)], self.knee(leg)[0], joints)

    def slots(self) -> Slots:
        member = self.member
        if member.rolls:
            wheel = member.joints[member.rolls.index(True)]
            cause = f"{wheel} of {member.name} drives a wheel by its speed"
            cause += ", and the policy of all legs gives angles"
            raise DraftError(cause, _ALONE)
        joints, legs = [-1] * len(member.joints), [0] * len(member.feet)
        for left in (True, False):
            side = [leg for leg in range(len(legs)) if self.left[leg] == left]
            side.sort(key=lambda leg: -self.feet[leg, 0])
            for order, leg in enumerate(side):
                legs[leg] = 2 * _row(order, len(side)) + (not left)
        for leg, of_leg in enumerate(member.leg_joints):
            for joint, role in zip(of_leg, self.roles(leg), strict=True):
                joints[joint] = legs[leg] * len(ROLES) + role
        return Slots(tuple(joints), tuple(self.signs(by_knees=True)), tuple(legs))

    def signs(self, by_knees: bool) -> list[float]:
        """For each joint, -1 if it turns against the direction that counts as positive.

        Args:
            by_knees: whether a knee counts as positive where it bends further. Legs whose knees
                bend the other way then lift their feet by the same actions.
        """
        member = self.member
        signs = [1.0] * len(member.joints)
        for leg, of_leg in enumerate(member.leg_joints):
            if not self.left[leg]:
                continue
            knee, angle = self.knee(leg)
            for joint, role in zip(of_leg, self.roles(leg), strict=True):
                axis = self.axes[joint]
                # A yaw axis leans with the thigh, and its vertical part keeps its sign.
                upright = role == _YAW and abs(axis[2]) > _LEANING
                signs[joint] = math.copysign(1.0, axis[2] if upright else axis @ _POSITIVE)
            if by_knees and abs(angle) > _STRAIGHT:
                signs[of_leg[knee]] = math.copysign(1.0, angle)
        for leg, of_leg in enumerate(member.leg_joints):
            if not self.left[leg]:  # The mirror image of a joint counts alike.
                for joint in of_leg:
                    signs[joint] = signs[member.mirror[joint]] * member.mirror_sign[joint]
        return signs

    def features(self, slots: Slots) -> Array:
        member, length = self.member, self.member.leg_length
        mass = member.mass
        per_joint, signs = np.zeros((len(OF_JOINT), SLOTS)), self.signs(by_knees=False)
        for joint, slot in enumerate(slots.joints):
            if slot < 0:
                continue
            per_joint[:, slot] = (
                1.0,
                math.log(member.peak_torque[joint] / (mass * GRAVITY * length)),
                math.log(member.no_load_speed[joint] * math.sqrt(length / GRAVITY)),
                math.log(self.inertia[joint] / (mass * length**2)),
                signs[joint] * math.sin(member.home[joint]),
            )
        per_leg = np.zeros((len(OF_LEG), len(LEGS)))
        middle = self.feet.mean(axis=0)
        for leg, place in enumerate(slots.legs):
            out = 1.0 if self.left[leg] else -1.0
            joints = member.leg_joints[leg]
            hip, knee = self.anchors[joints[0]], self.anchors[joints[self.knee(leg)[0]]]
            foot = self.feet[leg]
            per_leg[:, place] = (
                (hip[0] - middle[0]) / length,
                out * hip[1] / length,
                (foot[0] - middle[0]) / length,
                out * foot[1] / length,
                float(np.linalg.norm(foot - knee)) / length,
            )
        body = (
            math.log(member.scale),
            math.log(mass / member.scale**3 / MASS),
            len(member.feet) / 4,
            self._sole() / length,
            (self.centre[0] - middle[0]) / length,
            (self.centre[2] - middle[2]) / length,
        )
        return np.concatenate([per_joint.ravel(), per_leg.ravel(), body])

    def _sole(self) -> float:
        """Half the length of a plate; 0 for spheres [m]."""
        geom = self.model.geom(self.member.foot_geoms[0])
        return float(geom.size[0]) if geom.type == mujoco.mjtGeom.mjGEOM_BOX else 0.0


def slot_features(members: Sequence[LeggedRobot]) -> list[tuple[float, ...]]:
    """Numbers of each body of one topology by slots, all without a unit, shape (FEATURES,).

    With leg length L, mass m and gravity g, of each joint: one, and logarithms of peak torque per
    m g L, of no-load speed times sqrt(L / g), and of the inertia about the joint per m L^2, and the
    sine of its angle in the home pose. Of each leg, per L: place of hip and foot ahead of the
    middle of the feet and aside, and the distance from knee to foot. Of the body: logarithms of
    L per 0.48 m and of mass per 30 kg and cubed scale; a quarter of the number of legs,
    half the length of a sole per L, and the centre of mass ahead of the middle of the feet and
    above it, per L. Numbers of slots without a joint are zero.

    Raises:
        DraftError: as `slots_of`.
    """
    return [tuple(features.tolist()) for _, features in described(members)]


def described(members: Sequence[LeggedRobot]) -> list[tuple[Slots, Array]]:
    """Return `describe` of each body of one topology.

    Raises:
        DraftError: as `slots_of`.
    """
    if len(members) == 1:
        return [describe(members[0])]
    first, fields = family_fields(tuple(members))
    model, found = copy.copy(first), []
    data = mujoco.MjData(model)
    for i, member in enumerate(members):
        for name, values in fields.items():
            getattr(model, name)[:] = values[i]
        mujoco.mj_setConst(model, data)
        found.append(describe(member, model))
    return found


def traits(features: Array) -> Array:
    """Numbers that tell how hard it is for a body to walk, shape (..., 4).

    Means over its legs: logarithm of the hips' peak torque per m g L, place of the feet aside per
    height of the centre of mass, logarithm of the hips' no-load speed times sqrt(L / g). And the
    logarithm of its size.

    Args:
        features: numbers of bodies by slots, shape (..., FEATURES).
    """
    joints = features[..., : len(OF_JOINT) * SLOTS]
    joints = joints.reshape(*features.shape[:-1], len(OF_JOINT), len(LEGS), len(ROLES))
    hips, legs = joints[..., _PITCH], joints[..., 0, :, :].any(axis=-1)
    aside = features[..., joints.shape[-3] * SLOTS :][..., 3 * len(LEGS) : 4 * len(LEGS)]
    sums = [(one * legs).sum(axis=-1) for one in (hips[..., 1, :], aside, hips[..., 2, :])]
    torque, width, speed = np.array(sums) / legs.sum(axis=-1)
    return np.stack((torque, width / features[..., -1], speed, features[..., -len(OF_BODY)]), -1)


def _row(order: int, count: int) -> int:
    """Row of a leg by its order from the front among those of its side."""
    if count == 1:
        return 1
    return 0 if order == 0 else 2 if order == count - 1 else 1


def _roles(member: LeggedRobot, axes: Array, knee: int, joints: Sequence[int]) -> list[int]:
    """Role of each joint of a leg, from the trunk outwards."""
    found = [_KNEE] * len(joints)
    along = abs(axes @ axes[knee])
    if knee:
        pitch = int(along[:knee].argmax())
        found[pitch] = _PITCH
        free = [_YAW, _ROLL]
        rest = sorted(set(range(knee)) - {pitch}, key=lambda i: -abs(axes[i, 2]))
        for i in rest:
            if not free:
                raise _too_many(member, joints, "above")
            upright = abs(axes[i, 2]) > _UPRIGHT
            found[i] = free.pop(free.index(_YAW) if upright and _YAW in free else -1)
    free = [_ANKLE_ROLL, _ANKLE_PITCH]
    for i in sorted(range(knee + 1, len(joints)), key=lambda i: -along[i]):
        if not free:
            raise _too_many(member, joints, "below")
        alike = along[i] > _UPRIGHT and _ANKLE_PITCH in free
        found[i] = free.pop(-1 if alike else 0)
    return found


def _too_many(member: LeggedRobot, joints: Sequence[int], side: str) -> DraftError:
    names = ", ".join(member.joints[joint] for joint in joints)
    most = 3 if side == "above" else 2
    cause = f"{member.name} has a leg with more than {most} joints {side} its knee: {names}"
    return DraftError(cause, _ALONE)
