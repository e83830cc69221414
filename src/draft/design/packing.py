"""Overlap of consecutive actuators, and of limbs."""

from __future__ import annotations

from collections.abc import Iterator

from draft import geometry as g
from draft.design import solids
from draft.design.design import Body, Design
from draft.design.findings import Finding, note
from draft.design.plan import Consecutive, Plan
from draft.geometry import Vector
from draft.values import Mask, Value, both, clip, every, some

# Positions of a joint at which consecutive actuators are compared.
_POSITIONS = 9


def actuator_overlaps(design: Design, plan: Plan) -> Iterator[Finding]:
    """Consecutive actuators that overlap at every position of their joint."""
    for pair in plan.consecutive:
        first, second = design.bodies[pair.first], design.bodies[pair.second]
        yield from note(
            "actuator_overlap",
            f"{first.name}/{second.name}",
            _always_overlap(design, pair),
            f"the actuators on '{first.name}' and '{second.name}' occupy the same space at every "
            f"{'position of the slide' if _slides(design, pair) else 'joint angle'}",
            "actuator sizes and link lengths",
        )


def _always_overlap(design: Design, pair: Consecutive) -> Mask:
    """Whether two consecutive actuators overlap at every position of the joint between them."""
    bodies = design.bodies
    motor = bodies[pair.first].motor_geom
    if motor is None:
        return False
    a = solids.solid(motor, (g.ZERO, None))
    joint = None if pair.joint is None else bodies[pair.joint].joint
    low, high = joint.range if joint is not None else (0.0, 0.0)
    nearest = _relative(bodies, pair, clip(0.0, low, high))
    if nearest is None:
        return False
    always = solids.overlap(a, nearest)
    if joint is None or not some(always) or _turns_in_place(a, design, pair):
        return always
    for k in range(_POSITIONS):
        moved = _relative(bodies, pair, low + (high - low) * (k / (_POSITIONS - 1)))
        if moved is not None:
            always = both(always, solids.overlap(a, moved))
        if not some(always):
            break
    return always


def _relative(bodies: tuple[Body, ...], pair: Consecutive, by: Value) -> solids.Solid | None:
    """Second actuator in the frame of the first, with the joint between them at a value."""
    path = [pair.second]
    while path[-1] != pair.first:
        parent = bodies[path[-1]].parent
        if parent is None:
            return None
        path.append(parent)
    frame = (g.ZERO, None)
    for i in reversed(path[:-1]):
        body = bodies[i]
        origin = g.add(frame[0], g.rotate(frame[1], body.position))
        frame = (origin, g.compose(frame[1], body.rotation))
        if i == pair.joint:
            frame = body.moved(frame, by)
    motor = bodies[pair.second].motor_geom
    return None if motor is None else solids.solid(motor, frame)


def _slides(design: Design, pair: Consecutive) -> bool:
    """Whether the joint between two actuators is a slide."""
    joint = None if pair.joint is None else design.bodies[pair.joint].joint
    return joint is not None and joint.slide


def _turns_in_place(a: solids.Solid, design: Design, pair: Consecutive) -> bool:
    """Whether the first actuator is a body of revolution about the axis of the hinge."""
    bodies = design.bodies
    if _slides(design, pair):
        return False
    path: list[int] = []
    i: int | None = pair.joint
    while i is not None and i != pair.first:
        path.append(i)
        i = bodies[i].parent
    frame = (g.ZERO, None)
    for i in reversed(path):
        body = bodies[i]
        frame = (
            g.add(frame[0], g.rotate(frame[1], body.position)),
            g.compose(frame[1], body.rotation),
        )
    axis = g.rotate(frame[1], bodies[path[0]].joint_axis)
    offset = g.subtract(a.center, frame[0])
    return _parallel(a.axis, axis) and _parallel(offset, axis)


def _parallel(a: Vector, b: Vector) -> bool:
    return every(g.norm(g.cross(a, b)) < 1e-9)


def limb_overlaps(design: Design, plan: Plan) -> Iterator[Finding]:
    """Limbs that overlap in the neutral pose."""
    if not plan.limb_pairs:
        return
    frames = design.frames()
    boxes: dict[int, solids.Box | None] = {}
    kept: dict[int, list[solids.Solid]] = {}
    for limb in sorted({i for pair in plan.limb_pairs for i in pair}):
        found = _solids(design, frames, plan.limbs[limb])
        if design.count is None:  # for many designs they are large, and computed again where needed
            kept[limb] = found = list(found)
        boxes[limb] = solids.box_around(found)
    for i, j in plan.limb_pairs:
        box_i, box_j = boxes[i], boxes[j]
        if box_i is None or box_j is None:
            continue
        meet = solids.boxes_meet(box_i, box_j)
        if not some(meet):
            continue
        one, other = (kept.get(k) or _solids(design, frames, plan.limbs[k]) for k in (i, j))
        first, second = (design.bodies[plan.limbs[k][0]].name for k in (i, j))
        yield from note(
            "limb_overlap",
            f"{first}/{second}",
            solids.any_overlap(meet, one, other),
            f"the limbs that begin at '{first}' and '{second}' overlap in the neutral pose",
            "geometry in the neutral pose",
        )


def _solids(
    design: Design, frames: list[tuple[Vector, g.Rotation]], bodies: tuple[int, ...]
) -> Iterator[solids.Solid]:
    """Solids of some bodies, one at a time, because those of many designs are large."""
    for k in bodies:
        for geom in design.bodies[k].solids():
            yield solids.solid(geom, frames[k])
