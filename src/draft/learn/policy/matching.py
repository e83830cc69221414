"""Match of the joints of a policy with those of a design, by structure instead of by name.

A joint is known by its place: the side of its leg, the leg's place from front to rear, and the
joint's place from the trunk to the foot. Its axis tells whether it turns the same way. A policy
gives and takes joint angles with the signs of its own robot; whoever runs it with another one
multiplies them by the signs of the match.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from draft.learn.bodies.knees import knee_of

if TYPE_CHECKING:
    import mujoco

    from draft.learn.bodies.legged import LeggedRobot
    from draft.learn.policy.policy import Policy

# Cosine from which two axes count as the same: makers incline them by a few degrees.
_ALIKE = 0.8
_STRAIGHT = 0.05  # Bend below which a knee bends neither way [rad].
_SIDES = {1: "left", -1: "right"}
# Terms of the observations with a number for each joint; that of the angles has none for wheels.
ANGLES = "joint_pos"
OF_JOINTS = (ANGLES, "joint_vel", "actions")
Leg = tuple[int, int]  # Side, 1 for left and -1 for right, and place from the front.


@dataclass(frozen=True)
class Structure:
    """Places and axes of a robot's joints, in an order of joints that its owner states.

    Attributes:
        places: side of the leg (1 left, -1 right), its place from the front, and the joint's place
            from the trunk, for each joint; () for a joint of no leg.
        axes: axis of each joint in the trunk's frame, in the home pose.
        bends: for each joint, the angle of a knee in the home pose about its axis, from the
            straight leg [rad]; 0 for other joints.
        rolls: for each joint, whether it drives a wheel by its speed; () without wheels.
    """

    places: tuple[tuple[int, ...], ...]
    axes: tuple[tuple[float, ...], ...]
    bends: tuple[float, ...]
    rolls: tuple[bool, ...] = ()

    def texts(self) -> dict[str, Sequence[object]]:
        """Entries of a policy's metadata but `rolls`; none where a joint is on no leg."""
        if not all(self.places):
            return {}
        return {
            "joint_places": [list(place) for place in self.places],
            "joint_axes": [list(axis) for axis in self.axes],
            "joint_bends": list(self.bends),
        }

    @staticmethod
    def of_texts(texts: Mapping[str, str]) -> Structure | None:
        """Return the structure of a policy's metadata; None if it has none.

        Raises:
            KeyError, ValueError: entries are missing or no numbers.
        """
        if "joint_places" not in texts:
            return None
        places, axes = (
            [part.split(";") for part in texts[f"joint_{name}"].split(",")]
            for name in ("places", "axes")
        )
        return Structure(
            tuple(tuple(map(int, place)) for place in places),
            tuple(tuple(map(float, axis)) for axis in axes),
            tuple(map(float, texts["joint_bends"].split(","))),
            rolls_of_texts(texts),
        )

    def legs(self) -> dict[Leg, list[int]]:
        """Joints of each leg from the trunk outwards, legs from the front, left before right."""
        found: dict[Leg, list[tuple[int, int]]] = {}
        for joint, place in enumerate(self.places):
            if place:
                found.setdefault((place[0], place[1]), []).append((place[2], joint))
        order = sorted(found, key=lambda leg: (leg[1], -leg[0]))
        return {leg: [joint for _, joint in sorted(found[leg])] for leg in order}


@dataclass(frozen=True)
class Match:
    """Joints of a design for the joints of a policy.

    Attributes:
        joints: index of the design's joint, for each joint of the policy.
        sign: for each joint of the policy, -1 if the design's joint turns the other way.
    """

    joints: tuple[int, ...]
    sign: tuple[float, ...]

    @staticmethod
    def of_equals(joints: int) -> Match:
        """Return the match of a robot with itself."""
        return Match(tuple(range(joints)), (1.0,) * joints)

    @property
    def inverse(self) -> Match:
        """Match of the policy's joints for those of the design."""
        order = np.argsort(self.joints)
        return Match(tuple(order.tolist()), tuple(np.array(self.sign)[order].tolist()))

    def entries(
        self, term: str, rolls: Sequence[bool], length: int
    ) -> tuple[list[int], list[float]]:
        """Entries of a term of the design's observation in the order of the policy, and signs.

        Args:
            term: one of `OF_JOINTS`.
            rolls: for each joint of the design, whether it drives a wheel; () without wheels.
            length: number of entries: with a history, a multiple of those of one step.
        """
        left_out = {j for j, one in enumerate(rolls) if one} if term == ANGLES else set()
        at = {j: i for i, j in enumerate(sorted({*self.joints} - left_out))}
        chosen = [(at[j], s) for j, s in zip(self.joints, self.sign, strict=True) if j in at]
        steps = range(0, length, len(chosen))
        return [start + i for start in steps for i, _ in chosen], [s for _, s in chosen] * len(
            steps
        )

    @property
    def same(self) -> bool:
        """Whether the design has the policy's joints in the policy's order and directions."""
        return self == Match.of_equals(len(self.joints))

    def taken(self, values: Sequence[float]) -> NDArray[np.float64]:
        """Numbers of the design's joints in the order of the policy, shape (joints,)."""
        return np.array(values, float)[list(self.joints)]


