"""Legs of a design, and their lever arms in the crouch. Closed form, for N designs.

A leg is a serial run of bodies that no other leg shares, down to a foot: a sphere or plate with a
site. It has a knee: the first hinge of a link of class `shank`. A robot without a knee has no legs.
No joint of a leg follows another, as its pose and its loads would have to.

The pose is that of `draft.design.crouch`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from draft import geometry as g
from draft.design.actuators import Actuator
from draft.design.cached import once
from draft.design.crouch import Crouch, carried, is_hinge, leg_frames, rotation_at_zero, tip
from draft.design.design import Body, Design
from draft.design.plan import plan
from draft.geometry import Frame, Vector
from draft.spec import Spec
from draft.values import Value, cos, maximum, sqrt, where

KNEE = "shank"
GRAVITY = 9.81  # [m/s2]


@dataclass(frozen=True, slots=True)
class LegJoint:
    """A hinge of a leg in the crouch.

    Attributes:
        body: index of the body that it turns.
        names: its full name on every leg of this kind.
        actuator: its actuator; None for a passive joint.
        angle: its angle on the first leg [rad].
        lift: upward motion of the foot per angle [m/rad].
        sweep: forward motion of the foot per angle [m/rad].
        hang: first moment of all bodies that it moves, sum of m dz/dq [kg m/rad].
    """

    body: int
    names: tuple[str, ...]
    actuator: Actuator | None
    angle: Value
    lift: Value
    sweep: Value
    hang: Value


@dataclass(frozen=True, slots=True)
class Leg:
    """Legs of one kind: the same links, and the same geometry in the crouch.

    Attributes:
        feet: index of the foot's body on every leg of this kind.
        joints: its hinges from the trunk outwards, including the knee.
        knee: the knee.
        thigh: distance from the hip axis to the knee axis [m].
        shank: distance from the knee axis to the ankle [m].
        below: distance from the ankle down to the floor [m].
        bend: smallest and largest bend of the knee in its range [rad]; 0 is straight.
        hip_armature: armature of the hip joint [kg m2].
    """

    feet: tuple[int, ...]
    joints: tuple[LegJoint, ...]
    knee: LegJoint
    thigh: Value
    shank: Value
    below: Value
    bend: tuple[Value, Value]
    hip_armature: Value

    @property
    def copies(self) -> int:
        """Number of legs of this kind."""
        return len(self.feet)

    @property
    def length(self) -> Value:
        """Thigh plus shank [m]."""
        return self.thigh + self.shank

    def span(self, bend: Value) -> Value:
        """Distance from the hip axis to the ankle at a bend of the knee [rad], in [m]."""
        a, b = self.thigh, self.shank
        return sqrt(maximum(a * a + b * b + 2.0 * a * b * cos(bend), 0.0))


@once
def legs(design: Design) -> tuple[Leg, ...]:
    """Kinds of leg of a design; empty without legs."""
    return tuple(_leg(design, runs) for runs in runs_of_legs(design))


def crouch(design: Design) -> dict[str, Value]:
    """Angles of all hinges of the legs in the crouch, by full name [rad]."""
    found: dict[str, Value] = {}
    for leg, runs in zip(legs(design), runs_of_legs(design), strict=True):
        for joint in leg.joints:
            place = runs[0].index(joint.body)
            for name, run in zip(joint.names, runs, strict=True):
                found[name] = _sense(design, joint.body, run[place]) * joint.angle
    return found


def count(design: Design) -> int:
    """Number of legs of a design."""
    return sum(len(runs) for runs in runs_of_legs(design))


def home_joints(design: Design, runs: list[tuple[int, ...]]) -> tuple[LegJoint, ...]:
    """Hinges of a kind of leg, from the trunk outwards, with their lever arms in the home pose.

    Args:
        design: the design.
        runs: bodies of every leg of the kind, as `runs_of_legs` gives them.
    """
    bodies = design.bodies
    angles = {
        k: joint.home for k in carried(design, runs[0][0]) if (joint := bodies[k].joint) is not None
    }
    return _joints(design, runs, angles, leg_frames(design, runs[0][0], angles))


_runs: WeakKeyDictionary[Spec, list[list[tuple[int, ...]]]] = WeakKeyDictionary()


def runs_of_legs(design: Design) -> list[list[tuple[int, ...]]]:
    """Legs as runs of bodies, grouped by kind; found once per spec."""
    known = _runs.get(design.spec)
    if known is None:
        known = _runs[design.spec] = _find_runs(design)
    return known


def coupled_bodies(design: Design) -> list[Body]:
    """Bodies of legs whose joints follow others; what such a leg can do is not judged."""
    bodies = [design.bodies[k] for run in _every_run(design) for k in run]
    return [body for body in bodies if _follows(body)]


def _every_run(design: Design) -> list[tuple[int, ...]]:
    """Legs as runs of bodies, also those in which joints follow others."""
    kinds = {segment.label: segment.kind for segment in design.segments}
    by_knee: dict[int, list[int]] = {}
    for i in design.feet:
        path = [i]
        while (parent := design.bodies[path[0]].parent) is not None:
            path.insert(0, parent)
        for k in path:
            if kinds.get(design.bodies[k].segment or "") == KNEE and is_hinge(design.bodies[k]):
                by_knee.setdefault(k, path)
                break
    uses = Counter(k for path in by_knee.values() for k in path)
    return [tuple(k for k in path if k and uses[k] == 1) for path in by_knee.values()]


def _find_runs(design: Design) -> list[list[tuple[int, ...]]]:
    grouped: dict[object, list[tuple[int, ...]]] = {}
    for run in _every_run(design):
        if run and not any(_follows(design.bodies[k]) for k in run):
            grouped.setdefault(_key(design, run[0]), []).append(run)
    return list(grouped.values())


def _key(design: Design, head: int) -> object:
    """Key that legs of one kind share: a mirror to the other side changes only signs."""
    placed = plan(design.spec).placement_of
    first, parent = design.bodies[head], design.bodies[head].parent
    turned = first.rotation is not None or rotation_at_zero(design, parent) is not None
    below = [(k, design.spec.bodies[k]) for k in carried(design, head)]
    return (
        head if turned else None,
        tuple((id(b.link), b.signs[0], b.signs[2], k == head or placed[k]) for k, b in below),
    )


def _leg(design: Design, runs: list[tuple[int, ...]]) -> Leg:
    """Kind of leg, from the runs of all legs of that kind."""
    run = runs[0]
    bodies = design.bodies
    kinds = {segment.label: segment.kind for segment in design.segments}
    knee = next(
        k for k in run if is_hinge(bodies[k]) and kinds.get(bodies[k].segment or "") == KNEE
    )
    plane = Crouch(design, run, knee)
    frames = leg_frames(design, run[0], plane.angles)
    joints = _joints(design, runs, plane.angles, frames)
    foot = tip(bodies[run[-1]], frames[run[-1]])
    end = bodies[run[-1]].link.end
    depth = end.depth if end is not None else 0.0
    ankle: Value = foot[2]
    for k, share in plane.ankle.items():
        ankle = where(share != 0, frames[k][0][2], ankle)
    armature: Value = 0.0
    for joint in joints:
        if joint.body in plane.hip and joint.actuator is not None:
            share = plane.hip[joint.body]
            armature = armature + share * share * joint.actuator.armature
    return Leg(
        feet=tuple(r[-1] for r in runs),
        joints=joints,
        knee=next(joint for joint in joints if joint.body == knee),
        thigh=plane.thigh,
        shank=plane.shank,
        below=ankle - foot[2] + depth,
        bend=plane.range,
        hip_armature=armature,
    )


def _joints(
    design: Design,
    runs: list[tuple[int, ...]],
    angles: Mapping[int, Value],
    frames: Mapping[int, Frame],
) -> tuple[LegJoint, ...]:
    """Hinges of a leg with their lever arms."""
    bodies, run = design.bodies, runs[0]
    foot = tip(bodies[run[-1]], frames[run[-1]])
    below = moments(design, frames)
    found = []
    for place, k in enumerate(run):
        joint = bodies[k].joint
        if joint is None or joint.slide:
            continue
        origin, rotation = frames[k]
        axis = g.rotate(rotation, bodies[k].joint_axis)
        r = g.subtract(foot, origin)
        found.append(
            LegJoint(
                body=k,
                names=tuple(bodies[other[place]].prefix + joint.name for other in runs),
                actuator=design.drive(joint),
                angle=angles.get(k, 0.0),
                lift=axis[0] * r[1] - axis[1] * r[0],
                sweep=axis[1] * r[2] - axis[2] * r[1],
                hang=hang(axis, origin, below[k]),
            )
        )
    return tuple(found)


def _sense(design: Design, first: int, other: int) -> Value:
    """Sign of the angle with which a hinge moves like that of another leg, or like its image.

    In a mirror an axis becomes minus its reflection, and a copy has that or its opposite.
    """
    side, own = (design.spec.bodies[k].signs[1] for k in (first, other))
    if side == own:
        return 1.0
    axis, copied = (design.bodies[k].joint_axis for k in (first, other))
    along = g.dot(copied, g.reflect(axis, (1.0, -1.0, 1.0)))
    return where(along > 0, -1.0, 1.0)


def _follows(body: Body) -> bool:
    return body.joint is not None and body.joint.follows is not None


def held_joints(design: Design) -> tuple[LegJoint, ...]:
    """Hinges of a fixed base in the home pose, each alone; no floor lifts them.

    One that others follow also carries what they move. Those that follow are left out.
    """
    frames = dict(enumerate(design.frames(home=True)))
    below = moments(design, frames)
    hangs = hangs_of(design, frames, below)
    return tuple(
        LegJoint(
            body=k,
            names=(body.prefix + joint.name,),
            actuator=design.drive(joint),
            angle=joint.home,
            lift=0.0,
            sweep=0.0,
            hang=hangs[k],
        )
        for k, body in enumerate(design.bodies)
        if (joint := body.joint) is not None and not joint.slide and joint.follows is None
    )


def hangs_of(
    design: Design, frames: Mapping[int, Frame], below: Mapping[int, Vector]
) -> dict[int, Value]:
    """First moment of what each joint moves, by its body: sum of m dz/dq [kg m/rad, or kg].

    Those of joints that follow others are part of what the others move.

    Args:
        design: the design.
        frames: of all bodies.
        below: moments of all bodies, see `moments`.
    """
    found: dict[int, Value] = {}
    for k, body in enumerate(design.bodies):
        joint = body.joint
        if joint is None:
            continue
        axis = g.rotate(frames[k][1], joint.axis)
        own = below[k][0] * axis[2] if joint.slide else hang(axis, frames[k][0], below[k])
        follows = joint.follows
        share = own if follows is None else own * follows.ratio
        to = k if follows is None else follows.body
        found[to] = found.get(to, 0.0) + share
    return found


def hang(axis: Vector, origin: Vector, moment: Vector) -> Value:
    """First moment of the bodies below a hinge, sum of m dz/dq [kg m/rad]."""
    mass, x, y = moment
    return axis[0] * (y - mass * origin[1]) - axis[1] * (x - mass * origin[0])


def moments(design: Design, frames: Mapping[int, Frame]) -> dict[int, Vector]:
    """Mass [kg] and first moments along x and y [kg m] of each body with all below it."""
    found: dict[int, Vector] = {}
    for k in frames:
        body = design.bodies[k]
        origin, rotation = frames[k]
        point = g.rotate(rotation, _first_moment(body))
        mass = body.mass
        found[k] = (mass, point[0] + mass * origin[0], point[1] + mass * origin[1])
    for k in reversed(list(frames)):
        parent = design.bodies[k].parent
        if parent in found:
            found[parent] = g.add(found[parent], found[k])
    return found


def _first_moment(body: Body) -> Vector:
    """Mass times centre of mass of a body in its own frame [kg m]."""
    link = body.link
    moment = g.scale(body.member_com, body.member_mass)
    moment = g.add(moment, g.scale(link.tip, body.end_mass))
    if link.end is not None and link.end.center is not g.ZERO:
        moment = g.add(moment, g.scale(link.end.center, body.end_mass))
    if (motor := body.motor_geom) is not None and motor.mass is not None:
        moment = g.add(moment, g.scale(body.motor_com, motor.mass))
    return moment
