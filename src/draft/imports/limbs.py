"""Limbs of a robot and its population, from its structure alone: no name and no mass counts.

A limb is what hangs below the central bodies: the root, and those that carry ends on both sides,
such as a waist. A limb is a leg if it reaches the ground in the zero pose, each joint inside its
limits, or is built like one that does; a robot whose zero pose is flat, like many with six legs,
has legs if all of its limbs come in mirrored pairs and can reach below it.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from draft.description.description import Description
from draft.geometry import IDENTITY, Matrix
from draft.imports.reduce import Body, Pose, rigid_bodies
from draft.imports.shapes import corners
from draft.values import Array

# A limb that reaches the ground ends lower than the trunk by so much of its length, and within so
# much of the way down of the lowest one.
DEPTH, LEVEL = 0.35, 0.25
# Shortest leg, as a share of the robot's height: casters are shorter.
SHORTEST = 0.2
# Largest difference of two limbs that are built alike, as a share of their length.
ALIKE = 0.1
# Ends nearer to the middle plane than this share of the robot's size are on neither side.
MIDDLE = 0.02
# Largest distance of a limb from the reflection of its pair, as a share of the robot's size.
MIRRORED = 0.03
# A foot points backwards if its middle lies behind its joint by this share of its length.
BEHIND = 0.1
HINGES, ARM_HINGES, PAIRED = 2, 3, 4
SAMPLES = 100
TURN = np.pi
# Rotations that turn an axis upwards, by the axis: y is up in biomechanics and in graphics.
# FACING turns y forwards.
UPWARD: dict[str, Matrix] = {
    "y": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "-y": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
}
ABOUT: Matrix = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
FACING: Matrix = ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
NO_REACH = "no limb reaches the ground"
NO_LEGS = f"{NO_REACH}; the structure trends do not apply"
MANIPULATOR = "humanoid"


@dataclass(frozen=True, slots=True)
class Limbs:
    """Limbs of a robot, told by structure.

    Attributes:
        population: whose structure trends hold.
        reason: why, in one line.
        ends: links of the last bodies of the legs.
        central: links of the bodies that carry ends on both sides, such as a waist.
        legs: number of legs.
        arms: number of other limbs of three joints or more.
    """

    population: str
    reason: str
    ends: frozenset[str]
    central: frozenset[str]
    legs: int
    arms: int


@dataclass(frozen=True, slots=True)
class _Limb:
    """One limb in a pose: its bodies from the trunk to its lowest end, and how far they reach.

    Attributes:
        way: bodies from the trunk to the end.
        lengths: distances between their joints, then from the last one to its end [m].
        bottom: height of its lowest point [m].
    """

    way: tuple[Body, ...]
    lengths: tuple[float, ...]
    bottom: float

    @property
    def length(self) -> float:
        """Length along its joints [m]."""
        return sum(self.lengths)

    def like(self, other: _Limb) -> bool:
        """Whether it has as many joints as another limb, at like distances."""
        if len(self.lengths) != len(other.lengths):
            return False
        gap = np.abs(np.subtract(self.lengths, other.lengths)).max()
        return bool(gap <= ALIKE * max(self.length, other.length))


def upright(description: Description) -> tuple[Description, str]:
    """Turn a robot that lies or faces sideways in its file onto its feet.

    A file without a world has its robot in the axes of its root link. Where no limb reaches the
    ground along -z, but a mirrored pair does along another axis, that axis points down; a robot
    with two legs faces along x, where its feet reach further from the ankle.

    Returns:
        The description, turned where it had to be, and which axis of it is up or forward; "".
    """
    legs, axis = _Skeleton(description).legs()[0], ""
    if not legs and not description.floats:
        for (name, rotation), facing in itertools.product(UPWARD.items(), (IDENTITY, FACING)):
            turned = description.turn(rotation).turn(facing)
            legs = _Skeleton(turned).standing()
            if len(legs) > 1:
                description, axis = turned, f"{name} axis points up"
                break
    if len(legs) == 2:
        apart = np.abs(legs[0].way[0].anchor - legs[1].way[0].anchor)
        if apart[0] > 2 * apart[1]:
            description, axis = description.turn(FACING), axis or "y axis points forward"
        if _Skeleton(description).faces_backwards():
            description, axis = description.turn(ABOUT), axis or "-x axis points forward"
    return description, axis


def find_limbs(description: Description, wanted: str | None = None) -> Limbs:
    """Find legs and arms, and the population that the structure trends are taken from.

    Args:
        description: the robot.
        wanted: population that the user states; default the one that the limbs imply.
    """
    skeleton = _Skeleton(description)
    legs, others = skeleton.legs()
    arms = sum(sum(not body.slides for body in limb.way) >= ARM_HINGES for limb in others)
    ends = frozenset(link for limb in legs for link in limb.way[-1].links)
    population = "quadruped" if len(legs) > 2 else "humanoid"
    reason = _reason(len(legs), arms, population)
    if not legs:
        population, reason = MANIPULATOR, NO_LEGS
    if wanted is not None and wanted != population:
        reason = f"stated by `population`; by its structure: {reason}"
    elif wanted is not None and legs:
        reason = f"stated by `population`, as by its structure: {reason}"
    return Limbs(wanted or population, reason, ends, skeleton.central(), len(legs), arms)


def _reason(legs: int, arms: int, population: str) -> str:
    count = {1: "one limb reaches", 2: "two limbs reach", 4: "four limbs reach"}
    words = f"{count.get(legs, f'{legs} limbs reach')} the ground"
    if arms:
        words += f", {arms} other{'s do' if arms > 1 else ' does'} not"
    if legs not in (2, 4):
        words += f": the trends of {population}s are the nearest"
    return words


class _Skeleton:
    """Rigid bodies of a description, all joints movable, and poses of them."""

    def __init__(self, description: Description) -> None:
        hinges = ("revolute", "continuous", "prismatic")
        held = {j.name for j in description.moving if j.mimics or j.type not in hinges}
        self.description = description
        self.root, self.poses = rigid_bodies(description, held)
        self.floats = description.floats
        while len(self.root.children) == 1 and not self._is_real(self.root):
            # Joints of the world, such as a virtual base's, carry the robot.
            self.root, self.floats = self.root.children[0], True
        self.bodies = self.root.all()
        self.points = {body: self._points(body) for body in self.bodies}
        every = np.concatenate(
            [*self.points.values(), *(body.anchor[None] for body in self.bodies)]
        )
        self.size = float(np.linalg.norm(np.ptp(every, axis=0)))
        self.height = float(np.ptp(every[:, 2]))

    def _is_real(self, body: Body) -> bool:
        links = [self.description.links[name] for name in body.links]
        return any(link.inertial is not None or link.geometries for link in links)

    def _points(self, body: Body) -> Array:
        """Points of a body at zero [m]: centres of mass, shapes and frames, shape (n, 3).

        A frame counts where the link has nothing else, and at the end of a limb: the frame of a
        trunk may lie anywhere.
        """
        found: list[Array] = []
        for name in body.links:
            at, turn = self.poses[name]
            link = self.description.links[name]
            own: list[Array] = []
            if link.inertial is not None and link.inertial.mass > 0:
                own.append(at[None] + turn @ np.array(link.inertial.com))
            for shape in link.geometries:
                box = corners(shape)
                if box is not None:
                    own.append(box @ turn.T + at)
            if not body.children or (not own and (link.inertial is not None or link.geometries)):
                own.append(at[None])
            found += own
        return np.concatenate(found) if found else body.anchor[None]

    def legs(self) -> tuple[list[_Limb], list[_Limb]]:
        """Legs, and the limbs that are none."""
        for share in (None, 0.5):
            limbs = self.limbs(self.frames(self.middle(share)))
            legs = self.grounded(limbs)
            if legs and (share is None or self.mirrored(legs)):
                return self.completed(legs, limbs)
        limbs = self.limbs(self.frames(self.middle(None)))
        if self.paired(limbs) and self.reach_down(limbs):
            return limbs, []
        return [], limbs

    def faces_backwards(self) -> bool:
        """Whether the feet of two legs, longer than high, reach further behind than ahead."""
        feet = [self.points[leg.way[-1]] - leg.way[-1].anchor for leg in self.legs()[0]]
        if len(feet) != 2:
            return False
        length, _, height = np.mean([np.ptp(foot, axis=0) for foot in feet], axis=0)
        ahead = np.mean([foot[:, 0].mean() for foot in feet])
        return bool(length > height and ahead < -BEHIND * length)

    def standing(self) -> list[_Limb]:
        """Legs that reach the ground in the zero pose, all in mirrored pairs."""
        limbs = self.limbs(self.frames(self.middle(None)))
        legs = self.completed(self.grounded(limbs), limbs)[0]
        return legs if self.mirrored(legs) else []

    def middle(self, share: float | None) -> dict[Body, float]:
        """Joint positions: zero inside the limits, or so far between them."""
        found: dict[Body, float] = {}
        for body in self.bodies:
            joint = body.joint
            low, high = (joint.limits if joint is not None else None) or (0.0, 0.0)
            wide = not low < high or max(abs(low), abs(high)) > 2 * TURN
            if wide:
                found[body] = 0.0
            else:
                found[body] = min(max(0.0, low), high) if share is None else (low + high) * share
        return found

    def frames(self, positions: dict[Body, float]) -> dict[Body, Pose]:
        """Displacement of each body from the zero pose: position and rotation."""
        found: dict[Body, Pose] = {self.root: (np.zeros(3), np.eye(3))}
        for body in self.bodies[1:]:
            assert body.parent is not None
            at, turn = found[body.parent]
            q = positions[body]
            if body.slides:
                found[body] = (at + turn @ (q * body.axis), turn)
            else:
                own = _rotation(body.axis, q)
                found[body] = (at + turn @ (body.anchor - own @ body.anchor), turn @ own)
        return found

    def limbs(self, frames: dict[Body, Pose]) -> list[_Limb]:
        """Limbs in a pose, each to its lowest end."""
        central = self.spine(frames)
        return [
            self.limb(child, frames)
            for body in self.bodies
            if body in central
            for child in body.children
            if child not in central
        ]

    def spine(self, frames: dict[Body, Pose]) -> set[Body]:
        """The root and the bodies that carry ends on both sides of the middle plane."""
        sides: dict[Body, set[int]] = {}
        for body in reversed(self.bodies):
            own = set[int]().union(*(sides[child] for child in body.children))
            if not body.children:
                y = float(np.mean(_moved(self.points[body], frames[body])[:, 1]))
                own.add(0 if abs(y) < MIDDLE * self.size else 1 if y > 0 else -1)
            sides[body] = own
        return {body for body in self.bodies if {-1, 1} <= sides[body]} | {self.root}

    def central(self) -> frozenset[str]:
        """Links of the spine in the zero pose."""
        bodies = self.spine(self.frames(self.middle(None)))
        return frozenset(link for body in bodies for link in body.links)

    def limb(self, first: Body, frames: dict[Body, Pose]) -> _Limb:
        """Limb from its first body to its lowest end."""
        ends = [body for body in first.all() if not body.children]
        end = min(ends, key=lambda body: self.low(body, frames))
        way = [end]
        while way[0] is not first:
            assert way[0].parent is not None
            way.insert(0, way[0].parent)
        anchors = [body.anchor for body in way]
        lengths = [float(np.linalg.norm(b - a)) for a, b in itertools.pairwise(anchors)]
        reach = np.linalg.norm(self.points[end] - end.anchor, axis=1).max()
        return _Limb(tuple(way), (*lengths, float(reach)), self.low(end, frames))

    def low(self, body: Body, frames: dict[Body, Pose]) -> float:
        """Lowest point of a body [m]."""
        return float(_moved(self.points[body], frames[body])[:, 2].min())

    @property
    def bottom(self) -> float:
        """Lowest point of the trunk and of what hangs on it [m]."""
        points = self.points[self.root][:, 2].min()
        return float(min([points, *(child.anchor[2] for child in self.root.children)]))

    def grounded(self, limbs: Sequence[_Limb]) -> list[_Limb]:
        """Limbs that reach the ground."""
        deep = [limb for limb in limbs if self.is_deep(limb, limb.bottom)]
        ground = min((limb.bottom for limb in deep), default=0.0)
        level = ground + LEVEL * (self.bottom - ground)
        found = [limb for limb in deep if limb.bottom <= level]
        # One limb below a base that is fixed is an arm that hangs.
        return found if len(found) > 1 or self.floats else []

    def is_deep(self, limb: _Limb, bottom: float) -> bool:
        """Whether a limb, with its lowest point there [m], may stand on the ground."""
        if len(limb.way) < HINGES or limb.length < SHORTEST * self.height:
            return False
        return self.bottom - bottom >= DEPTH * limb.length

    def completed(
        self, legs: list[_Limb], limbs: Sequence[_Limb]
    ) -> tuple[list[_Limb], list[_Limb]]:
        """Legs with the limbs that are built like one of them, and the other limbs."""
        found = [one for one in limbs if one in legs or any(map(one.like, legs))]
        return found, [one for one in limbs if one not in found]

    def paired(self, limbs: Sequence[_Limb]) -> bool:
        """Whether all limbs come in mirrored pairs, four or more, on a base that may move."""
        return len(limbs) >= PAIRED and self.floats is not False and self.mirrored(limbs)

    def mirrored(self, limbs: Sequence[_Limb]) -> bool:
        """Whether each limb has another like it on the other side of the middle plane."""
        near = MIRRORED * self.size
        for one in limbs:
            mirrored = one.way[0].anchor * np.array([1.0, -1.0, 1.0])
            if not any(
                other is not one
                and one.like(other)
                and float(np.linalg.norm(other.way[0].anchor - mirrored)) < near
                for other in limbs
            ):
                return False
        return True

    def reach_down(self, limbs: Sequence[_Limb]) -> bool:
        """Whether each limb reaches below the trunk in one of many random poses."""
        rng = np.random.default_rng(0)
        lowest = [limb.bottom for limb in limbs]
        for _ in range(SAMPLES):
            positions: dict[Body, float] = {}
            for body, zero in self.middle(None).items():
                low, high = (body.joint.limits if body.joint else None) or (-TURN, TURN)
                wide = not low < high or max(abs(low), abs(high)) > 2 * TURN
                positions[body] = zero if wide or body.slides else float(rng.uniform(low, high))
            frames = self.frames(positions)
            for i, limb in enumerate(limbs):
                lowest[i] = min(lowest[i], self.low(limb.way[-1], frames))
        return all(self.is_deep(limb, low) for limb, low in zip(limbs, lowest, strict=True))


def is_leg(limb: Body, ends: Collection[str]) -> bool:
    """Whether a limb leads to the end of a leg."""
    return any(link in ends for body in limb.all() for link in body.links)


def _moved(points: Array, frame: Pose) -> Array:
    return points @ frame[1].T + frame[0]


def _rotation(axis: Array, angle: float) -> Array:
    """Rotation about a unit axis (Rodrigues), shape (3, 3)."""
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
