"""Metrics of designs: named numbers with unit, formula and source, computed without learning.

A metric is a function of a Design, for one design or N, or of a Model if it needs the joint-space
inertia. `METRICS` lists them in the order in which they are shown. `LEARNED` lists those that are
measured with a trained policy.

To add a metric, decorate a function in a new or existing module of this package, which are found by
inspection, or in an extension. Commands, conditions, goals, pages and tests read `METRICS`.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from draft.lazy import on_first_use
from draft.metrics.measure import of_batch, of_design, of_model
from draft.metrics.registry import LEARNED, METRICS, Metric, find, metric

if TYPE_CHECKING:
    from draft.learn.measuring.policy_metrics import of_policy

__all__ = [
    "LEARNED",
    "METRICS",
    "Carry",
    "Limit",
    "Metric",
    "Overload",
    "Payload",
    "Travel",
    "carry",
    "find",
    "limits",
    "metric",
    "of_batch",
    "of_design",
    "of_model",
    "of_policy",
    "overload",
    "payload_for",
    "travel",
]

# A policy is measured by a package that is imported after this one.
_MODULES = {"of_policy": "draft.learn.measuring.policy_metrics"}
__getattr__ = on_first_use(__name__, _MODULES)

# Modules in the order in which their metrics are shown; others follow by name.
_ORDER = (
    *(
        "sizes",
        "statics",
        "leaping",
        "speed",
        "heat",
        "energy",
        "rolling",
        "tips",
        "workspace",
        "grasp",
    ),
    *("verdict", "impact"),
)


def _order(module: str) -> tuple[int, str]:
    return (_ORDER.index(module) if module in _ORDER else len(_ORDER)), module


for _module in sorted((found.name for found in iter_modules(__path__)), key=_order):
    import_module(f"{__name__}.{_module}")

# Modules register their metrics in the order above, so no function may be imported before.
from draft.metrics.energy import Travel, travel  # noqa: E402
from draft.metrics.heat import Carry, Payload, carry, payload_for  # noqa: E402
from draft.metrics.limiting import Limit, limits  # noqa: E402
from draft.metrics.statics import Overload, overload  # noqa: E402
