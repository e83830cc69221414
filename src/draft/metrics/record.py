"""Metrics as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from draft.design import Design
from draft.metrics.measure import of_design, of_model
from draft.metrics.registry import LEARNED, METRICS, of_base
from draft.metrics.statics import joint_margins
from draft.values import scalar


def descriptions() -> list[dict[str, str]]:
    """Every metric, with unit, formula, source, better direction, what it needs, and the base."""
    keys = ("name", "unit", "doc", "formula", "source", "better", "needs", "base")
    every = (*METRICS.values(), *LEARNED.values())
    return [{key: getattr(metric, key) for key in keys} for metric in every]


def measure(design: Design) -> dict[str, float]:
    """All metrics that such a design has; NaN for those that need a model if it is refused."""
    if design.accepted:
        return of_model(design.build())
    closed = of_design(design)
    return {
        name: scalar(closed.get(name, math.nan))
        for name in of_base(design.floating, None, design.rolls)
    }


def record(design: Design, found: Mapping[str, float]) -> dict[str, Any]:
    """Metrics of a design; None for those that it lacks, and for joints without load."""
    numbers = {name: _finite(value) for name, value in found.items()}
    margins = {name: _finite(scalar(x)) for name, x in joint_margins(design).items()}
    return {
        "name": design.name,
        "design": design.label,
        "metrics": numbers | {"accepted": bool(design.accepted)},
        "torque_margins": margins,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
