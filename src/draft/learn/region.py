"""Which policy drives a design, and whether the design lies in the policy's region of validity.

The region of a policy that was trained with one design is that design, by its parameters and
motors. The region of a policy that observes its design is the range of each feature of the bodies
that it was trained with. A design outside the region may still be driven: the policy then gets the
joints, motors and servo gains of the design, as training would have given them, observes features
at the nearest end of their range, and whoever shows the result names what lies outside.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from draft.design import Design
from draft.errors import DraftError, Problem
from draft.learn import policy as shipped
from draft.learn.features import FEATURES, UNITS, features, readable
from draft.learn.legged import legged_robot
from draft.learn.policy import Policy
from draft.model import Model
from draft.spec import load
from draft.values import scalar

# Numbers of an actuator that the motion depends on.
MOTOR = {
    "peak_torque": "N m",
    "no_load_speed": "rad/s",
    "corner_speed": "rad/s",
    "mass": "kg",
    "armature": "kg m2",
    "friction_loss": "N m",
    "damping": "N m s/rad",
}
# Relative difference below which two numbers are the same.
_SAME = 1e-6
_FLOOR = 1e-3  # Smallest divisor of a relative difference: many numbers can be zero.


@dataclass(frozen=True)
class Departure:
    """A number of a design outside a region.

    Attributes:
        name: name of the parameter, `actuators.CLASS.QUANTITY`, or name of the feature.
        value: its value in the design, in `unit`.
        low: lower end of the region.
        high: upper end of the region.
        unit: unit; "" for none.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        ends = f"{self.low:.4g}"
        if self.high != self.low:
            ends = f"{self.low:.4g} to {self.high:.4g}"
        return f"{self.name} {self.value:.4g} {self.unit}".rstrip() + f" (trained at {ends})"

    @property
    def size(self) -> float:
        """Distance from the region over its nearer end."""
        end = self.low if self.value < self.low else self.high
        return abs(self.value - end) / max(abs(end), _FLOOR)


@dataclass(frozen=True)
class Region:
    """Designs that a policy was trained for.

    Attributes:
        name: name of the design or family.
        ranges: lower and upper end of each number, equal where it did not vary: SI units by the
            name of the parameter or `actuators.CLASS.QUANTITY`, or `draft.learn.features.UNITS` by
            the name of the feature.
        observed: whether the numbers are the features that the policy observes.
    """

    name: str
    ranges: Mapping[str, tuple[float, float]]
    observed: bool = False

    @staticmethod
    def of_design(design: Design) -> Region:
        """Return the region of a policy that was trained with one design."""
        return Region(design.reference, {k: (x, x) for k, x in numbers(design).items()})

    @staticmethod
    def of_features(name: str, values: ArrayLike) -> Region:
        """Return the region of a policy that was trained with bodies.

        Args:
            name: name of the family.
            values: logarithms of the features of each body, or the ends of their ranges, shape
                (bodies, features).
        """
        known = readable(values)
        ends = zip(known.min(axis=0).tolist(), known.max(axis=0).tolist(), strict=True)
        return Region(name, dict(zip(FEATURES, ends, strict=True)), observed=True)

    def outside(self, model: Model) -> list[Departure]:
        """Numbers of a design outside the region, the largest relative difference first.

        Derived parameters are left out where stated numbers that they follow from are named.

        Raises:
            DraftError: the region is one of features, and the design cannot be trained.
        """
        design = model.design
        if self.observed:
            return self.beyond(features(legged_robot(design, model)))
        stated, derived = [], []
        for name, value in numbers(design).items():
            if not self._holds(name, value):
                unit, given = _about(design, name)
                (stated if given else derived).append(self._departure(name, value, unit))
        return sorted(stated or derived, key=lambda one: -one.size)

    def beyond(self, logarithms: Sequence[float]) -> list[Departure]:
        """Features outside a region of features, the largest relative difference first."""
        found = [
            self._departure(name, value, unit)
            for name, value, unit in zip(FEATURES, readable(logarithms), UNITS, strict=True)
            if not self._holds(name, float(value))
        ]
        return sorted(found, key=lambda one: -one.size)

    def _holds(self, name: str, value: float) -> bool:
        low, high = self.ranges.get(name, (value, value))
        gap = _SAME * max(abs(value), _FLOOR)
        return low - gap <= value <= high + gap

    def _departure(self, name: str, value: float, unit: str) -> Departure:
        return Departure(name, float(value), *self.ranges[name], unit)


