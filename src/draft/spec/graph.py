"""Order of evaluation of a spec's numbers: each once, after all that it reads."""

from __future__ import annotations

import graphlib
from collections.abc import Iterable, Mapping

from draft.errors import Problem, SpecError
from draft.spec.expressions import Expression
from draft.spec.spec import ActuatorClass, Parameter


def order(
    parameters: Mapping[str, Parameter],
    actuators: Mapping[str, ActuatorClass],
    replaced: Mapping[str, Expression | None],
) -> list[str]:
    """Sort parameters and actuator classes so that each comes after its inputs.

    Args:
        parameters: the declared parameters.
        actuators: the actuator classes; a class is evaluated as a whole.
        replaced: expressions that replace the declared ones, under `name` for a parameter and
            `actuators.class.quantity` for an actuator.

    Returns:
        Parameter names and class names, the latter as `class.`, with the dot.

    Raises:
        SpecError: they depend on each other in a cycle; the message shows it.
    """
    needs: dict[str, list[str]] = {}
    for name, parameter in parameters.items():
        expression = replaced.get(name) or parameter.value
        needs[name] = _nodes(expression.names)
    for name, actuator in actuators.items():
        stated = dict(actuator.stated)
        prefix = f"actuators.{name}."
        for key, expression in replaced.items():
            if key.startswith(prefix):
                if expression is None:
                    stated.pop(key.removeprefix(prefix), None)
                else:
                    stated[key.removeprefix(prefix)] = expression
        part = actuator.shape.optional("density") if actuator.shape else None
        read = [*stated.values(), *([part] if part else [])]
        needs[f"{name}."] = [n for e in read for n in _nodes(e.names)]
    try:
        return list(graphlib.TopologicalSorter(needs).static_order())
    except graphlib.CycleError as error:
        cycle = [name.rstrip(".") for name in error.args[1]][::-1]
        first = cycle[0]
        shown = cycle if len(cycle) <= 16 else [*cycle[:8], "...", *cycle[-7:]]
        where = parameters[first].where if first in parameters else actuators[first].where
        if any(key.removeprefix("actuators.").split(".")[0] in cycle for key in replaced):
            where = None  # the caller's values may close the cycle, not the files
        raise SpecError(
            Problem(
                f"these depend on each other in a cycle: {' -> '.join(shown)}",
                where,
                "state one of them as a number",
            )
        ) from None


def _nodes(names: Iterable[str]) -> list[str]:
    """Nodes of some names, sorted so that a cycle is always shown the same way."""
    return [name.split(".", 1)[0] + "." if "." in name else name for name in sorted(names)]
