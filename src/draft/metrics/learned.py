"""Metrics of behaviour: what a design does with a trained policy that observes its design.

They are measured by roll-outs in simulation (`of_policy`), which take less than a second
for each design, and are NaN for designs outside the policy's region of validity. `LEARNED` lists
them; `METRICS` has those that need no policy.
"""

from __future__ import annotations

from operator import attrgetter
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from draft.metrics.capabilities import MEASURED
from draft.metrics.registry import LEARNED, Better, Metric
from draft.values import Array

PREFIX = "learned."
_SOURCE = "roll-outs of a policy; definitions of arXiv 2609.38405 (docs/learning.md)"


class _Measured(Protocol):
    """What roll-outs of N bodies gave, with one more attribute for each metric."""

    @property
    def inside(self) -> NDArray[np.bool_]: ...


def _learned(name: str, unit: str, doc: str, formula: str, better: Better) -> None:
    def inside_only(found: _Measured) -> Array:
        return np.where(found.inside, getattr(found, name), np.nan)

    function = attrgetter(name) if unit == "bool" else inside_only
    metric = Metric(
        *(PREFIX + name, unit, doc, formula, _SOURCE, better, "policy", function),
        batch=True,
        base="floating",
    )
    LEARNED[metric.name] = metric


for _name, _one in MEASURED.items():
    _learned(_name, _one.unit, _one.text, _one.formula, _one.better)
_learned(
    "top_speed_error",
    "m/s",
    "Half of the 90 % interval of the mean speed of the roll-outs at the top speed.",
    "t(0.95, n - 1) std(v) / sqrt(n) at the command of the top speed",
    "less",
)
_learned(
    "inside",
    "bool",
    "In the policy's region of validity; no for designs that are refused or cannot walk.",
    "each feature within the range of those that the policy was trained with",
    "more",
)
