"""Numbers of a design for learning: a quadruped with hip roll, hip pitch and knee on every leg."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeVar

import mujoco
import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.crouch import PARALLEL
from draft.design.legs import Leg, legs
from draft.errors import DraftError, Problem
from draft.learn.constants import REFERENCE_LEG
from draft.metrics.speed import top_speed
from draft.spec.primitives.sphere import SpherePart
from draft.values import scalar

if TYPE_CHECKING:
    from draft.model import Model

LEGS = 4
CLASSES = ("hip roll", "hip pitch", "knee")
T = TypeVar("T")


@dataclass(frozen=True)
class Quadruped:
    """A quadruped as plain numbers, with joints and legs in the model's order.

    Attributes:
        name: name of robot and design.
        xml: MJCF of the robot.
        trunk: name of the trunk.
        joints: names of the twelve joints.
        leg_joints: indices of hip roll, hip pitch and knee of each leg.
        feet: names of the feet's sites.
        foot_geoms: names of the feet's spheres.
        upper_legs: names of the geoms between hip pitch and knee, of each leg.
        home: joint angles of the home pose [rad].
        ranges: joint ranges [rad].
        peak_torque: peak torque of each joint [N m].
        no_load_speed: no-load speed of each joint [rad/s].
        leg_length: thigh plus shank of the longest leg [m].
        foot_radius: radius of the smallest foot [m].
        height: trunk's origin above the ground in the home pose [m].
        top_speed: estimated top speed [m/s].
        mass: total mass [kg].
        leg_mirror: index of the opposite leg, for each leg.
        mirror: index of the opposite joint, for each joint.
        mirror_sign: for each joint, -1 if the mirrored motion has the opposite sign there.
    """

    name: str
    xml: str
    trunk: str
    joints: tuple[str, ...]
    leg_joints: tuple[tuple[int, int, int], ...]
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

    @property
    def scale(self) -> float:
        """Scale s = L / 0.48 m."""
        return self.leg_length / REFERENCE_LEG

    def as_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {name: getattr(self, name) for name in Quadruped.__dataclass_fields__}

    @staticmethod
    def from_dict(data: dict[str, Any]) -> Quadruped:
        """Return the quadruped of data from `as_dict`, read back from JSON.

        Raises:
            KeyError: an entry is missing.
        """
        return Quadruped(**{one.name: _frozen(data[one.name]) for one in fields(Quadruped)})


def quadruped(design: Design) -> Quadruped:
    """Return the numbers of a design for learning.

    Raises:
        RefusedError: the design filter refuses it.
        DraftError: it is not a quadruped with hip roll, hip pitch and knee on every leg.
    """
    if design.count is not None:
        raise DraftError(Problem("learning needs single designs", None, "resolve them one by one"))
    name, chains, sides = _topology(design)
    model = design.build()
    joints = tuple(design.joints)
    index = {joint: i for i, joint in enumerate(joints)}
    home = _home(design, model, name)
    sites = [_foot(design, chain) for chain in chains]
    return Quadruped(
        name=name,
        xml=model.xml,
        trunk=design.bodies[0].name,
        joints=joints,
        leg_joints=tuple(_three(index[joint] for joint in chain.joints) for chain in chains),
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
        foot_radius=min(float(model.mujoco.geom(geom).size[0]) for _, geom in sites),
        height=_height(model, home, [geom for _, geom in sites]),
        top_speed=scalar(top_speed(design)),
        mass=scalar(design.mass),
        leg_mirror=sides,
        mirror=_mirror(chains, sides, index),
        mirror_sign=_mirror_signs(design, chains, sides, index),
    )


def check_family(members: Sequence[Quadruped]) -> None:
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
        foot: index of the foot's body.
        position: x and y of the foot, all joints at zero [m].
    """

    joints: tuple[str, str, str]
    bodies: tuple[int, int, int]
    foot: int
    position: tuple[float, float]


def check_topology(design: Design) -> None:
    """Check that a design has the legs of a quadruped, for any values of its parameters.

    Raises:
        DraftError: it is not a quadruped with hip roll, hip pitch and knee on every leg.
    """
    _topology(design)


def _three(values: Iterable[T]) -> tuple[T, T, T]:
    """Tuple of three values."""
    first, second, third = values
    return first, second, third


def _topology(design: Design) -> tuple[str, list[_Chain], tuple[int, ...]]:
    """Name of a design, its legs, and for each leg the opposite one."""
    name = design.name if design.label == "default" else f"{design.name}:{design.label}"
    chains = _chains(design, name)
    return name, chains, _sides(chains, name)


def _chains(design: Design, name: str) -> list[_Chain]:
    """The four legs in the model's order."""
    chains = [chain for leg in legs(design) for chain in _of_kind(design, leg, name)]
    others = set(design.joints) - {joint for chain in chains for joint in chain.joints}
    if len(chains) != LEGS:
        raise _not_quadruped(name, f"it has {len(chains)} legs with a knee, not four")
    if others:
        raise _not_quadruped(name, f"it has joints outside its legs: {', '.join(sorted(others))}")
    return sorted(chains, key=lambda chain: chain.foot)