def structure_of(member: LeggedRobot, model: mujoco.MjModel | None = None) -> Structure:
    """Return the structure of a robot, joints in its own order.

    Args:
        member: the robot.
        model: its model; None to compile it.
    """
    import mujoco

    from draft.model import pose

    model = model or mujoco.MjModel.from_xml_string(member.xml)
    data = mujoco.MjData(model)
    pose.put(model, data, member.home)
    ids = [model.joint(name).id for name in member.joints]
    axes, anchors = data.xaxis[ids], data.xanchor[ids]
    feet = np.array([data.site_xpos[model.site(name).id] for name in member.feet])
    places: list[tuple[int, ...]] = [()] * len(ids)
    bends = [0.0] * len(ids)
    for leg, joints in enumerate(member.leg_joints):
        side = 1 if feet[leg, 1] > 0 else -1
        ahead = (feet[:, 0] > feet[leg, 0]) & (np.sign(feet[:, 1]) == side)
        for place, joint in enumerate(joints):
            places[joint] = (side, int(ahead.sum()), place)
        points = np.array([*anchors[list(joints)], feet[leg]])
        knee, bend = knee_of(points, axes[list(joints)])
        bends[joints[knee]] = bend
    axes = tuple(map(tuple, axes.tolist()))
    return Structure(tuple(places), axes, tuple(bends), member.rolls)


def rolls_of_texts(texts: Mapping[str, str]) -> tuple[bool, ...]:
    """Mask of the joints that drive wheels, of a policy's metadata; () if it has none.

    Raises:
        ValueError: entries are no numbers.
    """
    if "joint_rolls" not in texts:
        return ()
    return tuple(bool(int(x)) for x in texts["joint_rolls"].split(","))


def match_of(policy: Policy, member: LeggedRobot) -> Match | str:
    """Match the joints of a policy with those of a robot; a clause says why it cannot."""
    own = structure_of(member)
    return match(policy.joints, trained_structure(policy), member.joints, own)


def trained_structure(policy: Policy) -> Structure | None:
    """Structure of the robot that a policy was trained with; None if it is unknown.

    Files that do not state it, such as those that ship, have that of the shipped quadruped if
    their joints have its names.
    """
    if policy.structure is not None:
        return policy.structure
    joints, structure = _shipped_structure()
    return structure if policy.joints == joints else None


@lru_cache(maxsize=1)
def _shipped_structure() -> tuple[tuple[str, ...], Structure]:
    from draft.learn.bodies.legged import legged_robot
    from draft.learn.policy.policy import ROBOT
    from draft.spec import load

    robot = legged_robot(load(ROBOT).resolve())
    return robot.joints, structure_of(robot)


def match(
    joints: Sequence[str], theirs: Structure | None, names: Sequence[str], own: Structure
) -> Match | str:
    """Match the joints of a policy with those of a design.

    Robots with joints on no leg, such as arms, and policies of unknown structure are matched by
    the names of the joints.

    Args:
        joints: names of the policy's joints.
        theirs: their structure; None if it is unknown.
        names: names of the design's joints.
        own: their structure.

    Returns:
        The match, or the reason why the policy does not drive the design, as a clause.
    """
    if theirs is None or not all(theirs.places):
        if tuple(joints) == tuple(names):
            return Match.of_equals(len(names))
        known = ", ".join(joints[:3]) + (" and so on" if len(joints) > 3 else "")
        return f"the policy drives {known}, and joints of these names only"
    if reason := _other_legs(theirs, own, names):
        return reason
    legs = own.legs()
    at = {
        joint: legs[leg][i] for leg, ones in theirs.legs().items() for i, joint in enumerate(ones)
    }
    order = [at[joint] for joint in range(len(names))]
    if reason := _other_wheels(theirs, own, order, names):
        return reason
    cosines = (np.array(theirs.axes) * np.array(own.axes)[order]).sum(axis=1)
    sign = np.where(cosines < 0, -1.0, 1.0)
    crossed = [names[order[i]] for i in np.flatnonzero(np.abs(cosines) < _ALIKE)]
    if crossed:
        return f"{_listed(crossed)} would turn about another axis than in the policy's training"
    known, bends = np.array(theirs.bends), sign * np.array(own.bends)[order]
    turned = (known * bends < 0) & (np.minimum(abs(known), abs(bends)) > _STRAIGHT)
    if turned.any():
        knees = _listed([names[order[i]] for i in np.flatnonzero(turned)])
        return f"in the home pose, {knees} would bend the other way than in the policy's training"
    return Match(tuple(order), tuple(sign.tolist()))


def _other_legs(theirs: Structure, own: Structure, names: Sequence[str]) -> str:
    """How the legs of a design differ from those that a policy drives; "" if they do not."""
    expected, found = theirs.legs(), own.legs()
    if len(expected) != len(found):
        return f"the robot has {len(found)} legs, and the policy drives {len(expected)}"
    for leg, ones in expected.items():
        if leg not in found:
            count, needed = (sum(one[0] == leg[0] for one in legs) for legs in (found, expected))
            side = f"on the {_SIDES[leg[0]]}"
            return f"the robot has {count} legs {side}, and the policy drives {needed} there"
        if len(found[leg]) != len(ones):
            listed = ", ".join(names[joint] for joint in found[leg])
            return (
                f"a leg of the robot has {len(found[leg])} joints ({listed}), and the policy "
                f"drives {len(ones)} of such a leg"
            )
    others = [name for name, place in zip(names, own.places, strict=True) if not place]
    if others:
        return f"the robot has {_listed(others)} besides its legs, which the policy does not drive"
    return ""


def _other_wheels(
    theirs: Structure, own: Structure, order: Sequence[int], names: Sequence[str]
) -> str:
    """Which joint is driven to an angle by one and to a speed by the other; "" if none is."""
    for joint, at in enumerate(order):
        known, found = (any(one.rolls) and one.rolls[j] for one, j in ((theirs, joint), (own, at)))
        if known != found:
            said = "a speed", "an angle"
            given, needed = said if known else said[::-1]
            return f"the policy gives {names[at]} {given}, and the robot drives it to {needed}"
    return ""


def _listed(names: Sequence[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
