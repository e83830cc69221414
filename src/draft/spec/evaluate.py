"""Evaluation of expressions, with checks of the range of each number."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from draft import geometry as g
from draft.errors import Problem, ResolveError
from draft.geometry import Vector
from draft.spec.expressions import Expression, Triple
from draft.values import Mask, Value, either, is_array

# Numbers beyond these [SI] are mistakes, and their powers and ratios may overflow a float.
LARGEST = 1e9
SMALLEST = 1e-12


class Evaluator:
    """Evaluates expressions; an invalid number is an error for one design, a marked row for many.

    Attributes:
        env: values by name.
        invalid: mask of the designs with an invalid number (False for none).
    """

    def __init__(self, env: Mapping[str, Value]) -> None:
        self.env = env
        self.invalid: Mask = False

    def number(self, expression: Expression, what: str = "") -> Value:
        """Evaluate a number of either sign."""
        value = expression.value(self.env, what)
        within = -LARGEST <= value <= LARGEST if type(value) is float else abs(value) <= LARGEST
        if within is not True:
            rule = f"must be below {LARGEST:g}"
            self.require(within, expression, what or "this number", value, rule)
        return value

    def at_least_zero(self, expression: Expression, what: str) -> Value:
        """Evaluate a number that must not be negative."""
        value = self.number(expression, what)
        if (holds := value >= 0) is not True:
            self.require(holds, expression, what, value, "must not be negative")
        return value

    def positive(self, expression: Expression, what: str) -> Value:
        """Evaluate a number that must be above zero."""
        value = self.number(expression, what)
        if (holds := value > SMALLEST) is not True:
            self.require(holds, expression, what, value, "must be above zero")
        return value

    def require(
        self, holds: Mask, expression: Expression, what: str, value: Value, rule: str
    ) -> None:
        """Raise for one design, or mark the rows of many, where a number violates a rule."""
        if is_array(holds):
            self.mark(~np.asarray(holds))
        elif not holds:
            raise self.violation(expression, what, value, rule)

    def violation(self, expression: Expression, what: str, value: Value, rule: str) -> ResolveError:
        """Error for a number that violates a rule."""
        shown = f"{value:.6g}" if not is_array(value) else "an array"
        came = f" = '{expression.text}'" if expression.constant is None else ""
        names = [n for n in sorted(expression.names) if not is_array(self.env[n])]
        known = ", ".join(f"{n} = {self.env[n]:.6g}" for n in names)
        remedy = f"with {known}; change the expression or these values" if known else ""
        return ResolveError(
            Problem(f"{what}{came} is {shown}: it {rule}", expression.where, remedy)
        )

    def mark(self, rows: Mask) -> None:
        """Mark designs with an invalid number."""
        self.invalid = either(self.invalid, rows)

    def vector(self, triple: Triple) -> Vector:
        """Evaluate three numbers."""
        return (self.number(triple[0]), self.number(triple[1]), self.number(triple[2]))

    def axis(self, triple: Triple, what: str) -> Vector:
        """Evaluate and normalise an axis."""
        v = self.vector(triple)
        length = g.norm(v)
        if is_array(length):
            self.mark(~np.asarray(length > 1e-9))
        elif not length > 1e-9:
            raise ResolveError(
                Problem(
                    f"the axis of {what} has no length",
                    triple[0].where,
                    "give it a component that is not zero",
                )
            )
        if not is_array(length) and length == 1.0:
            return v
        return g.scale(v, 1.0 / length)
