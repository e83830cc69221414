"""Registry of metrics: `@metric` adds a function to `METRICS` with its unit and documentation."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from draft.design.machine import kinds
from draft.errors import DraftError, Problem, suggest
from draft.extensions import Registry

if TYPE_CHECKING:
    from draft.metrics.limiting import Limit
    from draft.spec import Spec

Better = Literal["less", "more", ""]
Needs = Literal["design", "model", "policy"]
Base = Literal[
    "any", "floating", "fixed", "wheels", "arm", "hand", "arm or hand", "floating or arm"
]
F = TypeVar("F", bound=Callable[[Any], Any])


@dataclass(frozen=True, slots=True)
class Metric:
    """A named number of a design.

    Attributes:
        name: name in commands and expressions.
        unit: SI unit; "1" for none, "bool" for a mask.
        doc: description, one sentence.
        formula: formula as text.
        source: source of the formula.
        better: direction that is better; "" for neither.
        needs: "design"; "model" if it is computed from a compiled model; or "policy" if it is
            measured with a trained policy.
        function: function from a Design to a Value (NaN if the robot has no such quantity), or from
            a Model to a float.
        batch: whether a function of a Model also takes a ModelBatch and returns an array of shape
            (models,); otherwise models are built one by one.
        base: kinds of machine that have it, of `draft.design.machine.kinds`: "floating" for what is
            about walking, "wheels" for what stands on driven ones, "arm" or "hand" on a fixed base.
        sampled: whether it takes many poses of each design, thousands of times as long as a closed
            form: screens, comparisons and sensitivities have it only by name.
        limits: function from one Design to what limits the metric; None if nothing is named.
    """

    name: str
    unit: str
    doc: str
    formula: str
    source: str
    better: Better
    needs: Needs
    function: Callable[[Any], Any]
    batch: bool = False
    limits: Callable[[Any], Iterable[Limit]] | None = None
    base: Base = "any"
    sampled: bool = False

    def fits(self, spec: Spec) -> bool:
        """Whether such robots have it."""
        return self.base == "any" or not kinds(spec).isdisjoint(self.base.split(" or "))


METRICS: Registry[Metric] = Registry("metric")
# Those that need a policy, see `draft.metrics.learned`.
LEARNED: dict[str, Metric] = {}
# Those that are shown unless some are named.
USUAL = ("mass", "payload_rated", "jump_height", "top_speed", "standing_power")
# Names that metrics had before, and what to use instead.
RENAMED = {
    "payload": "use payload_peak for the same number, at peak torque, or payload_rated for what "
    "the actuators can sustain",
}


def metric(
    *,
    unit: str,
    formula: str,
    source: str,
    better: Better = "",
    needs: Needs = "design",
    batch: bool = False,
    limits: Callable[[Any], Iterable[Limit]] | None = None,
    base: Base = "any",
    sampled: bool = False,
) -> Callable[[F], F]:
    """Register a function as a metric and return it unchanged.

    The metric has the name of the function. The first line of the docstring is its description,
    with the unit in square brackets at the end unless it is "bool":

        @metric(unit="kg", formula="m = rho V", source="a book", better="less")
        def ballast(design: Design) -> Value:
            \"\"\"Mass of the ballast [kg].\"\"\"

    Args:
        unit: SI unit; "1" for none, "bool" for a mask.
        formula: formula as text.
        source: source of the formula.
        better: direction that is better; "" for neither.
        needs: "design" for a function of a Design, "model" for one of a Model.
        batch: whether a function of a Model also takes a ModelBatch.
        limits: function from one Design to what limits it (`draft.metrics.limits`).
        base: kinds of machine that have it: "floating" for what is about legs or walking.
        sampled: whether it takes many poses of each design.

    Raises:
        DraftError: a metric of this name exists already.
    """

    def register(function: F) -> F:
        name = function.__name__
        line = (inspect.getdoc(function) or "").partition("\n")[0]
        sentence = line.removesuffix(f" [{unit}].").removesuffix(".") + "."
        numbers = (name, unit, sentence, formula, source, better, needs, function, batch, limits)
        made = Metric(*numbers, base, sampled)
        METRICS.add(name, made, function.__module__)
        return function

    return register


def of_spec(spec: Spec, names: Iterable[str] | None = None) -> dict[str, Metric]:
    """Metrics of such a machine by name.

    Args:
        spec: the robot.
        names: those to choose from; None for all.
        rolls: whether it is on driven wheels.
    """
    chosen = METRICS if names is None else names
    return {name: METRICS[name] for name in chosen if METRICS[name].fits(spec)}


def closed(spec: Spec) -> tuple[str, ...]:
    """Names of the metrics of such a machine that are closed forms, which arrays suffice for."""
    found = of_spec(spec).values()
    return tuple(one.name for one in found if one.needs == "design" and not one.sampled)


def misfit(name: str, spec: Spec) -> Problem | None:
    """Problem of a metric that no such machine has; None for others.

    Raises:
        DraftError: there is no such metric.
    """
    metric = find(name)
    if metric.fits(spec):
        return None
    if metric.base == "wheels":
        cause = "robots on driven wheels; this one has none"
    elif spec.floating or metric.base == "floating":
        other = "floating" if metric.base == "floating" else "fixed"
        cause = f"robots on a {other} base; this one "
        cause += "floats" if spec.floating else "is fixed to the world"
    else:
        kind = metric.base.removeprefix("floating or ")
        cause = f"a fixed {kind}; this one has {_LACKS.get(kind, 'no driven joint')}"
    return Problem(f"'{name}' is of {cause}", None, f"use {', '.join(of_spec(spec))}")


_LACKS = {
    "arm": "no arm: its driven joints branch at the base",
    "hand": "no fingers: its driven joints do not branch",
}


def reads_verdict(names: Iterable[str]) -> bool:
    """Whether metrics may read the findings of the filter.

    Masks may, those of models, which are built where it accepts, and those of extensions.
    """
    return any(
        one.unit == "bool" or one.needs != "design" or bool(METRICS.origin(one.name))
        for one in map(find, names)
    )


def unknown(name: str) -> Problem:
    """Problem of a name that no metric has: what was renamed, or the nearest name."""
    if name in RENAMED:
        return Problem(f"the metric '{name}' was renamed", None, RENAMED[name])
    known = [*METRICS, *(LEARNED if name.startswith("learned") else ())]
    return Problem(f"there is no metric '{name}'", None, suggest(name, known, "metrics"))


def find(name: str) -> Metric:
    """Return the metric of a name.

        >>> draft.metrics.find("jump_height").unit
        'm'

    Args:
        name: a key of `METRICS` or `LEARNED`, such as "jump_height".

    Raises:
        DraftError: there is none; the message names the nearest.
    """
    metric = METRICS.get(name) or LEARNED.get(name)
    if metric is None:
        raise DraftError(unknown(name))
    return metric
