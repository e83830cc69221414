"""Which policy drives a design, and whether the design lies in the policy's region of validity.

The region of a policy that was trained with one design is that design. A design outside the region
may still be driven: the policy then gets the joints, motors and servo gains of the design, as
training would have given them, and whoever shows the result names what lies outside.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from draft.design import Design
from draft.errors import DraftError, Problem
from draft.learn import policy as shipped
from draft.learn.policy import Policy
from draft.spec import load
from draft.values import scalar

# Numbers of an actuator that the motion depends on.
MOTOR = {
    "peak_torque": "N m",
    "no_load_speed": "rad/s",
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
        name: name of the parameter, or `actuators.CLASS.QUANTITY`.
        value: its value in the design, in SI units.
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
        ranges: lower and upper end of each number in SI units, by the name of the parameter or
            `actuators.CLASS.QUANTITY`; equal where it did not vary.
    """

    name: str
    ranges: Mapping[str, tuple[float, float]]

    @staticmethod
    def of_design(design: Design) -> Region:
        """Return the region of a policy that was trained with one design."""
        return Region(design.reference, {k: (x, x) for k, x in numbers(design).items()})

    def outside(self, design: Design) -> list[Departure]:
        """Numbers of a design outside the region, the largest relative difference first.

        Derived parameters are left out where stated numbers that they follow from are named.
        """
        stated, derived = [], []
        for name, value in numbers(design).items():
            low, high = self.ranges.get(name, (value, value))
            gap = _SAME * max(abs(value), _FLOOR)
            if low - gap <= value <= high + gap:
                continue
            unit, given = _about(design, name)
            (stated if given else derived).append(Departure(name, value, low, high, unit))
        return sorted(stated or derived, key=lambda one: -one.size)


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


def fit(design: Design, skill: str = "walk") -> Fit:
    """Return the policy whose region is nearest to a design.

    Args:
        design: one design.
        skill: "walk", "run", "climb" or "push".

    Raises:
        DraftError: no policy drives its joints; the message names the command that trains one.
    """
    joints = tuple(design.joints)
    found = [
        (one, region, tuple(region.outside(design)))
        for one, region in _regions(skill)
        if one.joints == joints and all(joint.actuator for joint in design.joints.values())
    ]
    if not found:
        cause = f"no policy drives the joints of {design.reference}"
        raise DraftError(Problem(cause, None, f"train one: {train_command(design)}"))
    policy, region, outside = min(found, key=lambda one: sum(_weight(gap) for gap in one[2]))
    return Fit(policy if not outside else _adapted(policy, design), region, outside)


def train_command(design: Design) -> str:
    """Command that trains a policy of a design."""
    return f"draft train {design.reference}"


def _weight(gap: Departure) -> float:
    """Size of a departure; doubling and halving a number weigh the same."""
    return math.log1p(gap.size) if gap.value > gap.high else -math.log1p(-min(gap.size, 0.999))


@lru_cache(maxsize=8)
def _regions(skill: str) -> tuple[tuple[Policy, Region], ...]:
    """Shipped policies of a skill with their regions."""
    spec = load(shipped.ROBOT)
    return tuple(
        (shipped.policy(name, skill), Region.of_design(spec.resolve(name)))
        for name in shipped.designs()
    )


def _adapted(policy: Policy, design: Design) -> Policy:
    """Policy with the home pose, motors and servo gains of a design.

    Training gives servos a stiffness and a damping per peak torque, so both scale with it.
    """
    joints = [design.joints[name] for name in policy.joints]
    motors = [design.actuators[str(joint.actuator)] for joint in joints]
    home = np.array([scalar(joint.home) for joint in joints])
    peak = np.array([scalar(motor.peak_torque) for motor in motors])
    stronger = peak / policy.peak_torque
    return replace(
        policy,
        home=home if home.any() else policy.home,
        peak_torque=peak,
        stall_torque=np.array([scalar(motor.stall_torque) for motor in motors]),
        no_load_speed=np.array([scalar(motor.no_load_speed) for motor in motors]),
        stiffness=policy.stiffness * stronger,
        damping=policy.damping * stronger,
    )
