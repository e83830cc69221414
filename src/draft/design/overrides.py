"""Values of a caller: checked names, numbers, expressions and arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from draft.errors import Location, Problem, ResolveError, SpecError
from draft.spec import Spec
from draft.spec.check import expression_problem, key_problem
from draft.spec.expressions import Expression, parse
from draft.spec.graph import order
from draft.spec.relative import name_of, spelled_out, substituted
from draft.spec.schema import STATED, asks_for_trend
from draft.spec.spec import ActuatorClass
from draft.values import Array


@dataclass
class Table:
    """Values of a caller, sorted by kind.

    Attributes:
        order: order of evaluation (`draft.spec.graph.order`).
        count: N with arrays, None without.
        replaced: expressions and constants by key; None removes a stated quantity.
        arrays: arrays of shape (N,) by key.
        like: catalogue part by actuator class; None removes it.
        by_trend: keys of quantities that are to follow a trend.
        places: place of each key in a design file.
        relative: keys whose expression reads the number that it replaces, of quantities that the
            file does not state.
    """

    order: list[str]
    count: int | None = None
    replaced: dict[str, Expression | None] = field(default_factory=dict)
    arrays: dict[str, Array] = field(default_factory=dict)
    like: dict[str, str | None] = field(default_factory=dict)
    by_trend: set[str] = field(default_factory=set)
    places: Mapping[str, Location] = field(default_factory=dict)
    relative: set[str] = field(default_factory=set)

    def place(self, key: str) -> Location | None:
        """Place of a key in a design file; None without one."""
        return self.places.get(key)

    def stated(self, actuator: ActuatorClass) -> dict[str, Expression]:
        """Stated quantities of a class, after the changes of the caller."""
        if not any(key.startswith(f"actuators.{actuator.name}.") for key in self.replaced):
            return dict(actuator.stated)
        stated = dict(actuator.stated)
        for quantity in STATED:
            key = f"actuators.{actuator.name}.{quantity}"
            if key not in self.replaced:
                continue
            expression = self.replaced[key]
            if expression is None:
                stated.pop(quantity, None)
            else:
                stated[quantity] = expression
        return stated

    def without(self, keys: set[str]) -> Table:
        """The table without some values."""
        replaced = {key: value for key, value in self.replaced.items() if key not in keys}
        return replace(self, replaced=replaced, relative=self.relative - keys)

    def predicted(self, actuator: ActuatorClass) -> frozenset[str]:
        """Quantities of a class that follow a trend only if asked to, after the changes."""
        prefix = f"actuators.{actuator.name}."
        kept = {q for q in actuator.by_trend if prefix + q not in self.replaced}
        return frozenset(kept | {q for q in STATED if prefix + q in self.by_trend})


_NUMBER = parse(0.0)


def read_table(
    spec: Spec,
    values: Mapping[str, object],
    places: Mapping[str, Location],
    default_order: list[str],
) -> Table:
    """Sort and check the values of a caller.

    Numbers only remove dependencies, so the order of the spec is valid unless an expression is
    given.

    Raises:
        ResolveError: a name is unknown, a value is not a number, or arrays differ in length.
    """
    table = Table(order=default_order, places=places)
    for key, value in values.items():
        if not isinstance(key, str):
            raise ResolveError(f"{key!r} is not the name of a parameter")
        problem = key_problem(spec, key, None)
        if problem is not None:
            raise ResolveError(problem)
        if key.endswith(".like"):
            table.like[key.split(".")[1]] = _like(value, key, places.get(key))
        elif isinstance(value, np.ndarray) and value.ndim == 1:
            _array(table, key, value)
        elif key.startswith("actuators.") and asks_for_trend(key.rpartition(".")[2], value):
            table.by_trend.add(key)
            table.replaced[key] = None
        else:
            expression = _expression(spec, key, spelled_out(key, value), places.get(key))
            table.replaced[key] = _related(spec, table, key, expression)
    if any(e is not None and e.names for e in table.replaced.values()):
        table.order = order(spec.parameters, spec.actuators, table.replaced)
    return table


def _related(
    spec: Spec, table: Table, key: str, expression: Expression | None
) -> Expression | None:
    """Put the expression that a value replaces in place of its own name.

    The trends give a quantity that no file states: it is known only when its class is sized.
    """
    name = name_of(key)
    if expression is None or name not in expression.names:
        return expression
    owner, _, quantity = name.partition(".")
    if not quantity:
        return substituted(expression, name, spec.parameters[name].value)
    stated = spec.actuators[owner].stated.get(quantity)
    if stated is not None:
        return substituted(expression, name, stated)
    table.relative.add(key)
    return replace(expression, names=expression.names - {name})


def _like(value: object, key: str, where: Location | None) -> str | None:
    if value is None or isinstance(value, str):
        return value
    problem = Problem(f"{key} = {value!r} is not the name of a catalogue part", where)
    raise ResolveError(problem)


def _array(table: Table, key: str, value: np.ndarray) -> None:
    if value.dtype.kind not in "iuf":
        raise ResolveError(f"{key} needs real numbers, found an array of {value.dtype}")
    array = np.array(value, dtype=np.float64)
    if len(array) == 0:
        raise ResolveError(f"the array for {key} is empty", "give one value or more")
    if table.count not in (None, len(array)):
        raise ResolveError(
            f"the array for {key} has {len(array)} entries, another has {table.count}",
            "give arrays of one length; a number applies to all designs",
        )
    array.setflags(write=False)  # a design is frozen; the caller keeps their own array
    table.count = len(array)
    table.arrays[key] = array
    table.replaced[key] = _NUMBER


def _expression(spec: Spec, key: str, value: object, where: Location | None) -> Expression | None:
    if value is None and key.startswith("actuators."):
        return None
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, (int, float, str, np.floating, np.integer)):
        shown = "nothing" if value is None else f"a {type(value).__name__}"
        raise ResolveError(
            Problem(
                f"{key} needs a number, found {shown}",
                where,
                "give a number or an expression (or, in Python, an array of shape (N,))",
            )
        )
    try:
        expression = parse(value if isinstance(value, str) else float(value), where)
    except SpecError as error:
        problem = error.problems[0]
        cause = f"{key}: {problem.cause}" if where is None else problem.cause
        raise ResolveError(Problem(cause, problem.where, problem.remedy)) from None
    if expression.constant is not None and not np.isfinite(expression.constant):
        raise ResolveError(
            Problem(f"{key} = {expression.constant} is not finite", where, "give a number")
        )
    problem = expression_problem(spec, expression)
    if problem is not None:
        cause = f"{key}: {problem.cause}" if where is None else problem.cause
        raise ResolveError(Problem(cause, where, problem.remedy))
    return expression
