"""From a vendor's description to a tree of rigid bodies, driven hinges and slides.

Passive joints, fingers, linkage bars and the like are held at rest and counted; the tree is turned
so that its root is the body that carries the arms. All positions are those of the zero pose, from
the root body's origin along axes of which z points up.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from draft.description.description import Description, Joint, displaced
from draft.description.xmlfile import DescriptionError
from draft.errors import Problem
from draft.imports.stated import Stated
from draft.laws import joint_roles as roles
from draft.values import Array

# Position [m] and rotation of a frame.
Pose = tuple[Array, Array]
TURN = 2 * math.pi
WIDEST = 1000.0
# Strokes that a slide can have [m]: beyond are rounding, and numbers that stand for no limit.
SHORTEST, LONGEST = 1e-3, 10.0
WEAKEST = 0.001
LISTED = 4
# Most joints below one of a hand: a name such as `middle` may also be that of a trunk's joint.
HAND = 8
SMALL = ("gripper", "thumb", "finger", "jaw", "claw", "palm")


@dataclass(eq=False)
class Body:
    """A rigid body: links that move as one, under one hinge or slide.

    Attributes:
        name: its first link.
        links: its links.
        joint: the joint above it, as the file says it; None for the root.
        anchor: point of the joint from the root's origin, zero pose [m], shape (3,).
        axis: unit vector of positive rotation or motion there, shape (3,).
        limits: lowest and highest angle [rad], or place of a slide [m].
        parent, children: bodies above and below.
        role: what its joint does.
        kind: class of its structural segment; "" for none.
        merged: whether it belongs to its parent's structural segment.
    """

    name: str
    links: list[str]
    joint: Joint | None
    anchor: Array
    axis: Array
    limits: tuple[float, float] = (0.0, 0.0)
    parent: Body | None = None
    children: list[Body] = field(default_factory=list)
    role: str = ""
    kind: str = ""
    merged: bool = False

    def all(self) -> list[Body]:
        """This body and those below it, parents first."""
        found: list[Body] = [self]
        for body in found:
            found.extend(body.children)
        return found

    @property
    def slides(self) -> bool:
        """Whether its joint is prismatic."""
        return self.joint is not None and self.joint.type == "prismatic"

    @property
    def coupled(self) -> bool:
        """Whether its joint follows another one."""
        return self.joint is not None and bool(self.joint.mimics)

    @property
    def driven(self) -> bool:
        """Whether a drive moves it: it has a hinge that follows no other joint."""
        return self.joint is not None and not self.slides and not self.coupled


@dataclass
class Reduced:
    """A vendor's robot, reduced.

    Attributes:
        description: what the file says.
        root: body that the spec's trunk stands for.
        poses: frame of every link from the root's origin, zero pose: position, rotation.
        notes: what was omitted or changed, with file and line.
        counts: how many things of a kind were ignored.
        digits: decimals that lengths are written with [m]; axes have one more.
    """

    description: Description
    root: Body
    poses: dict[str, Pose]
    notes: list[Problem]
    counts: Counter[str]
    digits: int = 5

    @property
    def base(self) -> Pose:
        """Origin of the maker's root link, upright: the base of a model of the maker's robot."""
        return self.poses[self.description.root][0], np.eye(3)


def reduce(
    description: Description,
    key: str,
    population: str,
    stated: Stated | None = None,
    linkage: Collection[str] = (),
    fingers: bool = False,
) -> Reduced:
    """Reduce a description to bodies, driven hinges and slides.

    Args:
        description: the robot.
        key: its key among the surveyed robots, for their rules of roles.
        population: "humanoid" or "quadruped".
        stated: torques that a person states; joints named by them are driven.
        linkage: joints of linkages, which are held.
        fingers: whether fingers move, and joints that mimic others follow them: those of a robot
            with legs are held.

    Raises:
        DescriptionError: numbers that cannot be, or no hinge that is driven.
    """
    counts: Counter[str] = Counter()
    notes = list(description.notes)
    given = (description, key, population, stated or Stated(), linkage)
    held = _held(*given, notes, counts, fingers)
    if not fingers and all(joint.name in held for joint in description.moving):
        # A hand or a finger alone: its fingers are limbs.
        counts, notes = Counter(), list(description.notes)
        held = _held(*given, notes, counts, fingers=True)
    counts["closed loops cut"] += len(description.loops)
    root, poses = rigid_bodies(description, held)
    require_hinge(description, root)
    for body in root.all()[1:]:
        body.limits = _limits(body.joint, notes)
    reduced = Reduced(description, root, poses, notes, counts)
    for name in root.links:
        link = description.links[name]
        if link.inertial is not None or link.geometries:
            # An empty link such as `world` or `base_footprint` gives way to the first real one.
            root.name = name
            reroot(reduced, root)
            break
    return reduced


def require_hinge(description: Description, root: Body) -> None:
    """Refuse a robot without a driven hinge: no actuator class could be made for it."""
    if not any(body.driven for body in root.all()[1:]):
        where = description.links[description.root].where
        hinges = [one for one in description.moving if one.type in ("revolute", "continuous")]
        if hinges:
            cause = "it has no hinge that is driven"
            listed = ", ".join(one.name for one in hinges[:LISTED])
            listed += ", ..." if len(hinges) > LISTED else ""
            remedy = f"state the torque of its hinges, `torque` NAME=VALUE; hinges: {listed}"
        else:
            cause = "it has no hinges: Draft makes robots of links that hinges with drives move"
            remedy = "import a file with limbs on hinges"
        raise DescriptionError(Problem(cause, where, remedy))


def _held(
    description: Description,
    key: str,
    population: str,
    stated: Stated,
    linkage: Collection[str],
    notes: list[Problem],
    counts: Counter[str],
    fingers: bool = False,
) -> set[str]:
    """Joints to hold at zero, each noted or counted; with `fingers`, none for being a finger's."""
    held: set[str] = set()
    silent = not any(_torque_declared(joint) for joint in description.moving)
    for joint in description.joints.values():
        if not joint.moves:
            continue
        small = not fingers and len(_moving_below(description, joint)) <= HAND
        why = _why_held(joint, key, population, small)
        if fingers and why == "mimicking" and joint.ratio:
            why = ""  # Held after all if what it follows is.
        slides = joint.type == "prismatic"
        if joint.name in linkage:
            why = "linkage"
        if why == "passive" and not slides:
            urdf = description.format == "urdf"
            known = urdf and roles.role(joint.name, key, population) is not None
            why = "" if _driven(joint, stated, silent, known) else why
        if not why and slides and not _stroke(joint):
            why = "prismatic"
            said = "no range" if joint.limits is None else "the range [{:g}, {:g}]"
            said = said.format(*(joint.limits or ()))
            cause = f"prismatic joint '{joint.name}' has {said}: it is held at zero"
            remedy = f"usable: a stroke of 1 mm or more, within {LONGEST:g} m of zero"
            notes.append(Problem(cause, joint.where, remedy))
        if why:
            held.add(joint.name)
            counts[f"{why} joints"] += 1
            # In MJCF a joint without an actuator is meant so; a URDF's joint should have an effort.
            if why == "passive" and (joint.effort is not None or description.format == "urdf"):
                effort = "no effort" if joint.effort is None else f"an effort of {joint.effort:g}"
                cause = f"joint '{joint.name}' declares {effort}: it is held"
                allowed = "usable: above 0" if slides else f"usable: {WEAKEST} N m and more, or "
                allowed += "" if slides else f"state it, `torque` {joint.name}=VALUE"
                notes.append(Problem(cause, joint.where, allowed))
    left = {one.name: one.mimics for one in description.moving if one.name not in held}
    moved = {name for name, leader in left.items() if not leader}
    while more := {name for name, leader in left.items() if leader in moved} - moved:
        moved |= more
    if lost := set(left) - moved:  # What they follow is held, or follows them.
        held |= lost
        counts["mimicking joints"] += len(lost)
    return held


