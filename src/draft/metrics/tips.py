"""Force, speed and manipulability of the tip of an arm, or of the fingers of a hand, at home.

Of several fingers the weakest, slowest or least mobile counts. Joints that are not of the limb are
held. Tips and joints are those of `draft.design.limbs`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from draft import geometry as g
from draft.design import Design
from draft.design.cached import once
from draft.design.legs import GRAVITY
from draft.design.limbs import Column, home_columns, limbs
from draft.geometry import Vector
from draft.metrics.limiting import Limit
from draft.metrics.registry import metric
from draft.metrics.statics import least
from draft.values import Value, divide, every, maximum, power, scalar, where

_SALISBURY = "Salisbury and Craig 1982, IJRR 1(1): tau = J' f"
_MANY = 10  # joints whose speeds are combined with every sign
_PARALLEL = 1e-9


@once
def outer_columns(design: Design) -> tuple[tuple[Column, ...], ...]:
    """Driven hinges at home of the arm, or of every finger where there is none."""
    return tuple(home_columns(design, limb) for limb in limbs(design).outer)


def spare_torque(column: Column) -> Value:
    """Peak torque that the weight of what a joint moves leaves in its worse direction [N m]."""
    return column.actuator.peak_torque - GRAVITY * abs(column.torque)


def _tip_force(column: Column) -> Value:
    return divide(spare_torque(column), g.norm(column.arm))


def _tip_limits(design: Design) -> Iterator[Limit]:
    for one in outer_columns(design):
        for x in one:
            force = scalar(_tip_force(x))
            yield Limit(force, "peak torque", (x.name,), x.actuator.name)


@metric(
    unit="N",
    formula="min over joints of (tau_peak - |tau_gravity|) / |dx_tip/dq|",
    source=f"{_SALISBURY}; the least over all directions of min (tau / |J_i u|) is that of u = J_i",
    better="more",
    limits=_tip_limits,
    base="arm or hand",
)
def tip_force(design: Design) -> Value:
    """Force that the tip can exert in every direction in the home pose, at peak torque [N].

    Below zero if a joint cannot hold the limb itself.
    """
    return least(_tip_force(x) for one in outer_columns(design) for x in one)


@metric(
    unit="m/s",
    formula="max over signs s of |sum of s_i dx_tip/dq_i w_no_load|",
    source="x' = J q'; Yoshikawa 1985, IJRR 4(2)",
    better="more",
    base="arm or hand",
)
def tip_speed(design: Design) -> Value:
    """Largest speed of the tip in the home pose, with joints at their no-load speeds [m/s].

    Beyond ten joints the sign of each further one is that which lengthens the sum, a lower bound.
    """
    return least(map(_speed, outer_columns(design)))


def _speed(columns: tuple[Column, ...]) -> Value:
    sums: list[Vector] = [g.ZERO]
    for k, x in enumerate(columns):
        step = g.scale(x.arm, x.actuator.no_load_speed)
        if k == 0:
            sums = [step]
        elif k < _MANY:
            sums = [found for v in sums for found in (g.add(v, step), g.subtract(v, step))]
        else:
            sums = [g.add(v, g.scale(step, where(g.dot(v, step) < 0, -1.0, 1.0))) for v in sums]
    return maximum(*map(g.norm, sums)) if len(sums) > 1 else g.norm(sums[0])


def directions(columns: tuple[Column, ...]) -> int:
    """Number of directions in which a tip can move, in poses that are not singular.

    Hinges whose axes are all parallel move it in a plane.
    """
    first = columns[0].axis
    planar = all(every(g.norm(g.cross(first, x.axis)) < _PARALLEL) for x in columns[1:])
    return min(len(columns), 2 if planar else 3)


@metric(
    unit="m",
    formula="det(J J')^(1 / 2r), r = 3 directions, or those in which the tip can move: 1 or 2",
    source="w = sqrt det(J J'), Yoshikawa 1985, IJRR 4(2); its r-th root",
    better="more",
    base="arm or hand",
)
def manipulability(design: Design) -> Value:
    """Geometric mean of the tip's speeds per joint speed along the axes of its ellipsoid [m].

    In the home pose; 0 where that is singular. Of a tip that moves in a plane, as that of a finger
    with parallel hinges, it is the mean of two speeds.
    """
    return least(map(_manipulability, outer_columns(design)))


def _manipulability(columns: tuple[Column, ...]) -> Value:
    rank = directions(columns)
    arms = [x.arm for x in columns]
    # Cauchy and Binet: det J J' is the sum of the squares of the minors of J, without cancellation.
    if rank == 1:
        product = g.total(g.dot(a, a) for a in arms)
    elif rank == 2:
        normals = (g.cross(a, b) for a, b in combinations(arms, 2))
        product = g.total(g.dot(normal, normal) for normal in normals)
    else:
        minors = (g.dot(a, g.cross(b, c)) for a, b, c in combinations(arms, 3))
        product = g.total(minor * minor for minor in minors)
    return power(product, 0.5 / rank)


def _finger_force(columns: tuple[Column, ...]) -> Value:
    last = columns[-1].arm
    normal = g.scale(last, divide(1.0, g.norm(last)))
    return least(divide(spare_torque(x), abs(g.dot(x.arm, normal))) for x in columns)


@metric(
    unit="N",
    formula="min over joints of (tau_peak - |tau_gravity|) / |n . dx_tip/dq|, n along dx_tip/dq of "
    "the last joint",
    source=_SALISBURY,
    better="more",
    base="hand",
)
def fingertip_force(design: Design) -> Value:
    """Force of the weakest fingertip across its last link, at home and at peak torque [N].

    It points where the last joint of the finger moves the tip, as that of a pad on an object.
    """
    fingers = limbs(design).fingers
    return least(_finger_force(home_columns(design, finger)) for finger in fingers)
