"""Numbers of a legged design for learning, found by its structure and not by names.

Legs are those of `draft.design.legs`: serial chains with a knee that end in a foot. Everything
else that has a driven joint, such as arms and a waist, moves by the same policy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import takewhile
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.battery import battery
from draft.design.crouch import PARALLEL
from draft.design.legs import Leg, legs
from draft.errors import DraftError, Problem
from draft.learn.constants import REFERENCE_LEG
from draft.metrics.speed import top_speed
from draft.values import Value, scalar

if TYPE_CHECKING:
    from draft.model import Model

LEAST_LEGS = 2
# Classes of joints of a quadruped with three joints on every leg.
CLASSES = ("hip roll", "hip pitch", "knee")
APART = 0.02  # largest distance between an anchor and the image of its counterpart [m]


@dataclass(frozen=True)
class LeggedRobot:
    """A legged robot as plain numbers, with joints and legs in the model's order.

    Attributes:
        name: name of robot and design.
        xml: MJCF of the robot.
        trunk: name of the trunk.
        joints: names of the joints.
        leg_joints: indices of the joints of each leg, from the trunk outwards.
        feet: names of the feet's sites.
        foot_geoms: names of the feet's spheres or plates.
        upper_legs: names of the geoms of each leg's thigh, between the knee and the joint above it.
        home: joint angles of the home pose [rad].
        ranges: joint ranges [rad].
        peak_torque: peak torque of each joint [N m].
        no_load_speed: no-load speed of each joint [rad/s].
        leg_length: thigh plus shank of the longest leg [m].
        foot_radius: radius of the smallest foot, or half the width of a plate [m].
        height: trunk's origin above the ground in the home pose [m].
        top_speed: estimated top speed [m/s].
        mass: total mass [kg].
        leg_mirror: index of the opposite leg, for each leg.
        mirror: index of the opposite joint, for each joint.
        mirror_sign: for each joint, -1 if the mirrored motion has the opposite sign there.
        corner_speed: highest speed of each joint with full peak torque [rad/s]; () if no motor has
            a corner.
        battery: energy of a stated battery, and the ends of its 90 % band [Wh]; () if the design
            states none.
    """

    name: str
    xml: str
    trunk: str
    joints: tuple[str, ...]
    leg_joints: tuple[tuple[int, ...], ...]
    feet: tuple[str, ...]
    foot_geoms: tuple[str, ...]
    upper_legs: tuple[tuple[str, ...], ...]
    home: tuple[float, ...]
    ranges: tuple[tuple[float, float], ...]
    peak_torque: tuple[float, ...]
    no_load_speed: tuple[float, ...]
    leg_length: float
    foot_radius: float
    height: float
    top_speed: float
    mass: float
    leg_mirror: tuple[int, ...]
    mirror: tuple[int, ...]
    mirror_sign: tuple[float, ...]
    corner_speed: tuple[float, ...] = ()
    battery: tuple[float, ...] = ()

    @property
    def stall_torque(self) -> tuple[float, ...]:
        """Torque of each motor at standstill without its current limit [N m]."""
        if not self.corner_speed:
            return self.peak_torque
        numbers = zip(self.peak_torque, self.no_load_speed, self.corner_speed, strict=True)
        return tuple(peak * (speed / (speed - corner)) for peak, speed, corner in numbers)

    @property
    def is_quadruped(self) -> bool:
        """Whether it has four legs of three joints, as the robots of the published study."""
        return len(self.joints) == 12 and [len(leg) for leg in self.leg_joints] == [3] * 4

    @property
    def classes(self) -> tuple[str, ...]:
        """Names of the classes of joints: those that are mirror images or copies of each other."""
        return CLASSES if self.is_quadruped else tuple(dict.fromkeys(self._kinds()))

    @property
    def joint_classes(self) -> tuple[int, ...]:
        """Index of the class of each joint."""
        if self.is_quadruped:
            places = {joint: i for leg in self.leg_joints for i, joint in enumerate(leg)}
            return tuple(places[joint] for joint in range(len(self.joints)))
        return tuple(self.classes.index(kind) for kind in self._kinds())

    def _kinds(self) -> list[str]:
        """Class of each joint: the end of the name that its class shares."""
        groups: dict[int, list[int]] = {}
        for leg in self.leg_joints:
            for place, joint in enumerate(leg):
                alike = [one[place] for one in self.leg_joints if len(one) == len(leg)]
                groups[joint] = alike
        return [
            _shared_end([self.joints[k] for k in groups.get(j, [j, self.mirror[j]])])
            for j in range(len(self.joints))
        ]

    @property
    def scale(self) -> float:
        """Scale s = L / 0.48 m."""
        return self.leg_length / REFERENCE_LEG

    def as_dict(self) -> dict[str, Any]:
        """Return plain data, without what is at its default: older records lack it."""
        data = {name: getattr(self, name) for name in LeggedRobot.__dataclass_fields__}
        return {name: x for name, x in data.items() if name not in _LATER or x != _LATER[name]}

    @staticmethod
    def from_dict(data: dict[str, Any]) -> LeggedRobot:
        """Return the quadruped of data from `as_dict`, read back from JSON.

        Raises:
            KeyError: an entry is missing.
        """
        data = _LATER | data
        return LeggedRobot(**{one.name: _frozen(data[one.name]) for one in fields(LeggedRobot)})


# Defaults of the fields that were added to records that exist.
_LATER: dict[str, Any] = {"corner_speed": (), "battery": ()}


def legged_robot(design: Design, model: Model | None = None) -> LeggedRobot:
    """Return the numbers of a design for learning.

    Args:
        design: one design.
        model: its model; None to build it.

    Raises:
        RefusedError: no model is given and the design filter refuses it.
        DraftError: it has fewer than two legs, a joint without an actuator, or no mirror image.
    """
    if design.count is not None:
        raise DraftError(Problem("learning needs single designs", None, "resolve them one by one"))
    name, chains = _topology(design)
    sides = _mirrored_legs(chains, name)
    other, sign = _mirrored_joints(design, sides, chains, name)
    model = model or design.build()
    joints = tuple(design.joints)
    index = {joint: i for i, joint in enumerate(joints)}
    home = _home(design, model, name)
    sites = [_foot(design, chain) for chain in chains]
    return LeggedRobot(
        name=name,
        xml=model.xml,
        trunk=design.bodies[0].name,
        joints=joints,
        leg_joints=tuple(tuple(index[joint] for joint in chain.joints) for chain in chains),
        feet=tuple(site for site, _ in sites),
        foot_geoms=tuple(geom for _, geom in sites),
        upper_legs=tuple(_upper(design, chain) for chain in chains),
        home=home,
        ranges=tuple(
            (float(joint.range[0]), float(joint.range[1])) for joint in design.joints.values()
        ),
        peak_torque=_of_actuators(design, "peak_torque"),
        no_load_speed=_of_actuators(design, "no_load_speed"),
        leg_length=max(float(leg.length) for leg in legs(design)),
        foot_radius=min(radius_of_foot(model.mujoco, geom) for _, geom in sites),
        height=_height(model, home, [geom for _, geom in sites]),
        top_speed=scalar(top_speed(design)),
        mass=scalar(design.mass),
        leg_mirror=sides,
        mirror=tuple(index[other[joint]] for joint in joints),
        mirror_sign=tuple(sign[joint] for joint in joints),
        corner_speed=corners(_of_actuators(design, "corner_speed")),
        battery=tuple(map(scalar, stated_battery(design))),
    )


def corners(speeds: tuple[float, ...]) -> tuple[float, ...]:
    """Corner speed of each joint [rad/s]; () if all are zero."""
    return speeds if any(speeds) else ()


def stated_battery(design: Design) -> tuple[Value, ...]:
    """Energy of a stated battery and the ends of its 90 % band [Wh]; () if none is stated."""
    if not design.battery_stated:
        return ()
    found = battery(design)
    return found.energy, *found.band


def check_family(members: Sequence[LeggedRobot]) -> None:
    """Check that quadrupeds can share one simulation.

    Raises:
        DraftError: one has other joints, feet or bodies than the first.
    """
    first = members[0]
    for other in members[1:]:
        for what in ("trunk", "joints", "leg_joints", "feet", "foot_geoms", "upper_legs", "mirror"):
            if getattr(other, what) != getattr(first, what):
                cause = (
                    f"{other.name} has another topology than {first.name}: its "
                    f"{what.replace('_', ' ')} differ"
                )
                remedy = "train them separately; a family varies the numbers of one tree"
                raise DraftError(Problem(cause, None, remedy))


@dataclass(frozen=True)
class _Chain:
    """One leg.

    Attributes:
        joints: names of its joints, from the trunk outwards.
        bodies: indices of their bodies.
        knee: place of the knee among them.
        foot: index of the foot's body.
        position: x and y of the foot, all joints at zero [m].
    """

    joints: tuple[str, ...]
    bodies: tuple[int, ...]
    knee: int
    foot: int
    position: tuple[float, float]


def check_topology(design: Design) -> None:
    """Check that a design can learn to walk, for any values of its parameters.

    Raises:
        DraftError: it has fewer than two legs, a joint without an actuator, or no mirror image.
    """
    name, chains = _topology(design)
    _mirrored_joints(design, _mirrored_legs(chains, name), chains, name)


def _topology(design: Design) -> tuple[str, list[_Chain]]:
    """Name of a design, and its legs in the model's order."""
    name = design.name if design.label == "default" else f"{design.name}:{design.label}"
    for joint, one in design.joints.items():
        if one.actuator is None:
            raise _untrainable(name, f"its joint {joint} has no actuator")
    chains = [chain for leg in legs(design) for chain in _of_kind(design, leg)]
    if len(chains) < LEAST_LEGS:
        found = "one leg" if chains else "no legs"
        raise _untrainable(name, f"it has {found} with a knee and a foot")
    return name, sorted(chains, key=lambda chain: chain.foot)


