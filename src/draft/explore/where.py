"""The condition after `--where`: which designs are kept.

It is an expression of the spec's own language over parameters, values of actuator classes
(`leg.mass`), metrics and `accepted`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError, Location, Problem, suggest
from draft.metrics import METRICS
from draft.spec import Spec
from draft.spec.expressions import Expression, parse
from draft.spec.graph import READABLE
from draft.values import Value

ACCEPTED = "accepted"


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition on designs.

    Attributes:
        expression: what was written.
        metrics: metrics that it reads.
    """

    expression: Expression
    metrics: tuple[str, ...]

    @property
    def needs_model(self) -> bool:
        """Whether it reads a metric that only a compiled model has."""
        return any(METRICS[name].needs == "model" for name in self.metrics)

    def value(self, design: Design, metrics: Mapping[str, Value]) -> Value:
        """Value of the expression; NaN in rows where it has none.

        Args:
            design: one design or N.
            metrics: those that it reads, by name.

        Raises:
            ResolveError: no number comes of it, for any design.
        """
        env = {name: _read(design, name, metrics) for name in self.expression.names}
        return self.expression.value(env, "--where")

    def holds(self, design: Design, metrics: Mapping[str, Value]) -> NDArray[np.bool_]:
        """Mask of shape (N,), or (1,): where it is a number other than zero."""
        value = np.asarray(self.value(design, metrics), dtype=np.float64)
        return np.broadcast_to((value != 0) & ~np.isnan(value), (design.count or 1,))


def condition(spec: Spec, text: str, option: str = "--where") -> Condition:
    """Read a condition.

    Args:
        spec: the robot whose names it may read.
        text: such as "mass < 40 and accepted".
        option: what it was given to; messages begin with it.

    Raises:
        DraftError: it is no expression, or reads a name that does not exist; with its column.
    """
    start = Location(option, 1, 1)
    if not text.strip():
        remedy = 'such as "accepted and leg.mass < 1"'
        raise DraftError(Problem(f"{option} says nothing", None, remedy))
    expression = parse(text, start)
    for name in sorted(expression.names):
        found = re.search(rf"(?<![\w.]){re.escape(name)}(?!\w)", text)
        column = found.start() + 1 if found else 1
        problem = _problem(spec, name, Location(option, 1, column))
        if problem is not None:
            raise DraftError(problem)
    return Condition(expression, tuple(sorted(_metrics(spec, expression))))


def _metrics(spec: Spec, expression: Expression) -> set[str]:
    """Metrics that an expression reads; a parameter of the same name comes first."""
    known = METRICS.keys() - spec.parameters.keys() - {ACCEPTED}
    return {name for name in expression.names if name in known}


def _problem(spec: Spec, name: str, where: Location) -> Problem | None:
    owner, dot, quantity = name.partition(".")
    if not dot:
        if name in spec.parameters or name in METRICS or name == ACCEPTED:
            return None
        if name in spec.actuators:
            remedy = suggest("", [f"{name}.{q}" for q in READABLE], "read one of")
            return Problem(f"'{name}' is an actuator class, not a number", where, remedy)
        known = [*spec.parameters, *METRICS, ACCEPTED]
        remedy = suggest(name, known, "parameters and metrics")
        return Problem(f"unknown name '{name}'", where, remedy)
    if owner not in spec.actuators:
        remedy = suggest(owner, spec.actuators, "actuator classes")
        return Problem(f"unknown actuator class '{owner}'", where, remedy)
    if quantity not in READABLE:
        return Problem(
            f"an actuator has no '{quantity}' to read", where, suggest(quantity, READABLE)
        )
    return None


def _read(design: Design, name: str, metrics: Mapping[str, Value]) -> Any:
    owner, dot, quantity = name.partition(".")
    value: Any
    if dot:
        value = getattr(design.actuators[owner], quantity)
    elif name in design.parameters:
        value = design.parameters[name]
    else:
        value = design.accepted if name == ACCEPTED else metrics[name]
    # Truth is 1.0 and 0.0 in expressions.
    return value.astype(np.float64) if isinstance(value, np.ndarray) else float(value)
