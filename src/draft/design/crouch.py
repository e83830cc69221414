"""The crouch: one pose of a leg in which designs are compared. Closed form, for N designs.

All joints at zero but three. The knee is bent until hip, knee and ankle span 0.878 of thigh plus
shank, which is a knee bend of 1 rad where the two are as long (the default pose of arXiv
2609.38405). The hip, the nearest hinge above whose axis is parallel to the knee's, turns until the
ankle is below it. The ankle, the next parallel hinge below, turns the foot level again; without one
it is the foot itself. Of the two ways to bend, the knee takes the one that is nearer the middle of
its range. Ranges are not held otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from draft import geometry as g
from draft.design import Design
from draft.design.design import Body
from draft.geometry import Rotation, Vector
from draft.values import (
    Mask,
    Value,
    acos,
    atan2,
    both,
    clip,
    cos,
    divide,
    either,
    hypot,
    maximum,
    minimum,
    negate,
    sin,
    some,
    where,
)

CROUCH = 0.878
# |cosine| between two axes from which on they count as parallel: 18 degrees.
PARALLEL = 0.95
Frame = tuple[Vector, Rotation]


def tip(body: Body, frame: Frame) -> Vector:
    """Far end of a body, in the axes and about the origin that its frame is given in [m]."""
    origin, rotation = frame
    return g.add(origin, g.rotate(rotation, body.link.tip))


class Crouch:
    """The crouch of a leg, worked out in the plane that its knee moves in.

    In that plane a direction is an angle from straight down. `hip` and `ankle` hold, for each
    joint that may count as such, 0 where it does not and the sense of its axis where it does.
    """

    def __init__(self, design: Design, run: tuple[int, ...], knee: int) -> None:
        frames = leg_frames(design, run[0], {})
        hinges = [k for k in run if is_hinge(design.bodies[k])]
        at = hinges.index(knee)
        axis = {k: g.rotate(frames[k][1], design.bodies[k].joint_axis) for k in hinges}
        first = frames[hinges[0] if at else run[0]][0]
        last = tip(design.bodies[run[-1]], frames[run[-1]])
        origin = {k: frames[k][0] for k in hinges}
        hip, self.hip = _nearest(hinges[:at][::-1], axis, origin, axis[knee], first)
        ankle, self.ankle = _nearest(hinges[at + 1 :], axis, origin, axis[knee], last)
        down, forth = _basis(axis[knee])
        u, v = g.subtract(origin[knee], hip), g.subtract(ankle, origin[knee])
        ux, uy, vx, vy = g.dot(u, down), g.dot(u, forth), g.dot(v, down), g.dot(v, forth)
        self.thigh, self.shank = a, b = hypot(ux, uy), hypot(vx, vy)
        zero = atan2(vy, vx) - atan2(uy, ux)
        bend = bend_at(CROUCH * (a + b), a, b)
        joint = design.bodies[knee].joint
        low, high = joint.range if joint else (0.0, 0.0)
        middle = (low + high) / 2
        side = where(abs(bend - zero - middle) <= abs(bend + zero + middle), 1.0, -1.0)
        turn = side * bend - zero
        lean = -1.0 * atan2(uy, ux) - atan2(side * b * sin(bend), a + b * cos(bend))
        ends = (side * (low + zero), side * (high + zero))
        self.range = (
            clip(minimum(*ends), 0.0, math.pi),
            clip(maximum(*ends), 0.0, math.pi),
        )
        self.angles: dict[int, Value] = {knee: turn}
        turned: Value = turn
        for k, share in self.hip.items():
            self.angles[k] = share * lean
            turned = turned + share * share * lean
        for k, share in self.ankle.items():
            self.angles[k] = -1.0 * share * turned


def bend_at(span: Value, a: Value, b: Value) -> Value:
    """Bend of a knee [rad], 0 where straight, that puts hip and ankle a distance apart."""
    return acos(clip(divide(span * span - a * a - b * b, 2.0 * a * b), -1.0, 1.0))


def _basis(axis: Vector) -> tuple[Vector, Vector]:
    """Down and, a quarter turn about the axis on, the other direction of the plane across it."""
    down = g.subtract((0.0, 0.0, -1.0), g.scale(axis, -1.0 * axis[2]))
    down = g.scale(down, divide(1.0, g.norm(down)))
    return down, g.cross(axis, down)


def _nearest(
    joints: list[int],
    axis: Mapping[int, Vector],
    origin: Mapping[int, Vector],
    to: Vector,
    otherwise: Vector,
) -> tuple[Vector, dict[int, Value]]:
    """Origin of the first joint whose axis is parallel, and which joint that is, design by design.

    Joints that are it for no design are left out.
    """
    point, found = otherwise, False
    chosen: dict[int, Value] = {}
    done: Mask = found
    for k in joints:
        cosine = g.dot(axis[k], to)
        take = both(abs(cosine) > PARALLEL, negate(done))
        if not some(take):
            continue
        x, y = origin[k], point
        point = (where(take, x[0], y[0]), where(take, x[1], y[1]), where(take, x[2], y[2]))
        chosen[k] = where(take, where(cosine > 0, 1.0, -1.0), 0.0)
        done = either(done, take)
    return point, chosen


def leg_frames(
    design: Design, head: int, angles: Mapping[int, Value]
) -> dict[int, tuple[Vector, Rotation]]:
    """Frames of all bodies that a body carries, in the trunk's axes, about its parent's origin.

    Args:
        design: the design.
        head: index of the first body; joints above it are at zero.
        angles: values of joints by index of the body that they move [rad or m]; others are 0.
    """
    frames: dict[int, Frame] = {}
    above = design.bodies[head].parent
    start: Frame = (g.ZERO, rotation_at_zero(design, above))
    for k in carried(design, head):
        body = design.bodies[k]
        origin, rotation = start if k == head else frames[body.parent or 0]
        here = g.add(origin, g.rotate(rotation, body.position))
        frame = (here, g.compose(rotation, body.rotation))
        frames[k] = body.moved(frame, angles[k]) if k in angles else frame
    return frames


def rotation_at_zero(design: Design, body: int | None) -> Rotation:
    """Rotation of a body in the trunk's frame, all joints at zero."""
    rotation: Rotation = None
    while body is not None:
        rotation = g.compose(design.bodies[body].rotation, rotation)
        body = design.bodies[body].parent
    return rotation


def carried(design: Design, head: int) -> list[int]:
    """A body and all that hangs on it, each after its parent."""
    found = {head}
    for k in range(head + 1, len(design.bodies)):
        if design.bodies[k].parent in found:
            found.add(k)
    return sorted(found)


def is_hinge(body: Body) -> bool:
    """Tell whether a body turns on its parent."""
    return body.joint is not None and not body.joint.slide
