"""Pose in which an arm reaches furthest, by exact steps along one joint at a time. For N designs.

With all other joints held, the tip moves on a circle about one joint, and its distance from a point
or along a direction is of the form a + A cos q + B sin q, whose largest value in the range of the
joint is known in closed form. Sweeps over the joints take that step for each of them (cyclic
coordinate ascent; Wang and Chen 1991, IEEE T-RA 7(4), for the distance to a goal). The first sweeps
stretch the arm away from its shoulder, the others turn it to the horizontal.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from draft import geometry as g
from draft.design import Design
from draft.design.cached import once
from draft.design.limbs import Column, Limb, columns, frames_at, limbs
from draft.geometry import Frame, Rotation, Vector
from draft.values import Mask, Value, atan2, both, cos, either, hypot, maximum, sin, some, where

STRETCHING, TURNING = 4, 6  # sweeps
_TINY = 1e-9  # of the length of the arm: what moves the tip by less is rounding error


class Segment(NamedTuple):
    """A driven hinge of a limb, from the one before it.

    Attributes:
        body: index of the body that it moves.
        place: its origin and rotation in the frame of the body before it, or in the world [m].
        axis: unit axis in its own frame.
        low, high: its range [rad]; a joint without limits has a whole turn.
        home: its home angle [rad].
    """

    body: int
    place: Frame
    axis: Vector
    low: Value
    high: Value
    home: Value


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
        found.append(Segment(k, placed, joint.axis, low, high, joint.home))
        frame = g.ORIGIN
    tip = g.add(frame[0], g.rotate(frame[1], limb.point))
    return Chain(tuple(found), tip)


class Stretch(NamedTuple):
    """Pose in which the tip of an arm is furthest from its shoulder, along the horizontal.

    Attributes:
        reach: that distance [m].
        joints: its driven hinges in that pose.
    """

    reach: Value
    joints: tuple[Column, ...]


@once
def stretched(design: Design) -> Stretch | None:
    """Pose in which the arm of a design reaches furthest; None without an arm."""
    arm = limbs(design).arm
    if arm is None:
        return None
    search = _Search(chain(design, arm))
    search.run()
    angles = dict(zip(arm.joints, search.angles, strict=True))
    return Stretch(search.reach(), columns(design, arm, frames_at(design, angles)))


class _Search:
    """Search for the pose, from the home pose.

    The shoulder is the point on the axis of the first joint that is nearest to the origin of the
    second, or to the tip of an arm of one joint.
    """

    def __init__(self, of: Chain) -> None:
        self.of, self.n = of.segments, len(of.segments)
        self.angles: list[Value] = [one.home for one in self.of]
        # Tip in the frame of each joint, before the joint turns it.
        self.tips: list[Vector] = [of.tip] * self.n
        self.frames: list[Frame] = [g.ORIGIN] * self.n  # of each joint in the world, before it turns
        self.length = g.norm(of.tip) + g.total(g.norm(one.place[0]) for one in self.of[1:])
        for j in reversed(range(self.n)):
            self._inwards(j)
        for j in range(self.n):
            self._outwards(j)
        first = self.of[0]
        next_one = self.of[1].place[0] if self.n > 1 else of.tip
        along = g.scale(first.axis, g.dot(first.axis, next_one))
        self.shoulder = g.add(first.place[0], g.rotate(first.place[1], along))

    def run(self) -> None:
        """Straighten the arm, stretch it, and turn it to the horizontal."""
        for j in reversed(range(self.n)):
            self._inwards(j)
            self._straighten(j)
        for sweep in range(STRETCHING + TURNING):
            stretch = sweep < STRETCHING
            if not sweep % 2:
                for j in range(self.n):
                    self._outwards(j)
                    self._stretch(j) if stretch else self._turn(j)
            else:
                for j in reversed(range(self.n)):
                    self._inwards(j)
                    self._stretch(j) if stretch else self._turn(j)
        for j in reversed(range(self.n)):
            self._inwards(j)

    def reach(self) -> Value:
        """Distance of the tip from the shoulder along the horizontal [m]."""
        x, y, _ = self._from_shoulder(0, self.angles[0])
        return hypot(x, y)

    def _outwards(self, j: int) -> None:
        """Frame of a joint in the world, from that of the joint before it."""
        origin, rotation = g.ORIGIN
        if j:
            before = self.of[j - 1]
            origin, rotation = self.frames[j - 1]
            rotation = g.compose(rotation, g.about(before.axis, self.angles[j - 1]))
        at, turned = self.of[j].place
        here = g.add(origin, g.rotate(rotation, at))
        self.frames[j] = (here, g.compose(rotation, turned))

    def _inwards(self, j: int) -> None:
        """Tip in the frame of a joint, from that in the frame of the joint after it."""
        if j == self.n - 1:
            return
        after = self.of[j + 1]
        at, turned = after.place
        moved = _turned(after.axis, self.angles[j + 1], self.tips[j + 1])
        self.tips[j] = g.add(at, g.rotate(turned, moved))

    def _from_shoulder(self, j: int, angle: Value) -> Vector:
        """Vector from the shoulder to the tip in the world, with a joint at an angle [m]."""
        origin, rotation = self.frames[j]
        tip = g.rotate(rotation, _turned(self.of[j].axis, angle, self.tips[j]))
        return g.subtract(g.add(origin, tip), self.shoulder)

    def _straighten(self, j: int) -> None:
        """Turn a joint so that the tip is furthest from the nearest joint before it that it can."""
        kept, waits = self.angles[j], True
        for k in reversed(range(j)):
            angle, idle = self._away(j, self.frames[k][0] if k else self.shoulder)
            kept, waits = where(waits, angle, kept), both(waits, idle)
            if not some(waits):
                break
        self.angles[j] = kept

    def _stretch(self, j: int) -> None:
        """Turn a joint so that the tip is furthest from the shoulder."""
        if j:
            self.angles[j], _ = self._away(j, self.shoulder)

    def _away(self, j: int, point: Vector) -> tuple[Value, Mask]:
        """Angle of a joint with the tip furthest from a point, and whether the joint is idle."""
        origin, rotation = self.frames[j]
        away = _unrotated(rotation, g.subtract(origin, point))
        return self._best(j, away, self.length)

    def _turn(self, j: int) -> None:
        """Turn a joint so that the tip is furthest along its direction, or against it."""
        x, y, _ = self._from_shoulder(j, self.angles[j])
        size = maximum(hypot(x, y), _TINY * self.length)
        along = _unrotated(self.frames[j][1], (x / size, y / size, 0.0))
        ahead, _ = self._best(j, along, 1.0)
        back, _ = self._best(j, g.scale(along, -1.0), 1.0)
        found = [self._from_shoulder(j, angle) for angle in (ahead, back)]
        gain = hypot(*found[1][:2]) - hypot(*found[0][:2])
        self.angles[j] = where(gain > _TINY * self.length, back, ahead)

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


def _turned(axis: Vector, angle: Value, v: Vector) -> Vector:
    """Vector turned about a unit axis (Rodrigues' formula)."""
    along = g.scale(axis, g.dot(axis, v))
    c, s = cos(angle), sin(angle)
    across = g.scale(g.subtract(v, along), c)
    return g.add(along, g.add(across, g.scale(g.cross(axis, v), s)))


def _unrotated(rotation: Rotation, v: Vector) -> Vector:
    return v if rotation is None else g.rotate(g.transposed(rotation), v)
