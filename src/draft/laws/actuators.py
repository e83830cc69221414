"""Actuator laws: what mass, size and rotor inertia real modules of a given torque have.

Two sets of laws are fitted to the same rows: `paper`, the forms of arXiv 2609.38405, and `draft`,
forms of our own that err less on vendors held out (docs/actuator-trends.md). Coefficients, scores
and bands come from `draft.fitting.actuators.refit`. Laws take floats or arrays of shape (N,).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Location, Problem
from draft.laws.law import Term, evaluate
from draft.values import Value, power

FILE = Path(__file__).resolve().parent / "data" / "actuator_trends.json"
SETS = ("draft", "paper")
DEFAULT = "draft"


@dataclass(frozen=True, slots=True)
class Trend:
    """A fitted law, and how far to trust it.

    Attributes:
        quantity: what it gives.
        unit: its unit.
        formula: the law in words.
        inputs: what it needs, in the order of a call.
        terms: its terms; none where it only scores what follows from other laws.
        reciprocal: whether it is one over their sum.
        n: rows that it was fitted to.
        r_squared: share of the variance of ln y explained.
        leave_one_out: geometric mean fold error of rows held out one by one.
        leave_one_vendor_out: that of rows whose vendor is held out.
        leave_one_family_out: that of rows whose family is held out.
        fold_50: fold within which half of all modules of held-out vendors lie.
        fold_90: fold within which 90 % of them lie.
        coverage_50: share of modules inside the first band where it is set without their vendor.
        coverage_90: the same for the second.
        ranges: lowest and highest value of each input among the rows.
        source: where it comes from.
    """

    quantity: str
    unit: str
    formula: str
    inputs: tuple[str, ...]
    terms: tuple[Term, ...]
    reciprocal: bool
    n: int
    r_squared: float
    leave_one_out: float
    leave_one_vendor_out: float
    leave_one_family_out: float
    fold_50: float
    fold_90: float
    coverage_50: float
    coverage_90: float
    ranges: Mapping[str, tuple[float, float]]
    source: str

    def __call__(self, *inputs: Value) -> Value:
        """Value of the law at its inputs, in SI units."""
        return evaluate(self.terms, self.reciprocal, inputs)

    def inverse(self, value: Value) -> Value:
        """The input that gives a value; for laws of one term and one input."""
        (term,) = self.terms
        return power(value / term.factor, 1 / term.exponents[0])

    @property
    def coefficient(self) -> float:
        """Factor of a law of one term."""
        (term,) = self.terms
        return term.factor

    @property
    def exponents(self) -> dict[str, float]:
        """Exponent by input of a law of one term."""
        (term,) = self.terms
        return dict(zip(self.inputs, term.exponents, strict=True))

    def band(self, share: float = 0.9) -> float:
        """Fold within which a share of the modules of other vendors lies.

        Exact at 0.5 and 0.9; between and beyond, ln fold is a straight line over the quantile of a
        normal distribution.
        """
        half, ninety = quantile(0.5), quantile(0.9)
        at, low, high = quantile(share), math.log(self.fold_50), math.log(self.fold_90)
        if at <= half:
            return math.exp(low * at / half)
        return math.exp(low + (high - low) * (at - half) / (ninety - half))

    def scaled(self, fold: float) -> Trend:
        """The same law with every value times a fold."""
        factor = 1 / fold if self.reciprocal else fold
        terms = tuple(replace(term, factor=term.factor * factor) for term in self.terms)
        return replace(self, terms=terms)


@dataclass(frozen=True, slots=True)
class Laws:
    """A set of laws that were fitted together.

    Attributes:
        name: "draft", "paper" or the file that they came from.
        trends: laws by quantity. `radius` and `length` follow from volume and aspect ratio;
            `rotor_inertia` is scored through predicted sizes, `rotor_inertia_of_size` at the
            module's own.
        correlation: how the errors of two laws go together from module to module, each at the
            module's own inputs; 1 with itself.
    """

    name: str
    trends: Mapping[str, Trend]
    correlation: Mapping[tuple[str, str], float]

    def error(self, quantity: str) -> Trend:
        """The record whose band is that of a law's own error, its inputs being known."""
        return self.trends.get(f"{quantity}_of_size", self.trends[quantity])


def radius(volume: Value, aspect_ratio: Value) -> Value:
    """Radius [m] of a cylinder of this volume [m3] and length over diameter."""
    return power(volume / (2 * math.pi * aspect_ratio), 1 / 3)


@lru_cache(maxsize=8)
def laws(name: str = DEFAULT) -> Laws:
    """The set "draft" or "paper" that comes with the package."""
    return _laws(name, _shipped()[name])


@lru_cache(maxsize=8)
def read_laws(path: Path) -> Laws:
    """The `draft` set of a coefficients file that `draft trends fit --out` wrote.

    Raises:
        DraftError: it cannot be read, or is no such file.
    """
    try:
        return _laws(path.name, json.loads(path.read_text(encoding="utf-8"))[DEFAULT])
    except OSError as error:
        cause = f"cannot be read: {(error.strerror or str(error)).lower()}"
    except (ValueError, KeyError, TypeError, AttributeError):
        cause = "holds no actuator trends"
    remedy = "write one: draft trends fit --catalogue YOURS.csv --out FILE"
    raise DraftError(Problem(cause, Location(str(path)), remedy))


@lru_cache(maxsize=1)
def _shipped() -> dict[str, Any]:
    return json.loads(FILE.read_text(encoding="utf-8"))


def _laws(name: str, record: dict[str, Any]) -> Laws:
    names, matrix = record["correlation"]["quantities"], record["correlation"]["matrix"]
    return Laws(
        name,
        {quantity: _trend(quantity, law) for quantity, law in record["laws"].items()},
        {(a, b): matrix[i][k] for i, a in enumerate(names) for k, b in enumerate(names)},
    )


def _trend(quantity: str, record: dict[str, Any]) -> Trend:
    return Trend(
        quantity=quantity,
        **{
            **record,
            "inputs": tuple(record["inputs"]),
            "terms": tuple(Term(t["factor"], tuple(t["exponents"])) for t in record["terms"]),
            "ranges": {name: (low, high) for name, (low, high) in record["ranges"].items()},
        },
    )


@lru_cache(maxsize=32)
def quantile(share: float) -> float:
    """Half-width, in standard deviations, of the central share of a normal distribution."""
    from statistics import NormalDist

    return NormalDist().inv_cdf((1 + share) / 2)
