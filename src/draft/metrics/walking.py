"""Torques and joint speeds of a walking robot, from the statics of the crouch.

In motion half of the legs carry the robot at a time, so a foot bears twice its force when standing,
for half of a stride. The joints of a leg move its foot backwards at the speed of the robot without
lifting it, by the smallest joint speeds that do.
"""

from __future__ import annotations

from draft.design.legs import GRAVITY
from draft.design.loads import LegLoad
from draft.values import Value, divide

# Share of a stride that a foot is on the ground while walking or trotting.
DUTY = 0.5


def swing_torque(load: LegLoad) -> Value:
    """Torque of a joint while its leg is in the air [N m]: the weight of the leg alone."""
    return GRAVITY * load.joint.hang


def stance_torque(load: LegLoad, mass: Value, share: Value = DUTY) -> Value:
    """Torque of a joint while its foot carries [N m].

    Args:
        load: load of the joint in the crouch, on all legs.
        mass: mass added to the trunk [kg].
        share: share of the legs that carry at a time [1].
    """
    swing = swing_torque(load)
    return swing + (load.torque - swing + mass * load.per_mass) / share


def joint_rate(load: LegLoad, of: tuple[LegLoad, ...]) -> Value:
    """Speed of a joint per forward speed of the robot [rad/m].

    The smallest joint speeds q' with sum of sweep q' = 1 and sum of lift q' = 0.

    Args:
        load: load of the joint.
        of: loads of all joints.
    """
    joints = [x.joint for x in of if x.leg is load.leg]
    xx = sum((j.sweep * j.sweep for j in joints), 0.0)
    xz = sum((j.sweep * j.lift for j in joints), 0.0)
    zz = sum((j.lift * j.lift for j in joints), 0.0)
    sweep, lift = load.joint.sweep, load.joint.lift
    return divide(sweep * zz - lift * xz, xx * zz - xz * xz)
