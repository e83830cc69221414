"""Range that a finding allows, to be drawn."""

from __future__ import annotations

import math

from draft.design import Design, Finding
from draft.design.plan import plan
from draft.laws.catalogue import aspect_range


def allowed(finding: Finding, design: Design) -> tuple[float, float] | None:
    """Range of values without this finding, in its unit; None where it has no such range."""
    if not isinstance(finding.value, (int, float)) or not math.isfinite(finding.value):
        return None
    population = plan(design.spec).population
    usual = float(finding.limit) if isinstance(finding.limit, (int, float)) else math.nan
    if finding.id == "aspect_ratio":
        return aspect_range(plan(design.spec).own, design.actuators[finding.where].kind)
    if finding.id == "actuator_share":
        return population.share[0], population.share[2]
    if finding.id == "total_mass":
        fold = math.exp(1.96 * population.allometry.sigma)
        return usual / fold, usual * fold
    if finding.id == "gear_ratio":
        fold = design.actuators[finding.where].laws.trends["gear_ratio"].band(0.9)
        return usual / fold, usual * fold
    if finding.id == "outside_data":
        return _data_range(finding, design)
    return (0.0, usual) if usual > 0 else None


def _data_range(finding: Finding, design: Design) -> tuple[float, float] | None:
    """Range of the data that the trend behind a finding was fitted to."""
    population = plan(design.spec).population
    for segment in design.segments:
        if segment.bodies[0] == finding.where and segment.trend is not None:
            low, high = population.segments[segment.trend].range
            return low, high
    actuator = design.actuators.get(finding.where)
    if actuator is None:
        return None
    trends = actuator.laws.trends
    ranges = {**trends["volume"].ranges, **trends["gear_ratio"].ranges}
    return next(
        (of for name, of in ranges.items() if getattr(actuator, name) == finding.value), None
    )
