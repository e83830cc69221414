"""Findings about actuator classes, compared with the catalogue and the trends."""

from __future__ import annotations

import math
from collections.abc import Iterator

from draft.design.actuators import Actuator
from draft.design.design import Design
from draft.design.findings import Finding, note
from draft.laws.catalogue import MODULE, SERVO, Extremes, Part, aspect_range, extremes
from draft.values import Value, either, log, maximum, minimum, power, some

# Real modules reach the limits: rounding must not refuse a design that copies one.
ROUNDING = 1 + 1e-9
# Power of the reduction by which a family's limits fade where another family takes over.
FADE = 8.0


def used(design: Design) -> list[Actuator]:
    """Actuator classes that the robot uses; others are not checked."""
    names = {body.actuator.name for body in design.bodies if body.actuator is not None}
    return [actuator for name, actuator in design.actuators.items() if name in names]


def actuator(a: Actuator, own: tuple[Part, ...] = ()) -> Iterator[Finding]:
    """Compare an actuator class with the catalogue and the modules of the spec's own."""
    stronger = "; `kind: module` sizes a stronger one"
    for kind, name, value, unit in (
        ("torque", "peak torque", a.peak_torque, "N m"),
        ("torque_density", "torque density", a.peak_torque / a.mass, "N m/kg"),
        ("power_density", "power density", _peak_power(a) / a.mass, "W/kg"),
    ):
        limit, source = highest(kind, a.gear_ratio, own, a.kind)
        yield from note(
            kind,
            a.name,
            value > limit * ROUNDING,
            f"{name} {{value}} of '{a.name}' is beyond {{limit}}, the highest of {a.kind}s "
            "with such a reduction" + stronger * (kind == "torque" and a.kind == SERVO),
            source,
            value,
            limit,
            unit,
        )
    low, high = aspect_range(own, a.kind)
    yield from note(
        "aspect_ratio",
        a.name,
        either(a.aspect_ratio < low / ROUNDING, a.aspect_ratio > high * ROUNDING),
        f"length over diameter {{value}} of '{a.name}' is outside the catalogue's "
        f"{low:.2f} to {high:.2f}",
        "catalogue",
        a.aspect_ratio,
    )
    yield from _reduction(a)
    yield from _outside(a)


def _peak_power(a: Actuator) -> Value:
    """Peak power [W]: the stated one, or that of torque and speed if it is higher.

    The limits are those of the catalogue's modules, on straight lines, so a corner does not count.
    """
    straight = a.peak_torque * a.no_load_speed / 4
    if a.has_corner and a.origins["peak_power"].kind != "stated":
        return straight
    return maximum(a.peak_power, straight)


def _reduction(a: Actuator) -> Iterator[Finding]:
    if a.origins["gear_ratio"].kind == "trend" or a.origins["no_load_speed"].kind == "trend":
        return
    trend = a.laws.trends["gear_ratio"]
    usual = trend(a.no_load_speed)
    band = trend.band(0.9)
    yield from note(
        "gear_ratio",
        a.name,
        abs(log(a.gear_ratio / usual)) > math.log(band),
        f"reduction {{value}} of '{a.name}' differs by more than a factor of {band:.2f} from "
        "{limit}, that of modules of its speed",
        f"{trend.formula}, 90 % band, n = {trend.n}",
        a.gear_ratio,
        usual,
    )


def _outside(a: Actuator) -> Iterator[Finding]:
    """Inputs of an actuator's trends outside the range of their data."""
    used = {name for o in a.origins.values() if o.kind == "trend" for name in o.trends}
    inputs = {name for quantity in used for name in a.laws.law(quantity).ranges}
    if not used:
        return
    ranges = {**a.laws.trends["volume"].ranges, **a.laws.trends["gear_ratio"].ranges}
    for name, unit in (("peak_torque", "N m"), ("gear_ratio", ""), ("no_load_speed", "rad/s")):
        if name not in inputs:
            continue
        low, high = ranges[name]
        value = getattr(a, name)
        below = value < low / ROUNDING
        servos = "; servos are lighter than these trends say: `kind: servo` sizes one"
        yield from note(
            "outside_data",
            a.name,
            either(below, value > high * ROUNDING),
            f"{name} {{value}} of '{a.name}' is outside the range of the fitted {a.kind}s, "
            f"{low:.3g} to {high:.3g}"
            + servos
            * (name == "peak_torque" and a.kind == MODULE and some(below)),
            "catalogue",
            value,
            None,
            unit,
        )


def highest(
    kind: str, gear_ratio: Value, own: tuple[Part, ...] = (), of: str = MODULE
) -> tuple[Value, str]:
    """Highest value of any module with such a reduction, and the modules that reach it.

    A family's extreme holds over its range of reductions, and fades continuously beyond it: within
    about a tenth where another family takes over. Beyond all families it changes as for the same
    motor with another reduction: torque and torque per mass in proportion below the lowest, and
    both densities in inverse proportion above the highest, as gears add mass. A higher reduction
    takes no torque away, and a lower one no power.
    """
    families = extremes(own, of)[1].values()
    lowest = min(family.gear_range[0] for family in families)
    highest = max(family.gear_range[1] for family in families)
    limits: dict[str, Value] = {}
    for family in families:
        low, high = family.gear_range
        part = _extreme(family, kind)
        below = _fade(gear_ratio / low, inner=low > lowest)
        above = _fade(high / gear_ratio, inner=high < highest)
        limit: Value = _amount(part, kind)
        if kind != "power_density" or low > lowest:
            limit = limit * below
        if kind != "torque":
            limit = limit * above
        limits[f"{part.name} ({family.name})"] = limit
    best = maximum(*limits.values())
    return best, ", ".join(name for name, limit in limits.items() if some(limit >= best))


def _fade(share: Value, inner: bool) -> Value:
    """Share of a family's extreme where the reduction is a share of the edge of its range."""
    inside = minimum(share, 1.0)
    return power(inside, FADE) if inner else inside


def _extreme(family: Extremes, kind: str) -> Part:
    return getattr(family, kind)


def _amount(part: Part, kind: str) -> float:
    return part.peak_torque if kind == "torque" else getattr(part, kind)


def unused(design: Design) -> Iterator[Finding]:
    """Actuator classes that drive no joint."""
    used = {body.link.joint.actuator for body in design.bodies if body.link.joint is not None}
    for name in design.actuators:
        yield from note(
            "unused_class",
            name,
            name not in used,
            f"no joint uses the actuator class '{name}'",
            "tree.yaml",
        )
