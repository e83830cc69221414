"""Torque of surveyed joints by role, from the leg length.

For each role, ln T = a + b ln(leg), fitted to one median per robot. The slope of a role is shrunk
towards the common slope of the population, since few robots have necks and wrists. `sigma` is the
standard deviation of the error of ln T on held-out robots.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from draft.laws.joint_roles import UNPRICED
from draft.laws.survey import Row, read, usable

# Weight of the common slope, as a sum of squares of ln(leg).
COMMON = 0.5
FEWEST = 3
# One robot: its key, ln(leg), and ln of its median torque by role.
Sample = tuple[str, float, dict[str, float]]


@dataclass(frozen=True, slots=True)
class TorqueLaw:
    """Torque of joints of one role.

    Attributes:
        factor: torque at a leg of 1 m [N m].
        exponent: exponent of the leg length [1].
        sigma: standard deviation of the error of ln(torque) on held-out robots [1].
        n: number of robots.
        legs: shortest and longest leg of those robots [m].
    """

    factor: float
    exponent: float
    sigma: float
    n: int
    legs: tuple[float, float]

    def __call__(self, leg: float) -> float:
        """Torque of such a joint [N m] on a robot with a leg length [m]."""
        return self.factor * leg**self.exponent


@lru_cache(maxsize=64)
def torque_laws(population: str, without: frozenset[str] = frozenset()) -> dict[str, TorqueLaw]:
    """Laws by role, fitted to the surveyed robots of a population.

    Args:
        population: "humanoid" or "quadruped".
        without: keys of robots that are held out.
    """
    samples = [one for one in _samples(population) if one[0] not in without]
    lines = _fit(samples)
    errors: dict[str, list[float]] = {}
    for i, (_, leg, torques) in enumerate(samples):
        rest = _fit(samples[:i] + samples[i + 1 :])
        for role, torque in torques.items():
            if role in rest:
                a, b = rest[role]
                errors.setdefault(role, []).append(a + b * leg - torque)
    laws: dict[str, TorqueLaw] = {}
    for role, (a, b) in lines.items():
        legs = [math.exp(leg) for _, leg, torques in samples if role in torques]
        sigma = float(np.sqrt(np.mean(np.square(errors.get(role, [1.0])))))
        laws[role] = TorqueLaw(math.exp(a), b, sigma, len(legs), (min(legs), max(legs)))
    return laws


def _fit(samples: Collection[Sample]) -> dict[str, tuple[float, float]]:
    """Intercept and slope by role."""
    by_role: dict[str, list[tuple[float, float]]] = {}
    for _, leg, torques in samples:
        for role, torque in torques.items():
            by_role.setdefault(role, []).append((leg, torque))
    parts = {role: _centred(pairs) for role, pairs in by_role.items()}
    common = sum(part[2] for part in parts.values()) / sum(part[3] for part in parts.values())
    lines: dict[str, tuple[float, float]] = {}
    for role, (leg, torque, product, square) in parts.items():
        enough = len(by_role[role]) >= FEWEST
        slope = (product + COMMON * common) / (square + COMMON) if enough else common
        lines[role] = (torque - slope * leg, slope)
    return lines


def _centred(pairs: Collection[tuple[float, float]]) -> tuple[float, float, float, float]:
    """Means of ln(leg) and ln(torque), and the sums of products and squares about them."""
    table = np.array(list(pairs))
    mean = table.mean(axis=0)
    deviations = table - mean
    products = deviations[:, 0] @ deviations
    return float(mean[0]), float(mean[1]), float(products[1]), float(products[0])


@lru_cache(maxsize=2)
def _samples(population: str) -> tuple[Sample, ...]:
    by_robot: dict[str, list[Row]] = {}
    for row in read():
        if row.population == population:
            by_robot.setdefault(row.robot, []).append(row)
    samples: list[Sample] = []
    for robot, rows in by_robot.items():
        parts = [[r.length for r in rows if r.kind == kind] for kind in ("thigh", "shank")]
        if not all(parts):
            continue
        leg = math.log(sum(float(np.median(lengths)) for lengths in parts))
        torques: dict[str, list[float]] = {}
        for row in rows:
            for role, effort in zip(row.roles, row.efforts, strict=True):
                if role and usable(effort) and (role == "wheel" or role not in UNPRICED):
                    torques.setdefault(role, []).append(math.log(effort))
        samples.append((robot, leg, {role: float(np.median(x)) for role, x in torques.items()}))
    return tuple(samples)
