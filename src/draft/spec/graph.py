"""In which order a spec's numbers are worked out: each once, after all that it reads."""

from __future__ import annotations

import graphlib
from collections.abc import Iterable, Mapping

from draft.errors import Problem, SpecError
from draft.spec.expressions import Expression
from draft.spec.spec import ActuatorClass, Parameter

# What an expression can read of an actuator class, beside the stated quantities.
READABLE = (
    "peak_torque",
    "no_load_speed",
    "gear_ratio",
    "peak_power",
    "aspect_ratio",
    "mass",
    "volume",
    "radius",
    "length",
    "rotor_inertia",
    "armature",
    "friction_loss",
    "damping",
)


def order(
    parameters: Mapping[str, Parameter],
    actuators: Mapping[str, ActuatorClass],
    replaced: Mapping[str, Expression | None],
) -> list[str]:
    """Sort parameters and actuator classes so that each comes after what it needs.

    Args:
        parameters: the declared parameters.
        actuators: the actuator classes; a class is worked out as a whole.
        replaced: expressions that stand in for the declared ones, under `name` for a parameter
            and `actuators.class.quantity` for an actuator's.

    Returns:
        Parameter names and class names, the latter as `class.`, with the dot.

    Raises:
        SpecError: some of them need each other in a circle; the message shows the path.
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
        needs[f"{name}."] = [n for e in stated.values() for n in _nodes(e.names)]
    try:
        return list(graphlib.TopologicalSorter(needs).static_order())
    except graphlib.CycleError as error:
        circle = [name.rstrip(".") for name in error.args[1]][::-1]
        first = circle[0]
        shown = circle if len(circle) <= 16 else [*circle[:8], "...", *circle[-7:]]
        where = parameters[first].where if first in parameters else actuators[first].where
        if any(key.removeprefix("actuators.").split(".")[0] in circle for key in replaced):
            where = None  # a caller's values may close it, not the files
        raise SpecError(
            Problem(
                f"these need each other in a circle: {' -> '.join(shown)}",
                where,
                "state one of them as a number",
            )
        ) from None


def _nodes(names: Iterable[str]) -> list[str]:
    """What stands behind each name, sorted so that a circle is always shown the same way."""
    return [name.split(".", 1)[0] + "." if "." in name else name for name in sorted(names)]
