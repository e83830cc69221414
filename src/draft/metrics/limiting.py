"""What limits a capability: the joint, its actuator and the quantity of it that binds.

A metric that is the smallest of several numbers, such as the payload at which the first joint is
at its rated torque, names each of them by `@metric(limits=...)`, from the terms that it is made of.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from draft.design import Design
from draft.design.actuators import Actuator
from draft.design.legs import LegJoint
from draft.errors import DraftError
from draft.extensions import ExtensionWarning
from draft.metrics.registry import METRICS
from draft.values import Value, scalar

_TIE = 9  # Digits to which legs that are copies agree.
_NONE = 1e9  # Beyond it a lever arm is rounding error, and the joint limits nothing.


class Limit(NamedTuple):
    """One thing that limits a capability.

    Attributes:
        value: the capability if nothing else limited it, in the unit of its metric.
        quantity: what binds, such as "rated torque".
        joints: the joints, one on each leg of a kind; empty where no joint limits.
        actuator: actuator class of the joints; "" for none.
    """

    value: float
    quantity: str
    joints: tuple[str, ...] = ()
    actuator: str = ""


def at_joint(joint: LegJoint, actuator: Actuator, quantity: str, value: Value) -> Limit:
    """Limit by a joint of the legs of one design."""
    return Limit(scalar(value), quantity, joint.names, actuator.name)


def limits(design: Design, names: Sequence[str] = ()) -> dict[str, tuple[Limit, ...]]:
    """Limits of the capabilities of one design by metric, the one that binds first.

        >>> found = draft.metrics.limits(draft.load("humanoid").resolve(), ["payload_rated"])
        >>> found["payload_rated"][0].joints, found["payload_rated"][0].quantity
        (('left_knee', 'right_knee'), 'rated torque')

    Args:
        design: one design.
        names: names of metrics; empty for all. Those without limits are left out.

    Raises:
        DraftError: the design is several, or the limits of an extension's metric fail; of all
            metrics, that one is left out, with a warning.
    """
    if design.count is not None:
        raise DraftError("limits are those of one design", "select one, such as `design[0]`")
    found = {}
    for metric in METRICS.values():
        if metric.limits is None or (names and metric.name not in names):
            continue
        if not metric.fits(design.floating, design.rolls):
            continue
        sign = 1.0 if metric.better == "more" else -1.0
        try:
            with METRICS.calls(metric.name, "correct its limits"):
                known = _merged(metric.limits(design))
        except DraftError as error:
            if names:
                raise
            warnings.warn(error.problems[0].cause, ExtensionWarning, stacklevel=2)
            continue
        if known:
            found[metric.name] = tuple(sorted(known, key=lambda one: sign * one.value))
    return found


def _merged(given: Iterable[Limit]) -> list[Limit]:
    """Limits with legs that tie, which are copies but for rounding, as one."""
    found: dict[object, Limit] = {}
    for one in given:
        if abs(one.value) < _NONE:  # Of NaN as well.
            key = (f"{one.value:.{_TIE}g}", one.quantity, one.actuator, shared_end(one.joints))
            first = found.get(key)
            found[key] = one if first is None else first._replace(joints=first.joints + one.joints)
    return list(found.values())


def where(limit: Limit, among: Sequence[Limit]) -> str:
    """Words for the joints of a limit: what their names end with, if no other joints' do.

    Args:
        limit: the limit.
        among: all limits of the capability.
    """
    end = shared_end(limit.joints)
    others = {one.joints for one in among if one.joints and shared_end(one.joints) == end}
    return end if end and len(others) == 1 else ", ".join(limit.joints)


def shared_end(names: Sequence[str]) -> str:
    """Last words that all names have: "knee" of left_knee and right_knee."""
    words = [name.split("_") for name in names]
    shared: list[str] = []
    for column in zip(*map(reversed, words), strict=False):
        if len(set(column)) > 1:
            break
        shared.insert(0, column[0])
    return "_".join(shared)