def _sides(chains: Sequence[_Chain], name: str) -> tuple[int, ...]:
    """Index of the opposite leg, for each leg."""
    middle = sum(chain.position[0] for chain in chains) / len(chains)
    corner = {
        (chain.position[0] > middle, chain.position[1] > 0): i for i, chain in enumerate(chains)
    }
    if len(corner) != LEGS:
        raise _not_quadruped(name, "its feet are not two on each side, front and rear")
    other = {i: corner[front, not left] for (front, left), i in corner.items()}
    return tuple(other[i] for i in range(LEGS))


def _of_kind(design: Design, leg: Leg, name: str) -> list[_Chain]:
    """Legs of one kind."""
    if len(leg.joints) != len(CLASSES):
        raise _not_quadruped(name, f"a leg has {len(leg.joints)} hinges, not three")
    frames = design.frames()
    by_name = {b.prefix + b.joint.name: i for i, b in enumerate(design.bodies) if b.joint}
    chains = []
    for at, foot in enumerate(leg.feet):
        names = _three(joint.names[at] for joint in leg.joints)
        bodies = _three(by_name[joint] for joint in names)
        axes = [_axis(design, i) for i in bodies]
        for joint in names:
            if design.joints[joint].actuator is None:
                raise _not_quadruped(name, f"its joint {joint} has no actuator")
        if abs(axes[0][0]) < PARALLEL or min(abs(axes[1][1]), abs(axes[2][1])) < PARALLEL:
            raise _not_quadruped(
                name, f"the axes of {', '.join(names)} are not along x, y and y (roll, pitch, knee)"
            )
        origin = frames[foot][0]
        position = (scalar(origin[0]), scalar(origin[1]))
        chains.append(_Chain(names, bodies, foot, position))
    return chains


def _axis(design: Design, body: int) -> tuple[float, float, float]:
    """Axis of a body's joint in the trunk's frame, all joints at zero."""
    rotation = design.frames()[body][1]
    x, y, z = g.rotate(rotation, design.bodies[body].joint_axis)
    return scalar(x), scalar(y), scalar(z)


def _foot(design: Design, chain: _Chain) -> tuple[str, str]:
    """Names of the site and the sphere of a leg's foot."""
    body = design.bodies[chain.foot]
    end = body.link.end
    if not isinstance(end, SpherePart) or end.site is None:
        raise _not_quadruped(design.name, f"the foot of {body.name} is not a sphere with a site")
    return body.prefix + end.site, f"{body.name}_end"


def _upper(design: Design, chain: _Chain) -> tuple[str, ...]:
    """Names of the geoms from the hip pitch down to the knee."""
    names = []
    at: int | None = design.bodies[chain.bodies[2]].parent
    while at is not None and at != chain.bodies[0]:
        if scalar(design.bodies[at].member_radius) > 0:
            names.append(f"{design.bodies[at].name}_link")
        at = design.bodies[at].parent
    return tuple(reversed(names))


def _home(design: Design, model: Model, name: str) -> tuple[float, ...]:
    """Home pose; the crouch if the spec gives none."""
    home = {joint: scalar(one.home) for joint, one in design.joints.items()}
    if not any(home.values()):
        home = {n: float(j.angle) for leg in legs(design) for j in leg.joints for n in j.names}
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
    ids = [robot.geom(name).id for name in geoms]
    return -float(min(data.geom_xpos[i][2] - robot.geom_size[i][0] for i in ids))


def _of_actuators(design: Design, number: str) -> tuple[float, ...]:
    """Attribute of the actuator of each joint, by name."""
    return tuple(
        float(getattr(design.actuators[joint.actuator], number)) if joint.actuator else math.nan
        for joint in design.joints.values()
    )


def _mirror(
    chains: Sequence[_Chain], sides: Sequence[int], index: dict[str, int]
) -> tuple[int, ...]:
    other = [0] * len(index)
    for chain, side in zip(chains, sides, strict=True):
        for x, y in zip(chain.joints, chains[side].joints, strict=True):
            other[index[x]] = index[y]
    return tuple(other)


def _mirror_signs(
    design: Design, chains: Sequence[_Chain], sides: Sequence[int], index: dict[str, int]
) -> tuple[float, ...]:
    """Sign of the mirrored motion of each joint; an axis is an axial vector."""
    signs = [1.0] * len(index)
    for chain, side in zip(chains, sides, strict=True):
        for joint, i, j in zip(chain.joints, chain.bodies, chains[side].bodies, strict=True):
            u, v = _axis(design, i), _axis(design, j)
            dot = float(np.dot((-u[0], u[1], -u[2]), v))
            signs[index[joint]] = math.copysign(1.0, dot)
    return tuple(signs)


def _not_quadruped(name: str, cause: str) -> DraftError:
    remedy = "use a quadruped with hip roll, hip pitch and knee on every leg, and no other joints"
    return DraftError(Problem(f"{name} cannot be trained: {cause}", None, remedy))


def _frozen(value: Any) -> Any:
    """Value of JSON with lists as tuples."""
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value
