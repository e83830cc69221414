"""Conditions on designs.

A condition is an expression, in the language of specs, of parameters, values of actuator classes
(`leg.mass`), metrics and `accepted`, and of quantiles of such over the errors of the laws
(`q10(jump_height)`).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError, Location, Problem, suggest
from draft.explore.quantiles import Quantile, names, split
from draft.laws.quantities import QUANTITIES
from draft.metrics import LEARNED, METRICS, find, of_design
from draft.metrics.learned import PREFIX
from draft.metrics.registry import RENAMED, misfit, of_spec, unknown
from draft.spec import Spec
from draft.spec.expressions import Expression, parse, syntax_tree
from draft.values import Value

ACCEPTED = "accepted"


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition on designs.

    Attributes:
        expression: the parsed expression.
        metrics: names of the metrics in it.
        quantiles: quantiles in it, which it reads by their names.
    """

    expression: Expression
    metrics: tuple[str, ...]
    quantiles: tuple[Quantile, ...] = ()

    @property
    def needs_model(self) -> bool:
        """Whether it contains a metric of the compiled model or of a policy."""
        return any(find(name).needs != "design" for name in self.metrics)

    def value(self, design: Design, metrics: Mapping[str, Value]) -> Value:
        """Value of the expression; NaN where it is undefined.

        Args:
            design: one design, or N.
            metrics: its metrics by name.

        Raises:
            ResolveError: it is undefined for every design.
        """
        own = names(self.quantiles)
        env = {name: _read(design, name, metrics) for name in self.expression.names - own}
        env |= {one.name: one.of(design) for one in self.quantiles}
        return self.expression.value(env, "`where`")

    def holds(self, design: Design, metrics: Mapping[str, Value]) -> NDArray[np.bool_]:
        """Mask of the designs whose value is defined and not zero, shape (N,), or (1,) for one."""
        value = np.asarray(self.value(design, metrics), dtype=np.float64)
        return np.broadcast_to((value != 0) & ~np.isnan(value), (design.count or 1,))


def condition(spec: Spec, text: str, option: str = "`where`") -> Condition:
    """Parse a condition.

    Args:
        spec: the robot.
        text: condition such as "mass < 40 and accepted".
        option: option of the command that it was given to, for messages.

    Raises:
        DraftError: it is not an expression, or a name is unknown; the message has the column.
    """
    start = Location(option, 1, 1)
    if not text.strip():
        remedy = 'give a condition such as "accepted and leg.mass < 1"'
        raise DraftError(f"{option} is empty", remedy)

    def inside(part: str, place: int) -> Callable[[Design], Value]:
        own = condition(spec, part, option)
        if own.needs_model:
            cause = f"a quantile of '{part.strip()}' would need models or roll-outs"
            remedy = "use closed-form metrics in it"
            raise DraftError(Problem(cause, Location(option, 1, place + 1), remedy))
        return lambda design: own.value(design, of_design(design, own.metrics))

    outer, quantiles = split(text, inside, start)
    expression = parse(outer, start)
    for name in sorted(expression.names - names(quantiles)):
        found = re.search(rf"(?<![\w.]){re.escape(name)}(?!\w)", text)
        column = found.start() + 1 if found else 1
        problem = _problem(spec, name, Location(option, 1, column))
        if problem is not None:
            raise DraftError(problem)
    return Condition(expression, tuple(sorted(_metrics(spec, expression))), quantiles)


def conjuncts(node: ast.expr) -> list[ast.expr]:
    """Parts of an `and`, or the node itself."""
    if isinstance(node, ast.BoolOp) and isinstance(node.op, ast.And):
        return [part for value in node.values for part in conjuncts(value)]
    return [node]


def parts(spec: Spec, text: str, option: str = "`where`") -> list[ast.expr]:
    """Parts of a condition that all have to hold.

    Raises:
        DraftError: as `condition`, or one of them is a number, which would hold wherever it is
            not zero.
    """
    condition(spec, text, option)  # Reports errors with their column.
    found = conjuncts(syntax_tree(text.strip()).body)
    for node in found:
        name = ast.unparse(node)
        metric = METRICS.get(name) or LEARNED.get(name)
        own = spec.parameters.get(name)
        unit = own.unit if own is not None else "" if metric is None else metric.unit
        if unit not in ("", "1", "bool") or name.partition(".")[2] in QUANTITIES:
            cause = f"{option}: '{name}' is a number, not a condition"
            raise DraftError(cause, f"compare it, such as '{name} < 1'")
    return found


def _metrics(spec: Spec, expression: Expression) -> set[str]:
    """Names of the metrics in an expression; a parameter hides a metric of the same name."""
    known = (METRICS.keys() | LEARNED.keys()) - spec.parameters.keys() - {ACCEPTED}
    return {name for name in expression.names if name in known}


def _problem(spec: Spec, name: str, where: Location) -> Problem | None:
    owner, dot, quantity = name.partition(".")
    if name in LEARNED or (name in METRICS and name not in spec.parameters):
        problem = misfit(name, spec)
        return None if problem is None else replace(problem, where=where)
    if not dot:
        if name in spec.parameters or name == ACCEPTED:
            return None
        if name in spec.actuators:
            remedy = suggest("", [f"{name}.{q}" for q in QUANTITIES], "read one of")
            return Problem(f"'{name}' is an actuator class, not a number", where, remedy)
        if name in RENAMED:
            return replace(unknown(name), where=where)
        known = [*spec.parameters, *of_spec(spec), ACCEPTED]
        remedy = suggest(name, known, "parameters and metrics")
        return Problem(f"unknown name '{name}'", where, remedy)
    if dot and f"{owner}." == PREFIX and owner not in spec.actuators:
        return replace(unknown(name), where=where)
    if owner not in spec.actuators:
        remedy = suggest(owner, spec.actuators, "actuator classes")
        return Problem(f"unknown actuator class '{owner}'", where, remedy)
    if quantity not in QUANTITIES:
        return Problem(
            f"an actuator has no '{quantity}' to read", where, suggest(quantity, QUANTITIES)
        )
    return None


def _read(design: Design, name: str, metrics: Mapping[str, Value]) -> Value:
    owner, dot, quantity = name.partition(".")
    value: Any
    if dot and name not in LEARNED:
        value = getattr(design.actuators[owner], quantity)
    elif name in design.parameters:
        value = design.parameters[name]
    else:
        value = design.accepted if name == ACCEPTED else metrics[name]
    # In expressions, true is 1.0 and false is 0.0.
    return value.astype(np.float64) if isinstance(value, np.ndarray) else float(value)