def _stroke(joint: Joint) -> bool:
    """Whether a slide has a range that can be."""
    low, high = joint.limits or (0.0, 0.0)
    return high - low >= SHORTEST and max(abs(low), abs(high)) <= LONGEST


def _moving_below(description: Description, joint: Joint) -> list[Joint]:
    """Moving joints below a joint; no more than tell it from a finger's."""
    found: list[Joint] = []
    waiting = [joint.child]
    while waiting and len(found) <= HAND:
        below = description.children[waiting.pop()]
        found += [one for one in below if one.moves]
        waiting += [one.child for one in below]
    return found


def _why_held(joint: Joint, key: str, population: str, small: bool) -> str:
    """Reason to hold a joint; "" to keep it. `small`: it could belong to a finger."""
    for value, what in ((joint.effort, "effort"), (joint.velocity, "velocity")):
        if value is not None and math.isnan(value):
            cause = f"{what} of joint '{joint.name}' is not a number"
            raise DescriptionError(Problem(cause, joint.where))
    role = roles.role(joint.name, key, population)
    if role in ("linkage", "sensor") or (role == "finger" and small):
        return role
    if joint.mimics:
        return "mimicking"
    if small and any(word in joint.name.lower() for word in SMALL):
        return "finger"
    if joint.effort is None or joint.type in ("ball", "planar"):
        return "passive"
    if joint.type == "prismatic":  # a force [N], which the rule for torques does not bound
        return "" if math.isfinite(joint.effort) and joint.effort > 0 else "passive"
    return "" if joint.effort >= WEAKEST else "passive"


