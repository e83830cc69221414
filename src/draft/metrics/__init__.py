"""What a design can do, without learning anything: named numbers with unit, formula and source.

A metric is a function of a Design, for one design or for N at once, or of a Model where the
joint-space inertia is needed. `METRICS` has them all, in the order in which they are shown.

A new metric is one decorated function in a module of this package, old or new: modules are found
by inspection. Commands, conditions, goals, pages and tests read `METRICS`.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from draft.metrics.measure import of_batch, of_design, of_model
from draft.metrics.registry import METRICS, Metric, find, metric

__all__ = ["METRICS", "Metric", "find", "metric", "of_batch", "of_design", "of_model"]

# Modules in the order in which their metrics are shown; others follow by name.
_SHOWN = ("sizes", "statics", "leaping", "speed", "verdict", "impact")


def _place(module: str) -> tuple[int, str]:
    return (_SHOWN.index(module) if module in _SHOWN else len(_SHOWN)), module


for _module in sorted((found.name for found in iter_modules(__path__)), key=_place):
    import_module(f"{__name__}.{_module}")
