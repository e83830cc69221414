"""Evaluation of metrics by name."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from draft.design import Design
from draft.errors import DraftError, Problem
from draft.extensions import ExtensionWarning
from draft.metrics.registry import METRICS, Metric, find, misfit, of_base
from draft.values import Array, Value

if TYPE_CHECKING:
    from draft.model import Model
    from draft.model.batch import ModelBatch


def of_design(design: Design, names: Iterable[str] | None = None) -> dict[str, Value]:
    """Closed-form metrics of one design or of N, by name.

        >>> design = draft.load("quadruped").resolve("cheetah")
        >>> found = draft.metrics.of_design(design, ["mass", "jump_height"])
        >>> round(found["mass"], 1)
        33.6

    Args:
        design: one design, or N.
        names: names of metrics; None for all that need no model and that such robots have.

    Returns:
        A float per metric, or an array of shape (N,) for N designs, in the unit that
        `draft.metrics.find(name).unit` states; NaN where the robot has no such quantity.

    Raises:
        DraftError: an unknown metric, one of robots with another base, one that needs a model, or
            one of an extension that fails; of all metrics, that one is NaN, with a warning.
    """
    chosen = _chosen(names, design)
    if names is None:
        chosen = [name for name in chosen if find(name).needs == "design"]
    found: dict[str, Value] = {}
    with np.errstate(all="ignore"):
        for name in chosen:
            metric = find(name)
            if metric.needs != "design":
                raise DraftError(needs_more(metric))
            value = _value(metric, design, design.count, names is not None)
            found[name] = _of_all(value, design.count)
    return found


def _chosen(names: Iterable[str] | None, design: Design) -> list[str]:
    """Metrics that are named, or all that robots with such a base have.

    Raises:
        DraftError: an unknown metric, or one of robots with another base.
    """
    if names is None:
        return [*of_base(design.floating, None, design.rolls)]
    chosen = list(names)
    for name in chosen:
        if (problem := misfit(name, design.floating)) is not None:
            raise DraftError(problem)
    return chosen


def needs_more(metric: Metric) -> Problem:
    """Problem of a metric that arrays of numbers do not suffice for."""
    what = "a compiled model" if metric.needs == "model" else "a policy"
    remedy = "use `draft.sweep`, which builds every design"
    return Problem(f"'{metric.name}' needs {what}", None, remedy)


def _value(metric: Metric, subject: object, count: int | None, named: bool) -> Value:
    """Value of a metric; of one of an extension that fails NaN, unless it was named."""
    if not METRICS.origin(metric.name):
        return metric.function(subject)
    try:
        with METRICS.calls(metric.name, "correct it, or name the other metrics"):
            given = metric.function(subject)
            if given is None:
                raise TypeError("it gives None, not a number")
            value = np.asarray(given, np.float64)
            if value.shape not in ((), (count,)):
                shapes = "one number" if count is None else f"one number or shape ({count},)"
                raise ValueError(f"it gives an array of shape {value.shape}, not {shapes}")
    except DraftError as error:
        if named:
            raise
        warnings.warn(error.problems[0].cause, ExtensionWarning, stacklevel=3)
        return np.nan
    return value if value.shape else float(value)


def _of_all(value: Value, count: int | None) -> Value:
    """Repeat a value that all of N designs share, to shape (N,)."""
    if count is None or np.shape(value) == (count,):
        return value
    return np.full(count, value)


def of_model(model: Model, names: Iterable[str] | None = None) -> dict[str, float]:
    """Metrics of one model by name: those that need it, and those of its design.

        >>> model = draft.load("quadruped").resolve("cheetah").build()
        >>> sorted(draft.metrics.of_model(model, ["mass", "impact_mitigation"]))
        ['impact_mitigation', 'mass']

    Args:
        model: the model.
        names: names of metrics; None for all.

    Returns:
        A float per metric, in the unit that `draft.metrics.find(name).unit` states.

    Raises:
        DraftError: an unknown metric, one of robots with another base, one that needs a policy, or
            one of an extension that fails; of all metrics, that one is NaN, with a warning.
    """
    chosen = _chosen(names, model.design)
    found: dict[str, float] = {}
    with np.errstate(all="ignore"):
        for name in chosen:
            metric = find(name)
            if metric.needs == "policy":
                raise DraftError(f"'{name}' needs a policy", "use draft.metrics.of_policy")
            subject = model if metric.needs == "model" else model.design
            found[name] = float(_value(metric, subject, None, names is not None))
    return found


def of_batch(batch: ModelBatch, names: Iterable[str]) -> dict[str, Array]:
    """Metrics of a batch of models by name, of those that take one.

    Args:
        batch: the models.
        names: names of metrics that need models and have `batch` set.

    Returns:
        An array of shape (len(batch),) per metric.

    Raises:
        numpy.linalg.LinAlgError: a model has a singular M(q).
        DraftError: a metric of an extension fails.
    """
    with np.errstate(all="ignore"):
        return {name: np.asarray(_value(find(name), batch, len(batch), True)) for name in names}
