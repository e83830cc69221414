"""Laws: y = sum_k c_k x1^e_k1 x2^e_k2 ..., or one over such a sum.

Every factor c_k is positive, so a law is positive, and monotone in an input whose exponents have
one sign. With a single term it is a power law.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from draft.values import Value, power


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
    """Value of a law, or of one over it; inputs are floats or arrays of shape (N,)."""
    total = terms[0](inputs)
    for term in terms[1:]:
        total = total + term(inputs)
    return 1.0 / total if reciprocal else total