def _torque_declared(joint: Joint) -> bool:
    """Whether a hinge of the file has a torque that can be."""
    if joint.type == "prismatic" or joint.effort is None:
        return False
    return math.isfinite(joint.effort) and joint.effort >= WEAKEST


def _driven(joint: Joint, stated: Stated, silent: bool, known: bool) -> bool:
    """Whether a hinge without a torque is driven all the same.

    It is where a person states its torque, where the file has no torque of any hinge, and where a
    URDF omits the effort of a joint that its name gives a role: `known`.
    """
    if joint.type in ("ball", "planar"):
        return False
    if stated.key(joint.name) is not None:
        return True
    if not joint.driven:
        return False
    return silent or (joint.effort is None and known)


def _limits(joint: Joint | None, notes: list[Problem]) -> tuple[float, float]:
    """Range of a hinge [rad], a full turn either way where the file gives none; of a slide [m]."""
    if joint is None or joint.limits is None:
        return (-TURN, TURN)
    low, high = joint.limits
    if joint.type == "prismatic":
        return (low, high)
    cut = (max(low, -2 * TURN), min(high, 2 * TURN))
    wide = max(abs(low), abs(high)) > WIDEST or cut[0] >= cut[1]
    taken = (-TURN, TURN) if wide else cut
    if taken != (low, high):
        fault = "too wide" if low < high else "empty"
        turns = "a turn" if wide else "two turns at most"
        cause = f"range [{low:g}, {high:g}] of joint '{joint.name}' is {fault}: {turns} is taken"
        notes.append(Problem(cause, joint.where))
    return taken


def rigid_bodies(description: Description, held: Collection[str]) -> tuple[Body, dict[str, Pose]]:
    """Merge fixed joints and those to hold; place all from the root link's origin, z upwards."""
    origin: Pose = (np.zeros(3), np.array(description.upright, float))
    poses = {description.root: origin}
    root = Body(description.root, [description.root], None, np.zeros(3), np.zeros(3))
    waiting = [(description.root, root)]
    while waiting:
        link, owner = waiting.pop()
        for joint in reversed(description.children[link]):
            position, rotation = poses[link]
            turned = rotation @ np.array(joint.rotation, float)
            place = position + rotation @ np.array(joint.position, float)
            if joint.type == "floating":
                place, turned = position, rotation
            body = owner
            kept = joint.moves and joint.name not in held
            if joint.moves and not kept and joint.held_at:
                shift, turn = displaced(joint, joint.held_at)
                place, turned = place + turned @ np.array(shift), turned @ np.array(turn)
            poses[joint.child] = (place, turned)
            if kept:
                anchor = place + turned @ np.array(joint.anchor)
                axis = turned @ np.array(joint.axis)
                body = Body(joint.child, [joint.child], joint, anchor, axis, parent=owner)
                owner.children.append(body)
            else:
                owner.links.append(joint.child)
            waiting.append((joint.child, body))
    for body in root.all():
        body.children.sort(key=lambda child: list(description.links).index(child.name))
    return root, poses


def collapse(reduced: Reduced, body: Body, what: str) -> None:
    """Hold everything below a body, and count its joints as `what`."""
    for below in body.all()[1:]:
        body.links += below.links
        reduced.counts[what] += 1
    body.children = []


def reroot(reduced: Reduced, new: Body) -> None:
    """Hang the tree on another body, and express everything from that body's origin.

    A joint seen from its other side turns about, or moves along, the opposite axis.
    """
    way = [new]
    while (above := way[-1].parent) is not None:
        way.append(above)
    hinges = [(body.joint, body.anchor, body.axis, body.limits) for body in way]
    for child, parent in itertools.pairwise(way):
        parent.children.remove(child)
    for i in range(len(way) - 1):
        child, parent = way[i], way[i + 1]
        child.children.append(parent)
        parent.parent = child
        joint, anchor, axis, limits = hinges[i]
        parent.joint, parent.anchor, parent.axis, parent.limits = joint, anchor, -axis, limits
    new.parent, new.joint = None, None
    reduced.root = new
    position, _ = reduced.poses[new.name]
    for body in new.all():
        body.anchor = body.anchor - position
    reduced.poses = {name: (at - position, turn) for name, (at, turn) in reduced.poses.items()}
    new.anchor = np.zeros(3)
