"""Region of validity of a policy: the bodies that it was trained for, and what lies outside."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from draft.errors import listed
from draft.learn.bodies.features import FEATURES, UNITS, readable
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.policy.matching import Match
from draft.learn.policy.policy import Policy
from draft.values import brief

SAME = 1e-6  # Relative difference below which two numbers are the same.


@dataclass(frozen=True)
class Departure:
    """A feature of a design outside a region.

    Attributes:
        name: name of the feature.
        value: its value in the design, in `unit`.
        low: lower end of the region.
        high: upper end of the region.
        unit: unit.
        for_size: whether the ends are those for the design's leg length and mass: the region holds
            the feature as a share of them.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    for_size: bool = False

    def __str__(self) -> str:
        ends = dict.fromkeys((brief(self.low), brief(self.high)))
        known = " to ".join(ends) + " for its size" * self.for_size
        value = f"{brief(self.value)} {self.unit}".rstrip()
        return f"{self.name} {value} (trained at {known})"

    @property
    def size(self) -> float:
        """Logarithm of the value over the nearer end of the region, or of its inverse."""
        return abs(math.log(self.value / (self.low if self.value < self.low else self.high)))


@dataclass(frozen=True)
class Region:
    """Bodies that a policy was trained for.

    Attributes:
        name: name of the design or family.
        low: lower end of each feature, as its logarithm.
        high: upper end of each feature, as its logarithm.
        corners: ends of stall torque over peak torque of each joint: a limit of the current, which
            no feature shows.
        friction: largest friction and damping at the no-load speed, over the peak torque of the
            joint, which no feature shows either; infinite where it is unknown.
    """

    name: str
    low: tuple[float, ...]
    high: tuple[float, ...]
    corners: tuple[tuple[float, float], ...]
    friction: float = math.inf

    @staticmethod
    def of(name: str, values: ArrayLike, *motors: LeggedRobot | Policy) -> Region:
        """Return the region of a policy.

        Args:
            name: name of the design or family.
            values: features of each body of its training, or their ends, shape (bodies, features).
            motors: the bodies of its training, or the policy, for the motors of their joints.
        """
        known = np.asarray(values, float)
        shapes = np.array([np.divide(one.stall_torque, one.peak_torque) for one in motors])
        corners = zip(shapes.min(axis=0).tolist(), shapes.max(axis=0).tolist(), strict=True)
        low, high = known.min(axis=0).tolist(), known.max(axis=0).tolist()
        return Region(name, tuple(low), tuple(high), tuple(corners))

    def includes(self, member: LeggedRobot, own: ArrayLike, order: Sequence[int]) -> bool:
        """Whether a body lies inside.

        Args:
            member: the body.
            own: its features.
            order: index of its joint, for each joint of the policy.
        """
        return bool(self.holds(own).all()) and next(self.limits(member, order), None) is None

    def limits(self, member: LeggedRobot, order: Sequence[int]) -> Iterator[tuple[int, float]]:
        """Joints of a body with another limit of the current, and the nearest of the training.

        Args:
            member: the body.
            order: index of its joint, for each joint of the policy.

        Yields:
            Index of the joint, and stall torque for its peak torque [N m].
        """
        for joint, ends in zip(order, self.corners, strict=True):
            stall, peak = member.stall_torque[joint], member.peak_torque[joint]
            nearest = min(max(stall, ends[0] * peak), ends[1] * peak)
            if abs(stall - nearest) > SAME * abs(nearest):
                yield joint, nearest

    def holds(self, values: ArrayLike) -> NDArray[np.bool_]:
        """Whether each feature of bodies lies inside, shape (..., features)."""
        found = np.asarray(values, float)
        return (found >= np.subtract(self.low, SAME)) & (found <= np.add(self.high, SAME))

    def outside(self, member: LeggedRobot, own: ArrayLike) -> list[Departure]:
        """Features of a body outside the region, the largest relative difference first.

        The leg length precedes the others, since their ends are those of its size.

        Args:
            member: the body.
            own: its features.
        """
        shown = (readable(values, member).tolist() for values in (own, self.low, self.high))
        found = [
            Departure(name, value, low, high, unit, name != FEATURES[0])
            for name, inside, value, low, high, unit in zip(
                FEATURES, self.holds(own), *shown, UNITS, strict=True
            )
            if not inside
        ]
        return sorted(found, key=lambda one: (one.name != FEATURES[0], -one.size))


def sentence(name: str, outside: Sequence[Departure]) -> str:
    """Sentence that says what lies outside a region of this name; "" for nothing."""
    if not outside:
        return ""
    alike: dict[tuple[str, float, float, float], list[Departure]] = {}
    for gap in outside:  # Joints of all classes may have the same motor.
        quantity = gap.name.split(" of ")[0]
        alike.setdefault((quantity, gap.value, gap.low, gap.high), []).append(gap)
    texts = [
        str(same[0] if len(same) == 1 else replace(same[0], name=quantity))
        for (quantity, *_), same in alike.items()
    ]
    return f"outside the region of the policy of {name}: {listed(texts, 2)}"


def departures(
    region: Region, member: LeggedRobot, seen: ArrayLike, match: Match
) -> tuple[Departure, ...]:
    """Numbers of a robot outside a region of features, the largest difference first.

    Args:
        region: the region.
        member: the robot.
        seen: its features.
        match: match of the policy's joints with its own.
    """
    return (*region.outside(member, seen), *limited(region, member, match))


def limited(region: Region, member: LeggedRobot, match: Match) -> Iterator[Departure]:
    """Joints with another limit of the current."""
    for joint, at in region.limits(member, match.joints):
        name, stall = f"stall torque of {member.joints[joint]}", member.stall_torque[joint]
        yield Departure(name, float(stall), at, at, "N m")
