"""The registry of metrics: `@metric` puts a function into `METRICS` with what is said of it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from draft.errors import DraftError, Problem, suggest

Better = Literal["less", "more", ""]
Needs = Literal["design", "model"]
F = TypeVar("F", bound=Callable[[Any], Any])


@dataclass(frozen=True, slots=True)
class Metric:
    """A named number.

    Attributes:
        name: as commands and expressions spell it.
        unit: SI unit; "1" for none, "bool" for a mask.
        doc: what it is, in a sentence.
        formula: how it is computed.
        source: where the formula comes from.
        better: which way is better; "" where neither is.
        needs: "design", or "model" where MuJoCo computes it.
        function: from a Design to a Value (NaN where the robot has no such thing), or from a Model
            to a float.
        batch: whether a function of a Model also takes a ModelBatch, and gives an array of shape
            (models,); else models are built one by one.
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


METRICS: dict[str, Metric] = {}


def metric(
    *,
    unit: str,
    formula: str,
    source: str,
    better: Better = "",
    needs: Needs = "design",
    batch: bool = False,
) -> Callable[[F], F]:
    """Register a function as a metric; the function itself is unchanged.

    Its name is the metric's name. The first line of its docstring is the metric's sentence, with
    the unit in square brackets at the end unless it is "bool":

        @metric(unit="kg", formula="m = rho V", source="a book", better="less")
        def ballast(design: Design) -> Value:
            \"\"\"Mass of the ballast [kg].\"\"\"

    Args:
        unit: SI unit; "1" for none, "bool" for a mask.
        formula: how it is computed.
        source: where the formula comes from.
        better: which way is better; "" where neither is.
        needs: "design" for a function of a Design, "model" for one of a Model.
        batch: whether a function of a Model also takes a ModelBatch.

    Raises:
        ValueError: there is a metric of this name already.
    """

    def register(function: F) -> F:
        name = function.__name__
        if name in METRICS:
            first = METRICS[name].function.__module__
            raise ValueError(f"there is a metric '{name}' already, in {first}: rename one")
        line = (inspect.getdoc(function) or "").partition("\n")[0]
        sentence = line.removesuffix(f" [{unit}].").removesuffix(".") + "."
        METRICS[name] = Metric(
            name, unit, sentence, formula, source, better, needs, function, batch
        )
        return function

    return register


def find(name: str) -> Metric:
    """Metric of a name.

        >>> draft.metrics.find("jump_height").unit
        'm'

    Args:
        name: a key of `METRICS`, such as "jump_height".

    Raises:
        DraftError: there is none; the nearest is named.
    """
    if name not in METRICS:
        remedy = suggest(name, METRICS, "metrics")
        raise DraftError(Problem(f"there is no metric '{name}'", None, remedy))
    return METRICS[name]
