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
from draft.spec.expressions import syntax_tree
from draft.values import Array, Value

_WORST = 1e9  # violation by a design for which a compared number is undefined


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
    """

    text: str
    holds: Condition
    gap: tuple[Condition, Condition] | None

    def violation(self, design: Design, metrics: Mapping[str, Value]) -> Array:
        """Violation by each design, shape (N,); zero where the condition holds.

        For a comparison it is the difference of the sides over the larger of them, which gives a
        search a direction; for any other condition it is one.
        """
        holds = self.holds.holds(design, metrics)
        violation: Array = np.ones(design.count or 1)
        if self.gap is not None:
            small, large = (
                np.asarray(side.value(design, metrics), dtype=np.float64) for side in self.gap
            )
            size = np.maximum(np.maximum(abs(small), abs(large)), 1e-9)
            with np.errstate(invalid="ignore"):  # Both may be without a limit.
                violation = np.broadcast_to((small - large) / size, violation.shape)
            # A strict comparison also fails for equal sides.
            finite = np.isfinite(violation)
            violation = np.where(finite, np.maximum(violation, 1e-9), _WORST)
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
        DraftError: a text is not an expression, or a name is unknown.
    """
    found: list[Constraint] = []
    for text in texts:
        where.condition(spec, text, "`subject_to`")  # reports errors with their column
        for node in conjuncts(syntax_tree(text.strip()).body):
            found.append(_constraint(spec, node))
    return tuple(found)


def conjuncts(node: ast.expr) -> list[ast.expr]:
    """Parts of an `and`, or the node itself."""
    if isinstance(node, ast.BoolOp) and isinstance(node.op, ast.And):
        return [part for value in node.values for part in conjuncts(value)]
    return [node]


def _constraint(spec: Spec, node: ast.expr) -> Constraint:
    def condition(part: ast.expr) -> Condition:
        return where.condition(spec, ast.unparse(part), "`subject_to`")

    gap = None
    match node:
        case ast.Compare(left=left, ops=[ast.Lt() | ast.LtE()], comparators=[right]):
            gap = (condition(left), condition(right))
        case ast.Compare(left=left, ops=[ast.Gt() | ast.GtE()], comparators=[right]):
            gap = (condition(right), condition(left))
    return Constraint(ast.unparse(node), condition(node), gap)


def by_rollouts(condition: Constraint) -> bool:
    """Whether a condition needs roll-outs."""
    return any(name in LEARNED for name in condition.holds.metrics)
