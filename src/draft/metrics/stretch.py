"""Pose in which an arm reaches furthest, by exact steps along one joint at a time. For N designs.

With all other joints held, the tip moves on a circle about one joint, and its distance from a point
or along a direction is of the form a + A cos q + B sin q, whose largest value in the range of the
joint is known in closed form. Sweeps over the joints take that step for each of them (cyclic
coordinate ascent; Wang and Chen 1991, IEEE T-RA 7(4), for the distance to a goal). The first sweeps
stretch the arm away from its shoulder, the others turn it to the horizontal. Where joints follow
others, angles are tried instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.cached import once
from draft.design.legs import GRAVITY, LegJoint
from draft.design.limbs import Column, Limb, columns, frames_at, limbs
from draft.design.loads import Load
from draft.design.parts import Coupling
from draft.geometry import Frame, Vector
from draft.values import (
    Mask,
    Value,
    atan2,
    both,
    cos,
    either,
    hypot,
    maximum,
    minimum,
    sin,
    some,
    where,
)

START = 0.2  # of the ranges: in the middle arms stand upright, where no direction is best
SWEEPS = 40  # at most, outwards and back; two for most arms
_STILL = 1e-12  # of the length of the arm: a sweep that gains less is the last
_TINY = 1e-9  # of the length of the arm: what moves the tip by less is rounding error
# Of arms in which joints follow others: sweeps for each goal, angles to try, and steps of zooming.
_ROUNDS, _TRIALS, _ZOOMS = 4, 33, 4


class Segment(NamedTuple):
    """A driven hinge of a limb, or a joint that follows one, from the one before it.

    Attributes:
        body: index of the body that it moves.
        place: its origin and rotation in the frame of the body before it, or in the world [m].
        axis: unit axis in its own frame.
        low, high: its range [rad]; a joint without limits has a whole turn.
        slide: whether it moves along its axis.
        follows: motion per motion of the joint that it follows, if it does.
    """

    body: int
    place: Frame
    axis: Vector
    low: Value
    high: Value
    slide: bool = False
    follows: Coupling | None = None

    def moved(self, position: Value, v: Vector) -> Vector:
        """Point of the body that it moves, with the joint at a position [m]."""
        if self.slide:
            return g.add(v, g.scale(self.axis, position))
        return turned(self.axis, position, v)

    def frame(self, before: Frame, position: Value) -> Frame:
        """Frame of the body that it moves, from that of the body before it."""
        (origin, rotation), (at, placed) = before, self.place
        origin = g.add(origin, g.rotate(rotation, at))
        rotation = g.compose(rotation, placed)
        if self.slide:
            return g.add(origin, g.rotate(rotation, g.scale(self.axis, position))), rotation
        return origin, g.compose(rotation, g.about(self.axis, position))


class Chain(NamedTuple):
    """A limb as the joints that move it, and its tip in the frame of the last such body [m]."""

    segments: tuple[Segment, ...]
    tip: Vector

    @property
    def driven(self) -> tuple[int, ...]:
        """Places of the driven hinges among the segments."""
        return tuple(j for j, one in enumerate(self.segments) if one.follows is None)

    def positions(self, angles: Sequence[Value]) -> list[Value]:
        """Positions of all segments [rad or m], from the angles of the driven hinges."""
        by_body = {self.segments[j].body: a for j, a in zip(self.driven, angles, strict=True)}
        return [
            by_body[one.body] if one.follows is None else one.follows.of(by_body[one.follows.body])
            for one in self.segments
        ]


def chain(design: Design, limb: Limb) -> Chain:
    """Joints of a limb: its driven hinges, and those that follow them; others are at home."""
    found: list[Segment] = []
    frame: Frame = g.ORIGIN
    for k in limb.path:
        body = design.bodies[k]
        placed = body.placed(frame, home=False)
        joint = body.joint
        mover = k if joint is None or joint.follows is None else joint.follows.body
        if joint is None or mover not in limb.joints:
            frame = placed if joint is None else body.moved(placed, joint.home)
            continue
        low, high = (-math.pi, math.pi) if joint.continuous else joint.range
        found.append(Segment(k, placed, joint.axis, low, high, joint.slide, joint.follows))
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
    angles = {one.body: a for one, a in zip(search.of, search.angles, strict=True)}
    found = columns(design, arm, frames_at(design, angles))
    loads = tuple(_load(column, angles[column.body]) for column in found)
    return Stretch(search.reach(), loads)


def _load(column: Column, angle: Value) -> Load:
    sweep, _, lift = column.arm
    names, actuator, hang = (column.name,), column.actuator, column.torque
    joint = LegJoint(column.body, names, actuator, angle, lift, sweep, hang)
    return Load(joint, actuator, GRAVITY * hang, GRAVITY * lift)


class _Circle(NamedTuple):
    """Circle on which a joint moves the tip, seen from above: middle + radial cos q + across sin q.

    Attributes:
        middle, radial, across: components along x and y, from the shoulder [m].
    """

    middle: tuple[Value, Value]
    radial: tuple[Value, Value]
    across: tuple[Value, Value]

    def at(self, angle: Value) -> tuple[Value, Value]:
        """Tip with the joint at an angle [m]."""
        c, s = cos(angle), sin(angle)
        x, y = (m + r * c + a * s for m, r, a in zip(*self, strict=True))
        return x, y

    def motion(self, angle: Value) -> tuple[Value, Value]:
        """Motion of the tip per angle [m/rad]."""
        c, s = cos(angle), sin(angle)
        x, y = (a * c - r * s for _, r, a in zip(*self, strict=True))
        return x, y

    def distance(self, angle: Value) -> Value:
        """Distance of the tip from the shoulder [m]."""
        return hypot(*self.at(angle))


class Search:
    """Search for the pose, from a pose within the ranges.

    The shoulder is the point on the axis of the first joint that is nearest to the origin of the
    second, or to the tip of an arm of one joint.
    """

    def __init__(self, of: Chain) -> None:
        self.chain, self.of, self.n = of, of.segments, len(of.segments)
        self.angles: list[Value] = [x.low + START * (x.high - x.low) for x in self.of]
        # Tip in the frame of each joint, and that frame in the world, before the joint turns.
        self.tips: list[Vector] = [of.tip] * self.n
        self.frames: list[Frame] = [g.ORIGIN] * self.n
        self.length = g.norm(of.tip) + g.total(g.norm(one.place[0]) for one in self.of[1:])
        self._rising: Mask = True
        self._last = 0  # joint whose frame and tip are those of all angles
        self._inward()
        self._outward()
        first = self.of[0]
        next_one = self.of[1].place[0] if self.n > 1 else of.tip
        along = g.scale(first.axis, g.dot(first.axis, next_one))
        self.shoulder = g.add(first.place[0], g.rotate(first.place[1], along))

    def run(self) -> None:
        """Straighten the arm from its tip inwards, stretch it, and turn it to the horizontal."""
        if len(self.chain.driven) < self.n:
            self._run_coupled()
            return
        self._inward(self._straighten)
        self._outward(self._stretch)
        self._inward(self._stretch)
        before = self.reach()
        for k in range(2 * SWEEPS):
            sweep, self._last = (self._inward, 0) if k % 2 else (self._outward, self.n - 1)
            sweep(self._turn)
            after = self.reach()
            self._rising = after - before > _STILL * self.length
            if not some(self._rising):
                break
            before = after

    def _run_coupled(self) -> None:
        """Turn one driven joint after the other, with those that follow it, by trial of angles.

        With a joint that others follow the tip does not move on a circle.
        """
        driven = self.chain.driven
        angles = [self.angles[j] for j in driven]
        for goal in (g.norm, lambda away: hypot(away[0], away[1])):
            for _ in range(_ROUNDS):
                for i, j in enumerate(driven):
                    angles[i] = self._best_of(angles, i, self.of[j], goal)
        self.angles = self.chain.positions(angles)
        self._inward()
        self._outward()

    def _best_of(
        self, angles: Sequence[Value], i: int, one: Segment, goal: Callable[[Vector], Value]
    ) -> Value:
        """Angle of a driven joint at which the tip is furthest away, of angles to try.

        Args:
            angles: angles of the driven joints.
            i: place of the joint among them.
            one: its segment.
            goal: distance of the tip by its vector from the shoulder.
        """

        def away(angle: Value) -> Value:
            return goal(self._to_tip([*angles[:i], angle, *angles[i + 1 :]]))

        low, high, best, before = one.low, one.high, angles[i], away(angles[i])
        shares = np.linspace(0.0, 1.0, _TRIALS).reshape(-1, *(1 for _ in np.shape(before)))
        for _ in range(_ZOOMS):
            tried = low + shares * (high - low)
            tried, found = np.broadcast_arrays(tried, away(tried))
            at = np.expand_dims(found.argmax(axis=0), 0)
            best = np.take_along_axis(tried, at, 0)[0]
            step = (high - low) / (_TRIALS - 1)
            low, high = maximum(one.low, best - step), minimum(one.high, best + step)
        return where(away(best) - before > _TINY * self.length, best, angles[i])

    def _to_tip(self, angles: Sequence[Value]) -> Vector:
        """Vector from the shoulder to the tip at angles of the driven joints [m]."""
        frame: Frame = g.ORIGIN
        for one, position in zip(self.of, self.chain.positions(angles), strict=True):
            frame = one.frame(frame, position)
        return g.subtract(g.add(frame[0], g.rotate(frame[1], self.chain.tip)), self.shoulder)

    def _inward(self, step: Callable[[int], Value] | None = None) -> None:
        """Take a step for each joint from the last to the first; frames before it are known."""
        for j in reversed(range(self.n)):
            if j < self.n - 1:
                after = self.of[j + 1]
                at, rotation = after.place
                moved = after.moved(self.angles[j + 1], self.tips[j + 1])
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
        return self._circle(self._last).distance(self.angles[self._last])

    def _circle(self, j: int) -> _Circle:
        """Circle on which a joint moves the tip, seen from above."""
        (origin, rotation), axis, tip = self.frames[j], self.of[j].axis, self.tips[j]
        along = g.scale(axis, g.dot(axis, tip))
        x, y, _ = g.IDENTITY if rotation is None else rotation
        middle = g.subtract(origin, self.shoulder)
        radial, across = g.subtract(tip, along), g.cross(axis, tip)
        return _Circle(
            (middle[0] + g.dot(x, along), middle[1] + g.dot(y, along)),
            (g.dot(x, radial), g.dot(y, radial)),
            (g.dot(x, across), g.dot(y, across)),
        )

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
        away = g.subtract(origin, point)
        if rotation is not None:
            away = g.rotate(g.transposed(rotation), away)
        axis, tip = self.of[j].axis, self.tips[j]
        along = g.scale(axis, g.dot(axis, tip))
        a, b = g.dot(away, g.subtract(tip, along)), g.dot(away, g.cross(axis, tip))
        return self._best(j, a, b, self.length)

    def _turn(self, j: int) -> Value:
        """Angle of a joint with the tip furthest along its direction, or against it."""
        circle, tiny = self._circle(j), _TINY * self.length
        x, y = circle.at(self.angles[j])
        size = hypot(x, y)
        above = size <= tiny
        if some(above):  # Above or below the shoulder every direction is as good: that of motion.
            u, v = circle.motion(self.angles[j])
            x, y = where(above, u, x), where(above, v, y)
            size = maximum(hypot(x, y), tiny)
        (ax, ay), (bx, by) = circle.radial, circle.across
        a, b = (x * ax + y * ay) / size, (x * bx + y * by) / size
        idle = hypot(a, b) <= _TINY * self.length
        past = (atan2(b, a) - self.of[j].low) % (2.0 * math.pi)
        ahead, back = self._within(j, past), self._within(j, (past + math.pi) % (2.0 * math.pi))
        gain = circle.distance(back) - circle.distance(ahead)
        return where(idle, self.angles[j], where(gain > tiny, back, ahead))

    def _best(self, j: int, a: Value, b: Value, unit: Value) -> tuple[Value, Mask]:
        """Angle q in the range of a joint at which a cos q + b sin q is largest.

        Args:
            j: the joint; it stays where it is if it does not move the tip along the direction.
            a: radial part of the tip along a direction.
            b: motion of the tip along the direction, with the joint at zero.
            unit: size of the direction.
        """
        idle = hypot(a, b) <= _TINY * self.length * unit
        best = self._within(j, (atan2(b, a) - self.of[j].low) % (2.0 * math.pi))
        return where(idle, self.angles[j], best), idle

    def _within(self, j: int, past: Value) -> Value:
        """Angle in the range of a joint nearest to one that is so far past its lower end [rad]."""
        one = self.of[j]
        span = one.high - one.low
        # Beyond the range the nearer end is best; the lower of two that are as near.
        nearer = past - span < 2.0 * math.pi - past - _TINY
        inside = either(past <= span, nearer)
        return one.low + where(inside, where(past <= span, past, span), 0.0)


def turned(axis: Vector, angle: Value, v: Vector) -> Vector:
    """Vector turned about a unit axis (Rodrigues' formula)."""
    along = g.scale(axis, g.dot(axis, v))
    c, s = cos(angle), sin(angle)
    across = g.scale(g.subtract(v, along), c)
    return g.add(along, g.add(across, g.scale(g.cross(axis, v), s)))