def _of_kind(design: Design, leg: Leg) -> list[_Chain]:
    """Legs of one kind."""
    frames = design.frames()
    by_name = {b.prefix + b.joint.name: i for i, b in enumerate(design.bodies) if b.joint}
    chains = []
    for at, foot in enumerate(leg.feet):
        names = tuple(joint.names[at] for joint in leg.joints)
        origin = frames[foot][0]
        position = (scalar(origin[0]), scalar(origin[1]))
        bodies = tuple(by_name[joint] for joint in names)
        chains.append(_Chain(names, bodies, leg.joints.index(leg.knee), foot, position))
    return chains


def _mirrored_legs(chains: Sequence[_Chain], name: str) -> tuple[int, ...]:
    """Index of the leg on the other side, for each leg."""
    feet = np.array([chain.position for chain in chains])
    distances = np.linalg.norm(feet[:, None] - feet * (1.0, -1.0), axis=2)
    other = distances.argmin(axis=1)
    alike = all(
        other[j] == i and len(chains[i].joints) == len(chains[j].joints)
        for i, j in enumerate(other)
    )
    if not alike or any(i == j for i, j in enumerate(other)):
        raise _untrainable(name, "its legs are not pairs of a left and a right one")
    return tuple(int(i) for i in other)


def _mirrored_joints(
    design: Design, sides: Sequence[int], chains: Sequence[_Chain], name: str
) -> tuple[dict[str, str], dict[str, float]]:
    """For each joint, the one that the mirror image of its motion turns, and with which sign.

    Joints of legs are paired by their place in the leg, others by place and axis: the image of an
    anchor is the nearest anchor whose axis is parallel to the image of the axis.
    """
    other: dict[str, str] = {}
    body = {b.prefix + b.joint.name: i for i, b in enumerate(design.bodies) if b.joint}
    for chain, side in zip(chains, sides, strict=True):
        other |= dict(zip(chain.joints, chains[side].joints, strict=True))
    rest = [joint for joint in design.joints if joint not in other]
    for joint in rest:
        image = _image(_axis(design, body[joint]))
        parallel = [k for k in rest if abs(np.dot(image, _axis(design, body[k]))) > PARALLEL]
        x, y, z = _anchor(design, body[joint])
        away = {k: math.dist((x, -y, z), _anchor(design, body[k])) for k in parallel}
        nearest = min(away, key=lambda k: away[k], default="")
        if not nearest or away[nearest] > APART:
            raise _untrainable(name, f"its joint {joint} has no counterpart on the other side")
        other[joint] = nearest
    sign = {}
    for joint, image_joint in other.items():
        if other[image_joint] != joint:
            raise _untrainable(name, f"its joint {joint} has no counterpart on the other side")
        dot = np.dot(_image(_axis(design, body[joint])), _axis(design, body[image_joint]))
        sign[joint] = math.copysign(1.0, float(dot))
    return other, sign


