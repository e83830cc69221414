"""Static torques of the joints of legs, in the crouch and at home, and of those on a fixed base.

The robot stands on all its legs. The floor pushes up with the same force on every foot, at the end
of the last link of the leg. The position of the centre of mass between the feet is neglected, and
so are friction forces between the feet. The weight of the links of the legs is included.

The torque of a joint is tau = sum of m g dz/dq over what it moves - F dz_foot/dq, with F = M g / n
(Murray, Li, Sastry: A Mathematical Introduction to Robotic Manipulation, 1994, section 3.4).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from draft.design.actuators import Actuator
from draft.design.cached import once
from draft.design.design import Design
from draft.design.legs import GRAVITY, Leg, LegJoint, held_joints, home_joints, legs, runs_of_legs
from draft.values import Value


@dataclass(frozen=True, slots=True)
class Load:
    """Static load of a driven joint.

    Attributes:
        joint: the joint.
        actuator: its actuator.
        torque: torque that holds the robot [N m].
        per_mass: additional torque per mass added to the trunk [N m/kg].
    """

    joint: LegJoint
    actuator: Actuator
    torque: Value
    per_mass: Value


@dataclass(frozen=True, slots=True)
class LegLoad(Load):
    """Static load of a driven joint in the crouch, with its kind of leg."""

    leg: Leg


@once
def loads(design: Design) -> tuple[LegLoad, ...]:
    """Static loads of the driven joints of all kinds of leg in the crouch."""
    found = legs(design)
    n = sum(leg.copies for leg in found)
    return tuple(
        LegLoad(load.joint, load.actuator, load.torque, load.per_mass, leg)
        for leg in found
        for load in _loads(design, leg.joints, n)
    )


@once
def home_loads(design: Design) -> tuple[Load, ...]:
    """Static loads of the driven joints in the home pose: of the legs, or on a fixed base."""
    if not design.floating:
        return tuple(_loads(design, held_joints(design), 1))
    kinds = runs_of_legs(design)
    n = sum(len(runs) for runs in kinds)
    return tuple(load for runs in kinds for load in _loads(design, home_joints(design, runs), n))


def _loads(design: Design, joints: Iterable[LegJoint], n: int) -> Iterator[Load]:
    for joint in joints:
        if joint.actuator is None:
            continue
        per_mass = joint.lift * (-GRAVITY / n)
        torque = GRAVITY * joint.hang + design.mass * per_mass
        yield Load(joint, joint.actuator, torque, per_mass)
