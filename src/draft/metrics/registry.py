"""Registry of metrics: `@metric` adds a function to `METRICS` with its unit and documentation."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from draft.errors import DraftError, Problem, suggest
from draft.extensions import Registry

if TYPE_CHECKING:
    from draft.metrics.limiting import Limit

Better = Literal["less", "more", ""]
Needs = Literal["design", "model", "policy"]
Base = Literal["any", "floating", "fixed", "wheels"]
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
        base: base of the robots that have it, such as "floating" of what is about walking;
            "wheels" of those on driven wheels.
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

    def fits(self, floating: bool, rolls: bool = False) -> bool:
        """Whether robots have it whose base floats, or is fixed to the world, or is on wheels."""
        own = ("any", "floating" if floating else "fixed", *(("wheels",) if rolls else ()))
        return self.base in own


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
        base: base of the robots that have it: "floating" for what is about legs or walking,
            "wheels" for what is about driven wheels.

    Raises:
        DraftError: a metric of this name exists already.
    """

    def register(function: F) -> F:
        name = function.__name__
        line = (inspect.getdoc(function) or "").partition("\n")[0]
        sentence = line.removesuffix(f" [{unit}].").removesuffix(".") + "."
        numbers = (name, unit, sentence, formula, source, better, needs, function, batch, limits)
        made = Metric(*numbers, base)
        METRICS.add(name, made, function.__module__)
        return function

    return register


def of_base(
    floating: bool, names: Iterable[str] | None = None, rolls: bool = False
) -> dict[str, Metric]:
    """Metrics of robots whose base floats, or is fixed to the world, by name.

    Args:
        floating: whether the base floats.
        names: those to choose from; None for all.
        rolls: whether it is on driven wheels.
    """
    chosen = METRICS if names is None else names
    return {name: METRICS[name] for name in chosen if METRICS[name].fits(floating, rolls)}


def misfit(name: str, floating: bool) -> Problem | None:
    """Problem of a metric that no robot of such a base has; None for others.

    Raises:
        DraftError: there is no such metric.
    """
    if find(name).fits(floating, rolls=floating):  # Without wheels it is NaN.
        return None
    own, other = ("floats", "fixed") if floating else ("is fixed to the world", "floating")
    known = ", ".join(of_base(floating))
    return Problem(f"'{name}' is of robots on a {other} base; this one {own}", None, f"use {known}")


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
