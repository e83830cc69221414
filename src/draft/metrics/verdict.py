"""Verdict of the design filter as a metric."""

from __future__ import annotations

from draft.design import Design
from draft.metrics.registry import metric
from draft.values import Mask


@metric(unit="bool", formula="no finding is an error", source="arXiv 2609.38405", better="more")
def accepted(design: Design) -> Mask:
    """Whether the design filter accepts the design."""
    return design.accepted
