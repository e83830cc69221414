"""Crouch: the pose of a leg in which designs are compared. Closed form, for N designs.

All joints but three are at zero. The knee bends until the distance from hip to ankle is 0.878 of
thigh plus shank, which is 1 rad if both have the same length (the default pose of arXiv
2609.38405). The hip, the nearest hinge above with an axis parallel to that of the knee, turns until
the ankle is below it; without one it is the nearest that is less than 60 degrees off, as in
humanoids with slanting hips, and the other two hinges above the knee take back what it turns aside.
The ankle, the next parallel hinge below the knee, makes the foot level again; without one the foot
is the ankle. Of the two bending directions the knee takes the one closer to the middle of its
range; if that is straight and the foot a plate, the knee moves toward the toes. Joint ranges are
not checked otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from draft import geometry as g
from draft.design.design import Body, Design
from draft.geometry import Frame, Rotation, Vector
from draft.spec.primitives.foot import PlatePart
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
# Axes count as parallel above this |cosine| of the angle between them: 18 degrees.
PARALLEL = 0.95
SLANTING = 0.5  # |cosine| for a hip without a parallel axis: 60 degrees.
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_SYMMETRIC = 1e-3  # Middle of a knee's range that tells nothing of how it bends [rad].
_STEPS, _FLAT = 5, 0.1  # Newton's steps, and the volume of three axes below which none is taken.


def tip(body: Body, frame: Frame) -> Vector:
    """Tip of a body in the frame in which its own frame is given [m]."""
    origin, rotation = frame
    return g.add(origin, g.rotate(rotation, body.link.tip))


class Crouch:
    """Crouch of a leg, computed in the plane in which its knee moves.

    In that plane a direction is an angle from straight down. `hip` and `ankle` map each candidate
    joint to 0 where it is not that joint, and else to how much it turns per turn in the plane:
    1 or -1, the sense of its axis, or more for a slanting one.
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
        ankle, self.ankle = _nearest(hinges[at + 1 :], axis, origin, axis[knee], last, PARALLEL)
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
        toes = g.dot(_toes(design.bodies[run[-1]], frames[run[-1]]), forth)
        unknown = both(abs(middle) < _SYMMETRIC, abs(toes) > 0.0)
        side = where(unknown, where(toes < 0, 1.0, -1.0), side)
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
            turned = turned + where(share != 0, lean, 0.0)
        slants = _slants(self.hip)
        if some(slants) and at == len(_AXES):
            above = hinges[:at]
            start = [self.angles.get(k, 0.0) for k in above]
            upright = _turned([axis[k] for k in above], start, axis[knee], lean)
            for k, before, angle in zip(above, start, upright, strict=True):
                self.angles[k] = where(slants, angle, before)
        for k, share in self.ankle.items():
            self.angles[k] = -1.0 * share * turned


def _toes(body: Body, frame: Frame) -> Vector:
    """How far a plate reaches beyond its middle [m]; zero for other feet."""
    end = body.link.end
    if not isinstance(end, PlatePart):
        return g.ZERO
    return g.rotate(frame[1], (end.offset, 0.0, 0.0))


def bend_at(span: Value, a: Value, b: Value) -> Value:
    """Bend of a knee [rad], 0 if straight, for a distance from hip to ankle [m]."""
    return acos(clip(divide(span * span - a * a - b * b, 2.0 * a * b), -1.0, 1.0))


def _basis(axis: Vector) -> tuple[Vector, Vector]:
    """Basis of the plane normal to an axis: down, and down turned by 90 degrees about the axis."""
    down = g.subtract((0.0, 0.0, -1.0), g.scale(axis, -1.0 * axis[2]))
    down = g.scale(down, divide(1.0, g.norm(down)))
    return down, g.cross(axis, down)


def _nearest(
    joints: list[int],
    axis: Mapping[int, Vector],
    origin: Mapping[int, Vector],
    to: Vector,
    otherwise: Vector,
    least: float = SLANTING,
) -> tuple[Vector, dict[int, Value]]:
    """Origin of the first joint with a parallel axis, and which joint that is, design by design.

    Without a parallel one, it is the first that is within `least`, a |cosine|. Joints that are the
    first one in no design are omitted.
    """
    point, found = otherwise, False
    chosen: dict[int, Value] = {}
    done: Mask = found
    for enough in (PARALLEL, least):
        for k in joints:
            cosine = g.dot(axis[k], to)
            take = both(abs(cosine) > enough, negate(done))
            if not some(take):
                continue
            x, y = origin[k], point
            point = (where(take, x[0], y[0]), where(take, x[1], y[1]), where(take, x[2], y[2]))
            share: Value = where(cosine > 0, 1.0, -1.0)
            if enough < PARALLEL:
                share = divide(1.0, cosine)
            chosen[k] = where(take, share, chosen.get(k, 0.0))
            done = either(done, take)
    return point, chosen


def _slants(hip: Mapping[int, Value]) -> Mask:
    """Where a hip's axis is not parallel to that of the knee."""
    slants: Mask = False
    for share in hip.values():
        slants = either(slants, abs(share) > 1.0)
    return slants


def _turned(axes: list[Vector], start: list[Value], to: Vector, lean: Value) -> list[Value]:
    """Angles of three hinges in a row that together turn by `lean` about an axis, by Newton.

    Args:
        axes: of the hinges with all at zero, from the trunk outwards.
        start: angles near the solution [rad].
        to: the axis.
        lean: angle of the whole turn [rad].
    """
    target, angles = g.about(to, lean), start
    for _ in range(_STEPS):
        rotation: Rotation = None
        now = []
        for axis, angle in zip(axes, angles, strict=True):
            now.append(g.rotate(rotation, axis))
            rotation = g.compose(rotation, g.about(axis, angle))
        missing = g.ZERO  # Rotation vector from here to the target, twice its sine.
        for axis in _AXES:
            missing = g.add(missing, g.cross(g.rotate(rotation, axis), g.rotate(target, axis)))
        x, y, z = now
        volume = g.dot(x, g.cross(y, z))
        share = where(abs(volume) > _FLAT, divide(0.5, volume), 0.0)
        normals = g.cross(y, z), g.cross(z, x), g.cross(x, y)
        steps = (share * g.dot(missing, normal) for normal in normals)
        angles = [angle + step for angle, step in zip(angles, steps, strict=True)]
    return angles


def leg_frames(
    design: Design, head: int, angles: Mapping[int, Value]
) -> dict[int, tuple[Vector, Rotation]]:
    """Frames of a body and of all below it, in axes of the trunk, relative to its parent's origin.

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
    """Rotation of a body in the frame of the trunk, with all joints at zero."""
    rotation: Rotation = None
    while body is not None:
        rotation = g.compose(design.bodies[body].rotation, rotation)
        body = design.bodies[body].parent
    return rotation


def carried(design: Design, head: int) -> list[int]:
    """A body and all bodies below it, each after its parent."""
    found = {head}
    for k in range(head + 1, len(design.bodies)):
        if design.bodies[k].parent in found:
            found.add(k)
    return sorted(found)


def is_hinge(body: Body) -> bool:
    """Return whether a body has a hinge other than that of a wheel, which poses no leg."""
    return body.joint is not None and not body.joint.slide and not body.joint.rolls
