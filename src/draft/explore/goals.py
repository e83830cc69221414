"""Goals and constraints of a search."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from draft.design import Design
from draft.errors import DraftError
from draft.explore import where
from draft.explore.where import Condition
from draft.metrics import LEARNED
from draft.spec import Spec
from draft.values import Array, Value

_WORST = 1e9  # violation by a design for which a compared number is undefined
_LEAST = 1e-9  # violation by a design that is at a limit, and size of a limit of zero


@dataclass(frozen=True, slots=True)
class Goal:
    """A number to minimise or maximise.

    Attributes:
        text: a metric or an expression, as written.
        less: whether to minimise it.
        value: the expression.
    """

    text: str
    less: bool
    value: Condition

    def of(self, design: Design, metrics: Mapping[str, Value]) -> Array:
        """Value for N designs, shape (N,); NaN where it is undefined."""
        found = np.asarray(self.value.value(design, metrics), dtype=np.float64)
        return np.broadcast_to(found, (design.count or 1,))


@dataclass(frozen=True, slots=True)
class Constraint:
    """A condition that designs must meet.

    Attributes:
        text: the condition, as written.
        holds: the condition.
        gap: smaller and larger side of a comparison; None for any other condition.
        limit: which of them is the limit that the other side is compared with.
    """

    text: str
    holds: Condition
    gap: tuple[Condition, Condition] | None
    limit: int = 1

    def violation(self, design: Design, metrics: Mapping[str, Value]) -> Array:
        """Violation by each design, shape (N,); zero where the condition holds.

        For a comparison it is the difference of the sides over the larger of them. Where they have
        not the same sign, which leaves no such size, it is one and the logarithm of the compared
        side over the limit: it grows with the distance, whatever the limit, and so gives a search
        a direction. For any other condition it is one.
        """
        holds = self.holds.holds(design, metrics)
        violation: Array = np.ones(design.count or 1)
        if self.gap is not None:
            sides = [np.asarray(one.value(design, metrics), dtype=np.float64) for one in self.gap]
            (small, large), limit = sides, np.maximum(abs(sides[self.limit]), _LEAST)
            size = np.maximum(np.maximum(abs(small), abs(large)), _LEAST)
            alike = (small * large > 0) & (limit > _LEAST)
            with np.errstate(invalid="ignore"):  # Both may be without a limit.
                apart = 1.0 + np.log1p(abs(sides[1 - self.limit]) / limit)
                found = np.where(alike, (small - large) / size, apart)
                violation = np.broadcast_to(found, violation.shape)
            # A strict comparison also fails for equal sides.
            finite = np.isfinite(violation)
            violation = np.where(finite, np.maximum(violation, _LEAST), _WORST)
        return np.where(holds, 0.0, violation)


def goals(spec: Spec, minimise: Sequence[str], maximise: Sequence[str]) -> tuple[Goal, ...]:
    """Parse the goals of a search.

    Args:
        spec: the robot.
        minimise: metrics or expressions to minimise.
        maximise: metrics or expressions to maximise.

    Raises:
        DraftError: there is no goal, one is given twice, or a name is unknown.
    """
    if not (minimise or maximise):
        remedy = "give `minimise` or `maximise`, such as `minimise` mass"
        raise DraftError("there is nothing to optimise", remedy)
    found: dict[str, Goal] = {}
    for option, texts in (("`minimise`", minimise), ("`maximise`", maximise)):
        for text in texts:
            if text in found:
                raise DraftError(f"the goal '{text}' is given twice", "give it once")
            value = where.condition(spec, text, option)
            found[text] = Goal(text, option == "`minimise`", value)
    return tuple(found.values())


def constraints(spec: Spec, texts: Sequence[str]) -> tuple[Constraint, ...]:
    """Parse constraints; each part of an `and` becomes a constraint.

    Raises:
        DraftError: a text is not an expression or is a number, or a name is unknown.
    """
    found: list[Constraint] = []
    for text in texts:
        found += [_constraint(spec, node) for node in where.parts(spec, text, "`subject_to`")]
    return tuple(found)


def _constraint(spec: Spec, node: ast.expr) -> Constraint:
    def condition(part: ast.expr) -> Condition:
        return where.condition(spec, ast.unparse(part), "`subject_to`")

    gap, limit = None, 1
    match node:
        case ast.Compare(left=left, ops=[ast.Lt() | ast.LtE()], comparators=[right]):
            gap = (condition(left), condition(right))
        case ast.Compare(left=left, ops=[ast.Gt() | ast.GtE()], comparators=[right]):
            gap, limit = (condition(right), condition(left)), 0
    if gap is not None and not gap[1 - limit].expression.names:
        limit = 1 - limit  # A number is on the left.
    return Constraint(ast.unparse(node), condition(node), gap, limit)


def by_rollouts(condition: Constraint) -> bool:
    """Whether a condition needs roll-outs."""
    return any(name in LEARNED for name in condition.holds.metrics)