@dataclass(frozen=True)
class Fit:
    """A policy for a design.

    Attributes:
        policy: the policy with the numbers of the design's joints and motors.
        region: region of validity of the policy.
        outside: numbers of the design outside the region; none inside it.
    """

    policy: Policy
    region: Region
    outside: tuple[Departure, ...]

    @property
    def inside(self) -> bool:
        """Whether the design lies in the region of validity."""
        return not self.outside

    @cached_property
    def warning(self) -> str:
        """Sentence that says what lies outside the region; "" inside it."""
        if self.inside:
            return ""
        named = ", ".join(map(str, self.outside[:2]))
        more = f" and {len(self.outside) - 2} more" if len(self.outside) > 2 else ""
        return f"outside the region of the policy of {self.region.name}: {named}{more}"


def numbers(design: Design) -> dict[str, float]:
    """Numbers of one design that its motion depends on, in SI units, by name."""
    found = {name: scalar(value) for name, value in design.parameters.items()}
    for actuator in design.actuators.values():
        for quantity in MOTOR:
            found[f"actuators.{actuator.name}.{quantity}"] = scalar(getattr(actuator, quantity))
    return found


def _about(design: Design, name: str) -> tuple[str, bool]:
    """Unit of a number, and whether the design states it."""
    if name in design.parameters:
        parameter = design.spec.parameters[name]
        unit = "" if parameter.unit == "1" else parameter.unit
        return unit, parameter.value.constant is not None
    _, actuator, quantity = name.split(".")
    origin = design.actuators[actuator].origins.get(quantity)
    return MOTOR[quantity], origin is not None and origin.kind == "stated"


def fit(model: Model, skill: str = "walk") -> Fit:
    """Return the policy whose region is nearest to a design.

    Args:
        model: the robot; the filter may have refused it.
        skill: "walk", "run", "climb" or "push".

    Raises:
        DraftError: no policy drives its joints; the message names the command that trains one.
    """
    design = model.design
    joints = tuple(design.joints)
    found = [
        (one, region, tuple(region.outside(model)))
        for one, region in _regions(skill)
        if one.joints == joints and all(joint.actuator for joint in design.joints.values())
    ]
    if not found:
        cause = f"no policy drives the joints of {design.reference}"
        raise DraftError(Problem(cause, None, f"train one: {train_command(design)}"))
    policy, region, outside = min(found, key=lambda one: sum(_weight(gap) for gap in one[2]))
    own = not outside and not region.observed
    return Fit(policy if own else _adapted(policy, model), region, outside)


def train_command(design: Design) -> str:
    """Command that trains a policy of a design."""
    return f"draft train {design.reference}"


def _weight(gap: Departure) -> float:
    """Size of a departure; doubling and halving a number weigh the same."""
    return math.log1p(gap.size) if gap.value > gap.high else -math.log1p(-min(gap.size, 0.999))


@lru_cache(maxsize=8)
def _regions(skill: str) -> tuple[tuple[Policy, Region], ...]:
    """Shipped policies of a skill with their regions, those of one design first."""
    spec = load(shipped.ROBOT)
    found = [
        (shipped.policy(name, skill), Region.of_design(spec.resolve(name)))
        for name in shipped.designs()
    ]
    if skill in shipped.FAMILY_SKILLS and shipped.FAMILY.is_file():
        family = shipped.open_policy(shipped.FAMILY)
        found.append((family, Region.of_features(f"a family of {spec.name}s", family.known)))
    return tuple(found)


def _adapted(policy: Policy, model: Model) -> Policy:
    """Policy with the home pose, motors and servo gains of a design, and the features of it.

    Training gives servos a stiffness and a damping per peak torque, so both scale with it.
    """
    design = model.design
    joints = [design.joints[name] for name in policy.joints]
    motors = [design.actuators[str(joint.actuator)] for joint in joints]
    home = np.array([scalar(joint.home) for joint in joints])
    peak = np.array([scalar(motor.peak_torque) for motor in motors])
    stronger = peak / policy.peak_torque
    seen = policy.features
    if len(seen):
        seen = np.clip(features(legged_robot(design, model)), *policy.known)
    return replace(
        policy,
        home=home if home.any() else policy.home,
        peak_torque=peak,
        stall_torque=np.array([scalar(motor.stall_torque) for motor in motors]),
        no_load_speed=np.array([scalar(motor.no_load_speed) for motor in motors]),
        stiffness=policy.stiffness * stronger,
        damping=policy.damping * stronger,
        features=seen,
    )
