"""Closed loops of a robot: which branch is a linkage, and the joints that its drives move.

The tree is cut where a loop closes. Of the two branches of a loop, one is a part of a limb; the
other is a linkage, and is held. Where a linkage has drives and the limb's joints in the loop have
none, these joints get them. Torques and speeds follow from the loops' constraint J dq = 0, at the
pose in which the file shows the robot.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from draft.description.description import Description, Joint, Loop
from draft.errors import Problem, listed
from draft.imports.reduce import WEAKEST, Pose, rigid_bodies
from draft.values import Array

LISTED = 4
# Largest error of the constraint, relative to the drives' motion, of a loop that closes [1].
CLOSED = 1e-3
# Largest transmission ratio: beyond, the linkage is near a dead centre as the file shows it.
MOST = 10.0
NEGLIGIBLE = 1e-6
HINGES = ("revolute", "continuous")
FOLLOWED = (*HINGES, "prismatic", "ball")


@dataclass(frozen=True)
class Opened:
    """A description whose loops are cut.

    Attributes:
        description: the robot, with the drives where they act.
        linkage: joints of the linkages, which are held.
        carried: joints that a drive on a linkage moves, with the names of those drives.
        cranks: joints that a linkage moves, with the name of the crank at whose hinge the drive
            sits: a drive of its own of a joint that closes a loop with a linkage sits there too.
        lost: drives on linkages that move nothing now, with why.
    """

    description: Description
    linkage: frozenset[str]
    carried: Mapping[str, tuple[str, ...]]
    cranks: Mapping[str, str]
    lost: Mapping[str, str]

    def notes(self, kept: Collection[str]) -> list[Problem]:
        """Note every loop that is cut, and what is lost by it.

        Args:
            kept: names of the joints that are not held.
        """
        found: list[Problem] = []
        for loop in self.description.loops:
            name = f" '{loop.name}'" if loop.name else ""
            cause = f"closed loop{name} between '{loop.links[0]}' and '{loop.links[1]}' is cut"
            found.append(Problem(cause, loop.where, "; ".join(self._lost(loop, kept))))
        return found

    def _lost(self, loop: Loop, kept: Collection[str]) -> list[str]:
        """Changes that cutting one loop makes."""
        said: list[str] = []
        joints = self.description.between(*loop.links)
        for joint in joints:
            for drive in self.carried.get(joint.name, ()):
                said.append(f"the drive of '{drive}' moves '{joint.name}' instead")
            crank = self.cranks.get(joint.name)
            if crank is not None and joint.name not in self.carried:
                said.append(f"the drive of '{joint.name}' sits where '{crank}' turns")
            if joint.name in self.lost:
                said.append(f"the drive of '{joint.name}' is left out: {self.lost[joint.name]}")
        if loop.effort:
            said.append(f"the drive of the joint that is cut, {loop.effort:g} N m, is left out")
        held = [joint for joint in joints if joint.name not in kept]
        if held:
            where = listed([f"'{joint.name}' at {joint.held_at:.3g}" for joint in held], LISTED)
            said.append(f"held, so that the linkage does not move: {where}")
        return said or ["its joints move independently of each other"]


@dataclass(frozen=True, slots=True)
class _Branches:
    """A loop with a linkage: moving joints of the limb and of the linkage."""

    loop: Loop
    limb: tuple[Joint, ...]
    linkage: tuple[Joint, ...]


@dataclass
class _Mechanism:
    """Loops that share joints."""

    loops: list[_Branches]
    names: set[str] = field(default_factory=set)

    @cached_property
    def limb(self) -> list[Joint]:
        """Joints of the limb."""
        return _distinct(joint for one in self.loops for joint in one.limb)

    @cached_property
    def linkage(self) -> list[Joint]:
        """Joints of the linkages."""
        own = {joint.name for joint in self.limb}
        every = _distinct(joint for one in self.loops for joint in one.linkage)
        return [joint for joint in every if joint.name not in own]


def open_loops(description: Description, ends: Collection[str]) -> Opened:
    """Hold the linkages of closed loops, and give their drives to the joints that they move.

    Args:
        description: the robot, its loops cut.
        ends: links of the last bodies of its legs.
    """
    linkage: set[str] = set()
    carried: dict[str, tuple[str, ...]] = {}
    lost: dict[str, str] = {}
    cranks: dict[str, str] = {}
    joints = dict(description.joints)
    found = [one for loop in description.loops if (one := _branches(description, loop, ends))]
    poses = _shown(description) if found else {}
    for one in _mechanisms(found):
        linkage.update(joint.name for joint in one.linkage)
        drives = [joint for joint in one.linkage if _driven(joint)]
        cranks |= _cranks(one)
        moved = [joint for joint in one.limb if joint.type in HINGES and not _driven(joint)]
        if not drives:
            continue
        ratios, why = _ratios(one, drives, moved, poses)
        lost |= {joint.name: why for joint in drives if why}
        for joint, row in zip(moved, ratios, strict=False):
            joints[joint.name] = _with_drive(joint, drives, row)
            near = [d.name for d, x in zip(drives, row, strict=True) if abs(x) > NEGLIGIBLE]
            carried[joint.name] = tuple(near)
            cranks[joint.name] = near[0]
    description = replace(description, joints=joints)
    return Opened(description, frozenset(linkage), carried, cranks, lost)


def _cranks(one: _Mechanism) -> dict[str, str]:
    """Crank of each driven joint that a linkage moves alone."""
    return {
        loop.limb[0].name: loop.linkage[-1].name
        for loop in one.loops
        if len(loop.limb) == 1 and len(loop.linkage) > 1 and _driven(loop.limb[0])
        if loop.linkage[-1].type in HINGES
    }


def _branches(description: Description, loop: Loop, ends: Collection[str]) -> _Branches | None:
    """Branch of a loop that is a linkage; None if neither is."""
    ways = description.branches(*loop.links)
    if not all(any(joint.moves for joint in way) for way in ways):
        return None
    below = [_below(description, way[-1].child) for way in ways]
    legs = [any(link in ends for link in links) for links in below]
    if all(legs):
        return None
    inside = {joint.name for way in ways for joint in way}
    beyond = [
        sum(j.moves and j.name not in inside for link in links for j in description.children[link])
        for links in below
    ]
    drives = [sum(map(_driven, way)) for way in ways]
    limb = max((0, 1), key=lambda k: (legs[k], beyond[k], -drives[k], k))
    if any(
        _driven(joint) and not _closes(description, joint)
        for link in below[1 - limb]
        for joint in description.children[link]
        if joint.name not in inside
    ):
        return None  # It carries a limb of its own.
    moving = [tuple(joint for joint in way if joint.moves) for way in ways]
    return _Branches(loop, moving[limb], moving[1 - limb])


def _closes(description: Description, joint: Joint) -> bool:
    """Whether a joint is on a loop."""
    return any(joint in description.between(*loop.links) for loop in description.loops)


def _below(description: Description, link: str) -> list[str]:
    """A link and those that hang on it."""
    found = [link]
    for name in found:
        found += [joint.child for joint in description.children[name]]
    return found


def _mechanisms(found: Sequence[_Branches]) -> list[_Mechanism]:
    """Group loops that share joints."""
    groups: list[_Mechanism] = []
    for one in found:
        names = {joint.name for joint in (*one.limb, *one.linkage)}
        shared = [group for group in groups if group.names & names]
        rest = [group for group in groups if group not in shared]
        loops = [loop for group in shared for loop in group.loops]
        groups = [*rest, _Mechanism([*loops, one], names.union(*(g.names for g in shared)))]
    return groups


def _driven(joint: Joint) -> bool:
    """Whether the file gives a joint a drive."""
    return bool(joint.moves and not joint.mimics and joint.effort and joint.effort >= WEAKEST)


def _shown(description: Description) -> dict[str, Pose]:
    """Frames of all links in the pose in which the file shows the robot."""
    free = {name: replace(joint, limits=None) for name, joint in description.joints.items()}
    return rigid_bodies(replace(description, joints=free), free)[1]


def _ratios(
    one: _Mechanism, drives: Sequence[Joint], moved: Sequence[Joint], poses: Mapping[str, Pose]
) -> tuple[Array, str]:
    """Motion of each drive per motion of each joint moved, shape (joints, drives), or why not."""
    none = np.zeros((0, len(drives)))
    if not moved:
        return none, f"'{one.limb[0].name}' has a drive of its own"
    remedy = f"`torque` {moved[0].name}=VALUE drives a joint of the limb"
    if len(moved) != len(drives):
        count = f"the loop has {len(drives)} such drives and {len(moved)} joints to move"
        return none, f"{count}; {remedy}"
    passive = [joint for joint in (*one.limb, *one.linkage) if not _driven(joint)]
    others = [joint for joint in passive if joint not in moved]
    if any(one.type not in FOLLOWED for one in others) or any(d.type == "ball" for d in drives):
        return none, f"joints of such types are not followed; {remedy}"
    driving = _jacobian(one, drives, poses)
    moving = _jacobian(one, [*moved, *others], poses)
    if not (np.isfinite(driving).all() and np.isfinite(moving).all()):
        return none, f"its geometry has no numbers; {remedy}"
    inverse = np.linalg.pinv(moving, rcond=NEGLIGIBLE)
    motion = -inverse @ driving
    own = motion[: len(moved)]
    open_ = np.abs(moving @ motion + driving).max() > CLOSED * np.abs(driving).max()
    loose = np.abs((np.eye(moving.shape[1]) - inverse @ moving)[: len(moved)]).max() > CLOSED
    if open_ or loose or np.linalg.cond(own) > 1 / CLOSED:
        return none, f"the loop does not tell how it moves the limb; {remedy}"
    ratios = np.asarray(np.linalg.inv(own).T, dtype=np.float64)
    if np.abs(ratios).max() > MOST or np.abs(own).max() > MOST:
        return none, f"the linkage is near a dead centre as the file shows it; {remedy}"
    return ratios, ""


def _jacobian(one: _Mechanism, joints: Sequence[Joint], poses: Mapping[str, Pose]) -> Array:
    """Gap of each loop per motion of joints, shape (rows, columns) [m, rad]."""
    rows: list[Array] = []
    for branch in one.loops:
        at, turn = poses[branch.loop.links[0]]
        point = at + turn @ np.array(branch.loop.anchor)
        columns: list[Array] = []
        for joint in joints:
            sign = (joint in branch.limb) * 1.0 - (joint in branch.linkage) * 1.0
            columns += [sign * column for column in _columns(joint, poses, point)]
        both = np.stack(columns, axis=1)
        rows.append(both if branch.loop.rigid else both[:3])
    return np.concatenate(rows)


def _columns(joint: Joint, poses: Mapping[str, Pose], point: Array) -> list[Array]:
    """Linear and angular velocity of a point, for each way in which a joint moves."""
    at, turn = poses[joint.child]
    axis = turn @ np.array(joint.axis)
    if joint.type == "prismatic":
        return [np.concatenate([axis, np.zeros(3)])]
    arm = point - at - turn @ np.array(joint.anchor)
    axes = np.eye(3) if joint.type == "ball" else axis[None]
    return [np.concatenate([np.cross(one, arm), one]) for one in axes]


def _with_drive(joint: Joint, drives: Sequence[Joint], ratios: Array) -> Joint:
    """Give a joint the torque of the drives that move it, and the speed of the slowest [rad/s]."""
    acting = [
        (drive, abs(float(ratio)))
        for drive, ratio in zip(drives, ratios, strict=True)
        if abs(ratio) > NEGLIGIBLE
    ]
    effort = sum(ratio * (drive.effort or 0.0) for drive, ratio in acting)
    speeds = [drive.velocity / ratio for drive, ratio in acting if drive.velocity]
    speed = min(speeds) if len(speeds) == len(acting) else None
    effort = float(f"{effort:.4g}") if math.isfinite(effort) else effort
    return replace(joint, effort=effort, velocity=speed, driven=True)


def _distinct(joints: Iterable[Joint]) -> list[Joint]:
    """Joints, each once."""
    return list({joint.name: joint for joint in joints}.values())
