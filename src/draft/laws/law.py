"""Laws: y = sum_k c_k x1^e_k1 x2^e_k2 ..., or the reciprocal of such a sum, with error bands.

Every factor c_k is positive, so a law is positive, and monotone in an input whose exponents all
have the same sign. With a single term it is a power law. Laws take floats or arrays of shape (N,).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from typing import Any, Literal

from draft.values import Mask, Value, clip, either, power

# Standard deviation over mean absolute deviation of a normal distribution.
_SIGMA_OF_FOLD = math.sqrt(math.pi / 2)
# Ranges are printed to three decimals, so an input may miss its range by half of one.
_PRINTED = 5e-4


@dataclass(frozen=True, slots=True)
class Term:
    """One term: factor c and the exponent of each input."""

    factor: float
    exponents: tuple[float, ...]

    def __call__(self, inputs: Sequence[Value]) -> Value:
        """Value of the term; inputs are floats or arrays of shape (N,)."""
        y: Value = self.factor
        for x, exponent in zip(inputs, self.exponents, strict=True):
            if exponent == 1.0:
                y = y * x
            elif exponent == -1.0:
                y = y / x
            elif exponent == 2.0:
                y = y * (x * x)
            elif exponent == 4.0:
                y = y * (x * x) * (x * x)
            elif exponent != 0.0:
                y = y * power(x, exponent)
        return y


def evaluate(terms: Sequence[Term], reciprocal: bool, inputs: Sequence[Value]) -> Value:
    """Value of a law, or its reciprocal; inputs are floats or arrays of shape (N,)."""
    total = terms[0](inputs)
    for term in terms[1:]:
        total = total + term(inputs)
    return 1.0 / total if reciprocal else total


@dataclass(frozen=True, slots=True)
class Law:
    """A fitted law of actuators or of structure, as stored in the coefficient files.

    Attributes:
        name: its quantity, such as "volume", or the class of parts whose mass it predicts.
        unit: unit of its value; SI.
        formula: the law as text.
        inputs: quantities that it depends on, in the order of a call.
        input_units: unit of each input; SI.
        terms: its terms; none for the scores of a quantity that follows from other laws.
        n: number of rows that it was fitted to.
        ranges: lowest and highest value of each input among the rows.
        held_out: geometric mean fold errors on held-out rows, by the group that is held out: "row",
            "vendor", "family" for modules, "robot", "maker" for parts of robots. Empty for a law
            whose coefficients are from a publication.
        source: origin of the data and the form.
        reciprocal: whether it is the reciprocal of the sum of its terms.
        beyond: behaviour outside the ranges: "law" extrapolates, "proportional" keeps the ratio of
            value to input at the edge (of its only input), "edge" keeps the value at the edge.
        fold: geometric mean fold error of the rows that it was fitted to.
        sigma_log: standard deviation of ln y about the law, where the source gives it.
        r_squared: share of the variance of ln y explained.
        fold_50: fold within which half of all modules of held-out vendors lie.
        fold_90: fold within which 90 % of them lie.
        coverage_50: share of modules inside the 50 % band computed without their vendor.
        coverage_90: the same for the 90 % band.
    """

    name: str
    unit: str
    formula: str
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    terms: tuple[Term, ...]
    n: int
    ranges: Mapping[str, tuple[float, float]]
    held_out: Mapping[str, float]
    source: str
    reciprocal: bool = False
    beyond: Literal["law", "proportional", "edge"] = "law"
    fold: float | None = None
    sigma_log: float | None = None
    r_squared: float | None = None
    fold_50: float | None = None
    fold_90: float | None = None
    coverage_50: float | None = None
    coverage_90: float | None = None

    def __call__(self, *inputs: Value) -> Value:
        """Value of the law at its inputs, in SI units."""
        if self.beyond == "proportional":
            (x,) = inputs
            inside = clip(x, *self.range)
            return self.coefficient * power(inside, self.exponent - 1.0) * x
        if self.beyond == "edge":
            ends = (self.ranges[name] for name in self.inputs)
            inputs = tuple(clip(x, *pair) for x, pair in zip(inputs, ends, strict=True))
        return evaluate(self.terms, self.reciprocal, inputs)

    def inverse(self, value: Value) -> Value:
        """Input at which the law has a value; for laws of one term and one input."""
        return power(value / self.coefficient, 1 / self.exponent)

    def outside(self, x: Value) -> Mask:
        """Mask of inputs outside the fitted range; for laws of one input."""
        low, high = self.range
        return either(x < low - _PRINTED, x > high + _PRINTED)

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

    @property
    def exponent(self) -> float:
        """Exponent of a law of one term and one input."""
        ((exponent,),) = (term.exponents for term in self.terms)
        return exponent

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest input among the rows of a law of one input."""
        (ends,) = self.ranges.values()
        return ends

    @property
    def sigma(self) -> float:
        """Standard deviation of ln y about the law, if errors are log-normal.

        Raises:
            ValueError: the law has no recorded error.
        """
        if self.sigma_log is not None:
            return self.sigma_log
        if self.fold is None:
            raise ValueError(f"the law of {self.name} has no recorded error")
        return sigma_of_fold(self.fold)

    def band(self, share: float = 0.9) -> float:
        """Fold error within which a share of real machines lies.

        Where errors on held-out vendors are known, the band is exact at 0.5 and 0.9; elsewhere
        ln fold is linear in the quantile of a normal distribution. For other laws errors are
        assumed log-normal.
        """
        at = quantile(share)
        if self.fold_50 is None or self.fold_90 is None:
            return math.exp(at * self.sigma)
        half, ninety = quantile(0.5), quantile(0.9)
        low, high = math.log(self.fold_50), math.log(self.fold_90)
        if at <= half:
            return math.exp(low * at / half)
        return math.exp(low + (high - low) * (at - half) / (ninety - half))

    def scaled(self, fold: float) -> Law:
        """Law with every value multiplied by a factor."""
        factor = 1 / fold if self.reciprocal else fold
        terms = tuple(replace(term, factor=term.factor * factor) for term in self.terms)
        return replace(self, terms=terms)

    def record(self) -> dict[str, object]:
        """Plain data for a coefficients file, without the name, which is the key; see `read`."""
        given = {key: value for key, value in asdict(self).items() if value is not None}
        del given["name"]
        return given

    @classmethod
    def read(cls, name: str, record: Mapping[str, Any]) -> Law:
        """Read a law from a record; further entries of the record are ignored.

        Raises:
            KeyError, TypeError, ValueError, AttributeError: the record is invalid.
        """
        own = {key: record[key] for key in _FIELDS if key in record}
        own |= {
            "inputs": tuple(record["inputs"]),
            "input_units": tuple(record["input_units"]),
            "terms": tuple(Term(t["factor"], tuple(t["exponents"])) for t in record["terms"]),
            "ranges": {x: (low, high) for x, (low, high) in record["ranges"].items()},
        }
        return cls(name=name, **own)


_FIELDS = tuple(one.name for one in fields(Law) if one.name != "name")


def sigma_of_fold(fold: float) -> float:
    """Standard deviation of log-normal errors with a given geometric mean fold error."""
    return _SIGMA_OF_FOLD * math.log(fold)


def fold_of_sigma(sigma: float) -> float:
    """Geometric mean fold error of log-normal errors of a standard deviation."""
    return math.exp(sigma / _SIGMA_OF_FOLD)


@lru_cache(maxsize=32)
def quantile(share: float) -> float:
    """Half-width, in standard deviations, of the central share of a normal distribution."""
    from statistics import NormalDist

    return NormalDist().inv_cdf((1 + share) / 2)
