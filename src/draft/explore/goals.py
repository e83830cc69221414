"""What a search is for: numbers to make small or large, and how far constraints are missed."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from draft.design import Design
from draft.errors import DraftError, Problem
from draft.explore import where
from draft.explore.where import Condition
from draft.spec import Spec
from draft.values import Array, Value

_WORST = 1e9  # violation of a design that has no number where one is compared


@dataclass(frozen=True, slots=True)
class Goal:
    """A number to make small, or large: a metric, or an expression as of `--where`."""

    text: str
    less: bool
    value: Condition

    def of(self, design: Design, metrics: Mapping[str, Value]) -> Array:
        """Its value of N designs, shape (N,); NaN where there is none."""
        found = np.asarray(self.value.value(design, metrics), dtype=np.float64)
        return np.broadcast_to(found, (design.count or 1,))


@dataclass(frozen=True, slots=True)
class Constraint:
    """A condition that designs must meet.

    Attributes:
        text: what was written.
        holds: the condition.
        gap: the smaller side of a comparison, then the larger; None where it is no comparison.
    """

    text: str
    holds: Condition
    gap: tuple[Condition, Condition] | None

    def violation(self, design: Design, metrics: Mapping[str, Value]) -> Array:
        """How far each design misses it, shape (N,): zero where it holds.

        Of a comparison it is the gap over the size of its right side, so that a search knows
        which way to go; of all else it is one.
        """
        met = self.holds.holds(design, metrics)
        far: Array = np.ones(design.count or 1)
        if self.gap is not None:
            small, large = (
                np.asarray(side.value(design, metrics), dtype=np.float64) for side in self.gap
            )
            size = np.maximum(np.maximum(abs(small), abs(large)), 1e-9)
            far = np.broadcast_to((small - large) / size, far.shape)
            # A strict comparison fails on equal sides too.
            far = np.where(np.isfinite(far), np.maximum(far, 1e-9), _WORST)
        return np.where(met, 0.0, far)


def goals(spec: Spec, minimise: Sequence[str], maximise: Sequence[str]) -> tuple[Goal, ...]:
    """Read what to make small and what to make large.

    Raises:
        DraftError: nothing, the same twice, or unknown names.
    """
    if not (minimise or maximise):
        remedy = "give --minimise or --maximise, such as --minimise mass"
        raise DraftError(Problem("there is nothing to optimise", None, remedy))
    found: dict[str, Goal] = {}
    for option, texts in (("--minimise", minimise), ("--maximise", maximise)):
        for text in texts:
            if text in found:
                raise DraftError(Problem(f"'{text}' is a goal twice", None, "give it once"))
            value = where.condition(spec, text, option)
            found[text] = Goal(text, option == "--minimise", value)
    return tuple(found.values())


def constraints(spec: Spec, texts: Sequence[str]) -> tuple[Constraint, ...]:
    """Read constraints; each part of an `and` is one of its own.

    Raises:
        DraftError: no expressions, or unknown names.
    """
    found: list[Constraint] = []
    for text in texts:
        where.condition(spec, text, "--subject-to")  # says what is wrong, at its column
        for node in _parts(ast.parse(text.strip(), mode="eval").body):
            found.append(_constraint(spec, node))
    return tuple(found)


def _parts(node: ast.expr) -> list[ast.expr]:
    if isinstance(node, ast.BoolOp) and isinstance(node.op, ast.And):
        return [part for value in node.values for part in _parts(value)]
    return [node]


def _constraint(spec: Spec, node: ast.expr) -> Constraint:
    def read(part: ast.expr) -> Condition:
        return where.condition(spec, ast.unparse(part), "--subject-to")

    gap = None
    match node:
        case ast.Compare(left=left, ops=[ast.Lt() | ast.LtE()], comparators=[right]):
            gap = (read(left), read(right))
        case ast.Compare(left=left, ops=[ast.Gt() | ast.GtE()], comparators=[right]):
            gap = (read(right), read(left))
    return Constraint(ast.unparse(node), read(node), gap)
