"""Overlap of consecutive actuators, and of limbs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from draft import geometry as g
from draft.design import solids
from draft.design.design import Body, Design
from draft.design.findings import Finding, note
from draft.design.parts import Joint
from draft.design.plan import Consecutive, Plan
from draft.design.solids import Box, Cylinder, Pose, Solid
from draft.geometry import Frame, Vector
from draft.values import Mask, Value, both, clip, every, some

# Positions of a joint at which consecutive actuators are compared.
_POSITIONS = 9


def actuator_overlaps(design: Design, plan: Plan) -> Iterator[Finding]:
    """Consecutive actuators that overlap at every position of their joint."""
    bodies, reuse = design.bodies, plan.reuse(design.count)
    for k, pair in enumerate(plan.consecutive):
        path = (bodies[pair.first], *(bodies[i] for i in pair.path))
        always = reuse.result(("motors", k), partial(_always_overlap, pair), *path)
        if not some(always):
            continue
        joint = _joint(pair, path[1:])
        slides = joint is not None and joint.slide
        yield from note(
            "actuator_overlap",
            f"{path[0].name}/{path[-1].name}",
            always,
            f"the actuators on '{path[0].name}' and '{path[-1].name}' occupy the same space at "
            f"every {'position of the slide' if slides else 'joint angle'}",
            "actuator sizes and link lengths",
        )


def _always_overlap(pair: Consecutive, first: Body, *path: Body) -> Mask:
    """Whether two consecutive actuators overlap at every position of the joint between them."""
    motor, other = first.motor_geom, path[-1].motor_geom
    if motor is None or other is None:
        return False
    a, joint = solids.solid(motor, g.ORIGIN), _joint(pair, path)
    low, high = joint.range if joint is not None else (0.0, 0.0)

    def overlap(by: Value) -> Mask:
        return solids.overlap(a, solids.solid(other, _frames(pair, path, by)[-1]))

    always = overlap(clip(0.0, low, high))
    if joint is None or not some(always) or _turns_in_place(a, pair, path):
        return always
    for k in range(_POSITIONS):
        always = both(always, overlap(low + (high - low) * (k / (_POSITIONS - 1))))
        if not some(always):
            break
    return always


def _joint(pair: Consecutive, path: Sequence[Body]) -> Joint | None:
    """The joint between two actuators."""
    return None if pair.joint is None else path[pair.joint].joint


def _frames(pair: Consecutive, path: Sequence[Body], by: Value) -> list[Frame]:
    """Frames of the bodies of a path in that of the first actuator, with the joint at a value."""
    frames = [g.ORIGIN]
    for k, body in enumerate(path):
        frame = body.placed(frames[-1], home=False)
        frames.append(body.moved(frame, by) if k == pair.joint else frame)
    return frames[1:]


def _turns_in_place(a: Solid, pair: Consecutive, path: Sequence[Body]) -> bool:
    """Whether the first actuator is a body of revolution about the axis of the hinge."""
    joint = _joint(pair, path)
    if joint is None or pair.joint is None or joint.slide or not isinstance(a, Cylinder):
        return False
    origin, rotation = _frames(pair, path, 0.0)[pair.joint]
    axis = g.rotate(rotation, joint.axis)
    return _parallel(a.axis, axis) and _parallel(g.subtract(a.center, origin), axis)


def _parallel(a: Vector, b: Vector) -> bool:
    return every(g.norm(g.cross(a, b)) < 1e-9)


def limb_overlaps(design: Design, plan: Plan) -> Iterator[Finding]:
    """Limbs that overlap in the neutral pose."""
    if not plan.limb_pairs:
        return
    bodies, reuse, pose = design.bodies, plan.reuse(design.count), Pose(design, home=False)

    def limb(k: int) -> Iterator[Solid]:
        """Solids of a limb, body by body, because those of many designs are large."""
        return (each for i in plan.limbs[k] for each in pose.solids(i))

    def box(k: int) -> Box | None:
        of = (x for i in plan.limbs[k] for x in (bodies[i], pose.frame(i)))
        return reuse.result(("box", k), lambda *_: solids.box_around(limb(k)), *of)

    boxes = {k: box(k) for k in sorted({k for pair in plan.limb_pairs for k in pair})}
    for i, j in plan.limb_pairs:

        def overlap(one: Box | None, other: Box | None, i: int = i, j: int = j) -> Mask:
            if one is None or other is None:
                return False
            return solids.any_overlap(solids.boxes_meet(one, other), limb(i), limb(j))

        mask = reuse.result(("limbs", i, j), overlap, boxes[i], boxes[j])
        if not some(mask):
            continue
        first, second = (bodies[plan.limbs[k][0]].name for k in (i, j))
        yield from note(
            "limb_overlap",
            f"{first}/{second}",
            mask,
            f"the limbs that begin at '{first}' and '{second}' overlap in the neutral pose",
            "geometry in the neutral pose",
        )
