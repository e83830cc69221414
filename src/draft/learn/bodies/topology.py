"""Topology of a legged design for learning: its legs, and which of them are mirror images.

Legs are those of `draft.design.legs`: serial chains with a knee that end in a foot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.crouch import PARALLEL
from draft.design.legs import Leg, legs
from draft.errors import DraftError
from draft.values import scalar

LEAST_LEGS = 2
MIDDLE = 0.08  # largest distance of the anchor of a joint of the middle from there [m]
APART = 0.02  # largest distance between an axis and the image of its counterpart's [m]


@dataclass(frozen=True)
class Chain:
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
    name, chains = topology(design)
    mirrored_joints(design, mirrored_legs(chains, name), chains, name)


def topology(design: Design) -> tuple[str, list[Chain]]:
    """Name of a design, and its legs in the model's order.

    Raises:
        DraftError: it has fewer than two legs, or a joint without an actuator.
    """
    name = design.name if design.label == "default" else f"{design.name}:{design.label}"
    if not design.floating:
        cause = f"{name} cannot be trained: a policy walks, and its base is fixed to the world"
        raise DraftError(cause, "name a robot on legs")
    for joint, one in design.joints.items():
        if one.follows is not None:
            raise _untrainable(name, f"its joint {joint} follows {one.follows.joint}")
        if one.actuator is None:
            raise _untrainable(name, f"its joint {joint} has no actuator")
    chains = [chain for leg in legs(design) for chain in _of_kind(design, leg)]
    if len(chains) < LEAST_LEGS:
        found = "one leg" if chains else "no legs"
        raise _untrainable(name, f"it has {found} with a knee and a foot")
    return name, sorted(chains, key=lambda chain: chain.foot)


def _of_kind(design: Design, leg: Leg) -> list[Chain]:
    """Legs of one kind."""
    frames = design.frames()
    by_name = {b.prefix + b.joint.name: i for i, b in enumerate(design.bodies) if b.joint}
    chains = []
    for at, foot in enumerate(leg.feet):
        names = tuple(joint.names[at] for joint in leg.joints)
        origin = frames[foot][0]
        position = (scalar(origin[0]), scalar(origin[1]))
        bodies = tuple(by_name[joint] for joint in names)
        chains.append(Chain(names, bodies, leg.joints.index(leg.knee), foot, position))
    return chains


def mirrored_legs(chains: Sequence[Chain], name: str) -> tuple[int, ...]:
    """Index of the leg on the other side, for each leg.

    Raises:
        DraftError: legs are not pairs of a left and a right one.
    """
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


def mirrored_joints(
    design: Design, sides: Sequence[int], chains: Sequence[Chain], name: str
) -> tuple[dict[str, str], dict[str, float]]:
    """For each joint, the one that the mirror image of its motion turns, and with which sign.

    Joints of legs are paired by their place in the leg, others by the line of their axis: the image
    of an anchor is the nearest anchor on its image.

    Returns:
        Name of the other joint, and sign, 1 or -1, by joint.

    Raises:
        DraftError: a joint has no counterpart.
    """
    other: dict[str, str] = {}
    body = {b.prefix + b.joint.name: i for i, b in enumerate(design.bodies) if b.joint}
    for chain, side in zip(chains, sides, strict=True):
        other |= dict(zip(chain.joints, chains[side].joints, strict=True))
    rest = [joint for joint in design.joints if joint not in other]
    for joint in rest:
        image = _image(_axis(design, body[joint]))
        x, y, z = _anchor(design, body[joint])
        away: dict[str, float] = {}
        for k in rest:
            axis = np.array(_axis(design, body[k]))
            far = np.subtract((x, -y, z), _anchor(design, body[k]))
            # Makers put an anchor anywhere along its axis.
            aside = np.linalg.norm(far - (far @ axis) * axis)
            middle = k != joint or abs(y) <= MIDDLE
            if abs(np.dot(image, axis)) > PARALLEL and aside <= APART and middle:
                away[k] = float(np.linalg.norm(far))
        nearest = min(away, key=lambda k: away[k], default="")
        if not nearest:
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


def foot_of(design: Design, chain: Chain) -> tuple[str, str]:
    """Names of the site and the geom of a leg's foot."""
    body = design.bodies[chain.foot]
    end = body.link.end
    if end is None or end.site is None:  # legs end in feet, and feet have sites
        raise _untrainable(design.name, f"the foot of {body.name} has no site")
    return body.prefix + end.site, f"{body.name}_end"


def upper_of(design: Design, chain: Chain) -> tuple[str, ...]:
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


def _untrainable(name: str, cause: str) -> DraftError:
    remedy = (
        "use a robot with left and right legs, each with a knee (a driven hinge of a link of "
        "`segment: shank`) and a foot with a site, whose joints are all driven"
    )
    return DraftError(f"{name} cannot be trained: {cause}", remedy)
