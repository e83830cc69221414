"""Pose in which an arm reaches furthest, by exact steps along one joint at a time. For N designs.

With all other joints held, the tip moves on a circle about one joint, and its distance from a point
or along a direction is of the form a + A cos q + B sin q, whose largest value in the range of the
joint is known in closed form. Sweeps over the joints take that step for each of them (cyclic
coordinate ascent; Wang and Chen 1991, IEEE T-RA 7(4), for the distance to a goal). The first sweeps
stretch the arm away from its shoulder, the others turn it to the horizontal.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from draft import geometry as g
from draft.design import Design
from draft.design.cached import once
from draft.design.legs import GRAVITY, LegJoint
from draft.design.limbs import Column, Limb, columns, frames_at, limbs
from draft.design.loads import Load
from draft.geometry import Frame, Rotation, Vector
from draft.values import Mask, Value, atan2, both, cos, either, hypot, maximum, sin, some, where

START = 0.2  # of the ranges: in the middle arms stand upright, where no direction is best
SWEEPS = 40  # at most, outwards and back; two for most arms
_STILL = 1e-12  # of the length of the arm: a sweep that gains less is the last
_TINY = 1e-9  # of the length of the arm: what moves the tip by less is rounding error


class Segment(NamedTuple):
    """A driven hinge of a limb, from the one before it.

    Attributes:
        body: index of the body that it moves.
        place: its origin and rotation in the frame of the body before it, or in the world [m].
        axis: unit axis in its own frame.
        low, high: its range [rad]; a joint without limits has a whole turn.
    """

    body: int
    place: Frame
    axis: Vector
    low: Value
    high: Value


class Chain(NamedTuple):
    """A limb as its driven hinges, and its tip in the frame of the last body that moves [m]."""

    segments: tuple[Segment, ...]
    tip: Vector


def chain(design: Design, limb: Limb) -> Chain:
    """Driven hinges of a limb, with joints that are not driven at home."""
    found: list[Segment] = []
    frame: Frame = g.ORIGIN
    for k in limb.path:
        body = design.bodies[k]
        placed = body.placed(frame, home=False)
        joint = body.joint
        if joint is None or k not in limb.joints:
            frame = placed if joint is None else body.moved(placed, joint.home)
            continue
        low, high = (-math.pi, math.pi) if joint.continuous else joint.range
        found.append(Segment(k, placed, joint.axis, low, high))
        frame = g.ORIGIN
    tip = g.add(frame[0], g.rotate(frame[1], limb.point))
    return Chain(tuple(found), tip)


class Stretch(NamedTuple):
    """Pose in which the tip of an arm is furthest from its shoulder, along the horizontal.

    Attributes:
        reach: that distance [m].
        loads: loads of its joints in that pose, per mass of a payload at the tip.
    """

    reach: Value
    loads: tuple[Load, ...]


@once
def stretched(design: Design) -> Stretch | None:
    """Pose in which the arm of a design reaches furthest; None without an arm."""
    arm = limbs(design).arm
    if arm is None:
        return None
    search = Search(chain(design, arm))
    search.run()
    angles = dict(zip(arm.joints, search.angles, strict=True))
    found = columns(design, arm, frames_at(design, angles))
    return Stretch(search.reach(), tuple(map(_load, found, search.angles)))


def _load(column: Column, angle: Value) -> Load:
    sweep, _, lift = column.arm
    names, actuator, hang = (column.name,), column.actuator, column.torque
    joint = LegJoint(column.body, names, actuator, angle, lift, sweep, hang)
    return Load(joint, actuator, GRAVITY * hang, GRAVITY * lift)


class Search:
    """Search for the pose, from a pose within the ranges.

    The shoulder is the point on the axis of the first joint that is nearest to the origin of the
    second, or to the tip of an arm of one joint.
    """

    def __init__(self, of: Chain) -> None:
        self.of, self.n = of.segments, len(of.segments)
        self.angles: list[Value] = [x.low + START * (x.high - x.low) for x in self.of]
        # Tip in the frame of each joint, and that frame in the world, before the joint turns.
        self.tips: list[Vector] = [of.tip] * self.n
        self.frames: list[Frame] = [g.ORIGIN] * self.n
        self.length = g.norm(of.tip) + g.total(g.norm(one.place[0]) for one in self.of[1:])
        self._rising: Mask = True
        self._inward()
        self._outward()
        first = self.of[0]
        next_one = self.of[1].place[0] if self.n > 1 else of.tip
        along = g.scale(first.axis, g.dot(first.axis, next_one))
        self.shoulder = g.add(first.place[0], g.rotate(first.place[1], along))

    def run(self) -> None:
        """Straighten the arm from its tip inwards, stretch it, and turn it to the horizontal."""
        self._inward(self._straighten)
        self._outward(self._stretch)
        self._inward(self._stretch)
        before = self.reach()
        for _ in range(SWEEPS):
            self._outward(self._turn)
            self._inward(self._turn)
            self._rising = self.reach() - before > _STILL * self.length
            if not some(self._rising):
                break
            before = self.reach()

    def _inward(self, step: Callable[[int], Value] | None = None) -> None:
        """Take a step for each joint from the last to the first; frames before it are known."""
        for j in reversed(range(self.n)):
            if j < self.n - 1:
                after = self.of[j + 1]
                at, rotation = after.place
                moved = turned(after.axis, self.angles[j + 1], self.tips[j + 1])
                self.tips[j] = g.add(at, g.rotate(rotation, moved))
            self._take(step, j)

    def _outward(self, step: Callable[[int], Value] | None = None) -> None:
        """Take a step for each joint from the first to the last; tips after it are known."""
        for j in range(self.n):
            origin, rotation = g.ORIGIN
            if j:
                origin, rotation = self.frames[j - 1]
                turn = g.about(self.of[j - 1].axis, self.angles[j - 1])
                rotation = g.compose(rotation, turn)
            at, placed = self.of[j].place
            here = g.add(origin, g.rotate(rotation, at))
            self.frames[j] = (here, g.compose(rotation, placed))
            self._take(step, j)

    def _take(self, step: Callable[[int], Value] | None, j: int) -> None:
        # Designs that have arrived stay, so that N of them end where each alone does.
        if step is not None:
            self.angles[j] = where(self._rising, step(j), self.angles[j])

    def reach(self) -> Value:
        """Distance of the tip from the shoulder along the horizontal [m]."""
        x, y, _ = self._from_shoulder(0, self.angles[0])
        return hypot(x, y)

    def _from_shoulder(self, j: int, angle: Value) -> Vector:
        """Vector from the shoulder to the tip in the world, with a joint at an angle [m]."""
        origin, rotation = self.frames[j]
        tip = g.rotate(rotation, turned(self.of[j].axis, angle, self.tips[j]))
        return g.subtract(g.add(origin, tip), self.shoulder)

    def _straighten(self, j: int) -> Value:
        """Angle of a joint with the tip furthest from the last joint before it that sees it."""
        kept, waits = self.angles[j], True
        for k in reversed(range(j)):
            angle, idle = self._away(j, self.frames[k][0] if k else self.shoulder)
            kept, waits = where(waits, angle, kept), both(waits, idle)
            if not some(waits):
                break
        return kept

    def _stretch(self, j: int) -> Value:
        """Angle of a joint with the tip furthest from the shoulder, which is on the first axis."""
        return self._away(j, self.shoulder)[0] if j else self.angles[0]

    def _away(self, j: int, point: Vector) -> tuple[Value, Mask]:
        """Angle of a joint with the tip furthest from a point, and whether the joint is idle."""
        origin, rotation = self.frames[j]
        away = _unrotated(rotation, g.subtract(origin, point))
        return self._best(j, away, self.length)

    def _turn(self, j: int) -> Value:
        """Angle of a joint with the tip furthest along its direction, or against it."""
        x, y, _ = self._from_shoulder(j, self.angles[j])
        above = hypot(x, y) <= _TINY * self.length
        if some(above):  # Above or below the shoulder every direction is as good: that of motion.
            motion = g.cross(self.of[j].axis, turned(self.of[j].axis, self.angles[j], self.tips[j]))
            u, v, _ = g.rotate(self.frames[j][1], motion)
            x, y = where(above, u, x), where(above, v, y)
        size = maximum(hypot(x, y), _TINY * self.length)
        along = _unrotated(self.frames[j][1], (x / size, y / size, 0.0))
        ahead, _ = self._best(j, along, 1.0)
        back, _ = self._best(j, g.scale(along, -1.0), 1.0)
        found = [self._from_shoulder(j, angle) for angle in (ahead, back)]
        gain = hypot(*found[1][:2]) - hypot(*found[0][:2])
        return where(gain > _TINY * self.length, back, ahead)

    def _best(self, j: int, direction: Vector, unit: Value) -> tuple[Value, Mask]:
        """Angle in the range of a joint at which the tip is furthest along a direction.

        Args:
            j: the joint; it stays where it is if it does not move the tip along the direction.
            direction: in the frame of the joint.
            unit: size of the direction.
        """
        one, tip = self.of[j], self.tips[j]
        along = g.scale(one.axis, g.dot(one.axis, tip))
        a = g.dot(direction, g.subtract(tip, along))
        b = g.dot(direction, g.cross(one.axis, tip))
        idle = hypot(a, b) <= _TINY * self.length * unit
        past = (atan2(b, a) - one.low) % (2.0 * math.pi)
        span = one.high - one.low
        # Beyond the range the nearer end is best; the lower of two that are as near.
        nearer = past - span < 2.0 * math.pi - past - _TINY
        inside = either(past <= span, nearer)
        best = one.low + where(inside, where(past <= span, past, span), 0.0)
        return where(idle, self.angles[j], best), idle


def turned(axis: Vector, angle: Value, v: Vector) -> Vector:
    """Vector turned about a unit axis (Rodrigues' formula)."""
    along = g.scale(axis, g.dot(axis, v))
    c, s = cos(angle), sin(angle)
    across = g.scale(g.subtract(v, along), c)
    return g.add(along, g.add(across, g.scale(g.cross(axis, v), s)))


def _unrotated(rotation: Rotation, v: Vector) -> Vector:
    return v if rotation is None else g.rotate(g.transposed(rotation), v)
