"""Actuator laws: what mass, size and rotor inertia real modules of a given torque have.

Forms and data: arXiv 2609.38405, actuator trends; coefficients: `draft.trends.refit`. Every
function takes floats or arrays of shape (N,).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from draft.values import Value, power

FILE = Path(__file__).resolve().parent / "data" / "actuator_trends.json"


@dataclass(frozen=True, slots=True)
class Trend:
    """A fitted law y = coefficient x1^e1 x2^e2 ..., and how far to trust it.

    Attributes:
        quantity: what it gives.
        unit: its unit.
        formula: the law in words.
        coefficient: the factor.
        exponents: exponent by input.
        n: rows that it was fitted to.
        r_squared: share of the variance of ln y explained.
        leave_one_out: geometric mean fold error of rows held out one by one.
        sigma_log: standard deviation of ln(published / predicted).
        ranges: lowest and highest value of each input among the rows.
        source: where it comes from.
    """

    quantity: str
    unit: str
    formula: str
    coefficient: float
    exponents: Mapping[str, float]
    n: int
    r_squared: float
    leave_one_out: float
    sigma_log: float
    ranges: Mapping[str, tuple[float, float]]
    source: str

    def band(self, share: float = 0.9) -> float:
        """Fold within which a share of real modules lies (log-normal residuals)."""
        return math.exp(_quantile(share) * self.sigma_log)


@lru_cache(maxsize=1)
def trends() -> dict[str, Trend]:
    """The fitted laws by quantity."""
    records = json.loads(FILE.read_text(encoding="utf-8"))
    return {
        quantity: Trend(
            quantity=quantity,
            **{**record, "ranges": {k: tuple(pair) for k, pair in record["ranges"].items()}},
        )
        for quantity, record in records.items()
    }


def mass(peak_torque: Value) -> Value:
    """Mass of a module [kg] from its peak torque [N m]."""
    return _law("mass", peak_torque=peak_torque)


def volume(peak_torque: Value, gear_ratio: Value) -> Value:
    """Volume of the enclosing cylinder [m3] from peak torque [N m] and reduction."""
    return _law("volume", peak_torque=peak_torque, gear_ratio=gear_ratio)


def aspect_ratio(peak_torque: Value, gear_ratio: Value) -> Value:
    """Length over diameter that the catalogue's modules of this torque and reduction have."""
    return _law("aspect_ratio", peak_torque=peak_torque, gear_ratio=gear_ratio)


def peak_torque(no_load_speed: Value, gear_ratio: Value) -> Value:
    """Peak torque [N m] of modules of this output speed [rad/s] and reduction.

    The weakest of the trends: two modules that differ in nothing but size share both inputs.
    """
    return _law("peak_torque", no_load_speed=no_load_speed, gear_ratio=gear_ratio)


def radius(volume: Value, aspect_ratio: Value) -> Value:
    """Radius [m] of a cylinder of this volume [m3] and length over diameter."""
    return power(volume / (2 * math.pi * aspect_ratio), 1 / 3)


def rotor_inertia(radius: Value) -> Value:
    """Inertia of the rotor [kg m2], on the motor side, from the module's radius [m]."""
    r2 = radius * radius
    return trends()["rotor_inertia"].coefficient * r2 * r2


def gear_ratio(no_load_speed: Value) -> Value:
    """Reduction that modules of this output speed [rad/s] have."""
    return _law("gear_ratio", no_load_speed=no_load_speed)


def no_load_speed(gear_ratio: Value) -> Value:
    """Output speed [rad/s] that modules of this reduction have: the inverse of `gear_ratio`."""
    law = trends()["gear_ratio"]
    return power(gear_ratio / law.coefficient, 1 / law.exponents["no_load_speed"])


def _law(quantity: str, **inputs: Value) -> Value:
    law = trends()[quantity]
    result: Value = law.coefficient
    for name, value in inputs.items():
        result = result * power(value, law.exponents[name])
    return result


@lru_cache(maxsize=8)
def _quantile(share: float) -> float:
    """Half-width, in standard deviations, of the central share of a normal distribution."""
    from statistics import NormalDist

    return NormalDist().inv_cdf((1 + share) / 2)