def _image(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    """Mirror image about the xz plane of an axis, which is an axial vector."""
    return -axis[0], axis[1], -axis[2]


def _axis(design: Design, body: int) -> tuple[float, float, float]:
    """Axis of a body's joint in the trunk's frame, all joints at zero."""
    rotation = design.frames()[body][1]
    x, y, z = g.rotate(rotation, design.bodies[body].joint_axis)
    return scalar(x), scalar(y), scalar(z)


def _anchor(design: Design, body: int) -> tuple[float, float, float]:
    """Origin of a body in the trunk's frame, all joints at zero [m]."""
    x, y, z = design.frames()[body][0]
    return scalar(x), scalar(y), scalar(z)


def _foot(design: Design, chain: _Chain) -> tuple[str, str]:
    """Names of the site and the geom of a leg's foot."""
    body = design.bodies[chain.foot]
    end = body.link.end
    if end is None or end.site is None:  # legs end in feet, and feet have sites
        raise _untrainable(design.name, f"the foot of {body.name} has no site")
    return body.prefix + end.site, f"{body.name}_end"


def _upper(design: Design, chain: _Chain) -> tuple[str, ...]:
    """Names of the geoms from the joint above the knee down to the knee."""
    names = []
    above = chain.bodies[chain.knee - 1] if chain.knee else 0
    stop = design.bodies[above].parent if chain.knee else 0
    at: int | None = design.bodies[chain.bodies[chain.knee]].parent
    while at is not None and at != stop:
        if scalar(design.bodies[at].member_radius) > 0:
            names.append(f"{design.bodies[at].name}_link")
        at = design.bodies[at].parent
    return tuple(reversed(names))


def _home(design: Design, model: Model, name: str) -> tuple[float, ...]:
    """Home pose; the crouch if the spec gives none."""
    home = {joint: scalar(one.home) for joint, one in design.joints.items()}
    if not any(home.values()):
        home |= {n: float(j.angle) for leg in legs(design) for j in leg.joints for n in j.names}
    for joint, angle in home.items():
        low, high = (scalar(x) for x in design.joints[joint].range)
        if not low <= angle <= high:
            raise DraftError(
                Problem(
                    f"{name} cannot crouch: {joint} at {angle:.2f} rad is outside its range "
                    f"{low:.2f} to {high:.2f}",
                    None,
                    "add `home` to its joints in tree.yaml",
                )
            )
    return tuple(home[joint] for joint in design.joints)


def _height(model: Model, home: Sequence[float], geoms: Sequence[str]) -> float:
    """Trunk's origin above the lowest foot [m]."""
    robot = model.mujoco
    data = mujoco.MjData(robot)
    data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
    data.qpos[7:] = home
    mujoco.mj_kinematics(robot, data)
    return -min(lowest_point(robot, data, name) for name in geoms)


def _of_actuators(design: Design, number: str) -> tuple[float, ...]:
    """Attribute of the actuator of each joint, by name."""
    return tuple(
        float(getattr(design.actuators[joint.actuator], number)) if joint.actuator else math.nan
        for joint in design.joints.values()
    )


def radius_of_foot(model: mujoco.MjModel, geom: str) -> float:
    """Radius of a sphere, or half the width of a plate [m]."""
    size = model.geom(geom).size
    return float(min(size[:2]) if model.geom(geom).type == mujoco.mjtGeom.mjGEOM_BOX else size[0])


def _shared_end(names: Sequence[str]) -> str:
    """Words at the end of all names, such as "hip pitch" of left_hip_pitch and right_hip_pitch."""
    words = [name.split("_")[::-1] for name in names]
    ends = takewhile(lambda same: len(set(same)) == 1, zip(*words, strict=False))
    return " ".join([same[0] for same in ends][::-1]) or names[0]


def lowest_point(model: mujoco.MjModel, data: mujoco.MjData, geom: str) -> float:
    """Height of the lowest point of a sphere or a box [m]."""
    i = model.geom(geom).id
    height, size = float(data.geom_xpos[i][2]), model.geom_size[i]
    if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX:
        return height - float(np.abs(data.geom_xmat[i].reshape(3, 3)[2]) @ size)
    return height - float(size[0])


def _untrainable(name: str, cause: str) -> DraftError:
    remedy = (
        "use a robot with left and right legs, each with a knee (a driven hinge of a link of "
        "`segment: shank`) and a foot with a site, whose joints are all driven"
    )
    return DraftError(Problem(f"{name} cannot be trained: {cause}", None, remedy))


def _frozen(value: Any) -> Any:
    """Value of JSON with lists as tuples."""
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value
