"""Static torques of the joints, and force and speed of a foot; see `draft.design.loads`.

Unless another pose is named a robot on legs is in the crouch, and an arm on a fixed base reaches
as far as it can (`draft.metrics.stretch`), with its payload at its tip.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.legs import GRAVITY
from draft.design.loads import LegLoad, Load, home_loads, loads
from draft.metrics.limiting import Limit, at_joint
from draft.metrics.registry import metric
from draft.metrics.stretch import stretched
from draft.values import Value, divide, maximum, minimum, scalar, where

_STATICS = "Murray, Li, Sastry 1994, A Mathematical Introduction to Robotic Manipulation, 3.4"
# Share of the peak torque below which a torque is rounding error.
ROUNDING = 1e-9


def joint_margins(design: Design) -> dict[str, Value]:
    """Peak torque over the torque that holds the robot in the crouch [1], by joint of the legs.

    inf for a joint without load.
    """
    margins = {}
    for load in loads(design):
        peak, torque = load.actuator.peak_torque, abs(load.torque)
        with np.errstate(divide="ignore"):
            margin = where(torque > ROUNDING * peak, divide(peak, torque), math.inf)
        margins |= dict.fromkeys(load.joint.names, margin)
    return margins


def _margin_limits(design: Design) -> Iterator[Limit]:
    for x in loads(design):
        yield at_joint(x.joint, x.actuator, "peak torque", _margin(x))


def _margin(load: Load) -> Value:
    """Peak torque over the torque that holds the robot [1]."""
    return divide(load.actuator.peak_torque, abs(load.torque))


@metric(
    unit="1",
    formula="min of tau_peak / |sum m g dz/dq - (M g / n) dz_foot/dq| in the crouch",
    source=_STATICS,
    better="more",
    limits=_margin_limits,
    base="floating",
)
def torque_margin(design: Design) -> Value:
    """Smallest ratio of peak torque to standing torque of the joints of the legs [1]."""
    return least(map(_margin, loads(design)))


def _standing_limits(design: Design) -> Iterator[Limit]:
    for x in home_loads(design):
        yield at_joint(x.joint, x.actuator, "rated torque", _rated_share(x))


def _rated_share(load: Load) -> Value:
    """Torque that holds the robot over the rated torque [1]."""
    return divide(abs(load.torque), load.actuator.rated_torque)


@metric(
    unit="1",
    formula="max of |sum m g dz/dq - (M g / n) dz_foot/dq| / tau_rated in the home pose",
    source=_STATICS,
    better="less",
    limits=_standing_limits,
    base="floating",
)
def standing_torque_rated(design: Design) -> Value:
    """Largest share of its rated torque that a joint of the legs needs in the home pose [1]."""
    shares = [_rated_share(x) for x in home_loads(design)]
    return maximum(*shares) if shares else math.nan


def payload_limits(share: float) -> Callable[[Design], Iterator[Limit]]:
    """What limits `payload_at` a share of the rated torque [1], of one design."""

    def found(design: Design) -> Iterator[Limit]:
        for x in carrying(design):
            rated = share * scalar(x.actuator.rated_torque) <= scalar(x.actuator.peak_torque)
            quantity = "rated torque" if rated else "peak torque"
            yield at_joint(x.joint, x.actuator, quantity, _payload(x, share))

    return found


@metric(
    unit="kg",
    formula="min of (tau_rated - tau sign) / |(g / n) dz_foot/dq| in the crouch; of an arm with "
    "g dz_tip/dq at its reach",
    source=_STATICS,
    better="more",
    limits=payload_limits(1.0),
    base="floating or arm",
)
def payload_rated(design: Design) -> Value:
    """Mass on the trunk, or at the tip of an arm at its reach, at a first rated torque [kg].

    Below zero the robot cannot hold its own weight at rated torque in that pose, and is too heavy
    by that mass; `overload` tells the joint. In the home pose, mostly straighter, it may
    (`standing_torque_rated`). A rating holds for an actuator that turns; at stall it is about 0.7
    of that (docs/limits.md).
    """
    return payload_at(design, 1.0)


@metric(
    unit="kg",
    formula="min of (tau_peak - tau sign) / |(g / n) dz_foot/dq| in the crouch; of an arm with "
    "g dz_tip/dq at its reach",
    source=_STATICS,
    better="more",
    limits=payload_limits(math.inf),
    base="floating or arm",
)
def payload_peak(design: Design) -> Value:
    """Mass on the trunk, or at the tip of an arm at its reach, at a first peak torque [kg].

    Below zero if a joint cannot hold the robot alone. Heat is neglected: for longer than a few
    seconds the payload is smaller.
    """
    return payload_at(design, math.inf)


class Overload(NamedTuple):
    """A joint that exceeds its rated torque with the robot alone.

    Attributes:
        joint: its name.
        torque: torque that holds the robot in the crouch, or the arm at its reach [N m].
        rated: rated torque of its actuator [N m].
    """

    joint: str
    torque: float
    rated: float


def overload(design: Design) -> Overload | None:
    """Joint that exceeds its rated torque most, of one design; None if none does.

    In the crouch, or with an arm at its reach.

    >>> draft.metrics.overload(draft.load("humanoid").resolve()).joint
    'left_knee'
    """
    found = [
        Overload(x.joint.names[0], abs(scalar(x.torque)), scalar(x.actuator.rated_torque))
        for x in carrying(design)
    ]
    worst = max(found, key=lambda one: one.torque / one.rated, default=None)
    return worst if worst is not None and worst.torque > worst.rated else None


def carrying(design: Design) -> tuple[Load, ...]:
    """Loads of the joints that carry a payload: of the legs, or of an arm that reaches furthest."""
    stretch = stretched(design)
    return loads(design) if stretch is None else stretch.loads


def payload_at(design: Design, share: Value) -> Value:
    """Mass at which the first joint reaches a share of its rated torque [kg]; see `carrying`.

    Args:
        design: one design, or N.
        share: torque over rated torque [1]; the peak torque limits it.
    """
    return least(_payload(x, share) for x in carrying(design))


def _payload(load: Load, share: Value) -> Value:
    """Mass on the trunk at which one joint reaches a share of its rated torque [kg]."""
    return divide(
        minimum(load.actuator.peak_torque, share * load.actuator.rated_torque)
        - where(load.per_mass < 0, -1.0 * load.torque, load.torque),
        abs(load.per_mass),
    )


@metric(
    unit="1",
    formula="min of tau_peak / |dz_foot/dq| / (M g) in the crouch",
    source=_STATICS,
    better="more",
    base="floating",
)
def foot_force(design: Design) -> Value:
    """Vertical force of one foot at peak torque, per body weight [1].

    It is limited by the first joint that reaches its peak torque. The weight of the leg is
    neglected. The weakest kind of leg counts.
    """
    force = least(divide(x.actuator.peak_torque, abs(x.joint.lift)) for x in loads(design))
    return force / (GRAVITY * design.mass)


@metric(
    unit="m/s",
    formula="sum of |dx_foot/dq| w_no_load in the crouch",
    source=_STATICS,
    better="more",
    base="floating",
)
def foot_speed(design: Design) -> Value:
    """Forward speed of the foot with every joint at its no-load speed [m/s].

    The signs of the joint speeds are such that they add up. The slowest kind of leg counts.
    """
    found = loads(design)
    return least(
        g.total(abs(x.joint.sweep) * x.actuator.no_load_speed for x in found if x.leg is leg)
        for leg in {id(x.leg): x.leg for x in found}.values()
    )


@metric(
    unit="W/kg",
    formula="sum of k tau^2 / M",
    source="heat k tau^2 of a motor, docs/limits.md",
    better="less",
    base="floating",
)
def cost_of_standing(design: Design) -> Value:
    """Copper loss of the motors of the legs in the crouch, per mass [W/kg].

    The heat of a torque is that of `draft.laws.limits.copper_loss`: of the motor's torque-speed
    line, or of what its housing gives off at the rated torque, the lesser.
    """
    found = loads(design)
    if not found:
        return math.nan
    return g.total(map(heat, found)) / design.mass


def heat(load: LegLoad) -> Value:
    """Copper loss of a joint on all legs of its kind in the crouch [W]."""
    return load.leg.copies * load.torque * load.torque * load.actuator.copper_loss


def least(values: Iterable[Value]) -> Value:
    """Smallest of some values; NaN of none."""
    found = list(values)
    return minimum(*found) if found else math.nan
