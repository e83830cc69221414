"""Design filter: feasibility of a design, and its similarity to machines that were built.

Definitions: arXiv 2609.38405, design filter. Errors refuse a design, warnings do not. Limits come
from the catalogue and from the data of the trends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from draft import geometry as g
from draft.design.actuators import Actuator
from draft.design.design import Body, Design
from draft.design.findings import KINDS, Finding, note
from draft.design.loads import home_loads
from draft.design.packing import actuator_overlaps, limb_overlaps
from draft.design.plan import Plan
from draft.design.solids import Solid, foot_depths, solid
from draft.errors import Problem, ResolveError, suggest
from draft.geometry import Rotation, Vector
from draft.laws.catalogue import Extremes, Part, aspect_range, extremes
from draft.values import (
    Mask,
    Value,
    either,
    is_array,
    log,
    maximum,
    minimum,
    power,
    some,
)

# Real modules reach the limits: rounding must not refuse a design that copies one.
_ROUNDING = 1 + 1e-9
# Reported difference of the heights of feet: share of the deepest, and at least [m].
EVEN, LEAST_UNEVEN = 0.02, 0.005
# Power of the reduction by which a family's limits fade where another family takes over.
FADE = 8.0
# Reported distance of a section of the trunk from the next, in widths of the section.
FAR_OFF = 1.0


def inspect(design: Design, plan: Plan, invalid: Mask) -> tuple[Finding, ...]:
    """Run every check.

    Args:
        design: the design, its findings still empty.
        plan: its spec's plan.
        invalid: mask of designs with an invalid number.

    Raises:
        ResolveError: `allow` names a finding that does not exist.
    """
    _check_allow(design)
    found = [
        *_physical(design, invalid),
        *(finding for a in _used(design) for finding in _actuator(a)),
        *actuator_overlaps(design, plan),
        *_segments(design, plan),
        *_whole(design, plan),
        *_thermal(design),
        *limb_overlaps(design, plan),
        *_below_floor(design, plan),
        *_sections(design),
        *_unused(design),
    ]
    return tuple(_with_allowance(_whole_mask(finding, design), design) for finding in found)


def _whole_mask(finding: Finding, design: Design) -> Finding:
    """Finding whose mask has an entry per design, also if it is the same for all."""
    if design.count is None or is_array(finding.mask):
        return finding
    return replace(finding, mask=np.full(design.count, bool(finding.mask)))


def _used(design: Design) -> list[Actuator]:
    """Actuator classes that the robot uses; others are not checked."""
    names = {body.actuator.name for body in design.bodies if body.actuator is not None}
    return [actuator for name, actuator in design.actuators.items() if name in names]


def _check_allow(design: Design) -> None:
    for item, where in design.spec.allow.items():
        kind = item.split(":", 1)[0]
        if kind not in KINDS or kind == "not_physical":
            known = [k for k in KINDS if k != "not_physical"]
            raise ResolveError(
                Problem(f"'allow' names no finding '{kind}'", where, suggest(kind, known))
            )


def _with_allowance(finding: Finding, design: Design) -> Finding:
    if finding.severity != "error":
        return finding
    for item in (finding.id, f"{finding.id}:{finding.where}"):
        if item in design.spec.allow:
            return replace(finding, severity="warning", allowed=item)
    return finding


def _physical(design: Design, invalid: Mask) -> Iterator[Finding]:
    mass = design.mass
    if is_array(mass):
        invalid = either(invalid, ~(np.asarray(mass) > 0))
    yield from note(
        "not_physical",
        design.name,
        invalid,
        "a number of this design is not finite, not positive where it must be, or out of bounds",
        "expressions of the spec",
    )


def _actuator(a: Actuator) -> Iterator[Finding]:
    """Compare an actuator class with the catalogue."""
    for kind, name, value, unit in (
        ("torque", "peak torque", a.peak_torque, "N m"),
        ("torque_density", "torque density", a.peak_torque / a.mass, "N m/kg"),
        ("power_density", "power density", _peak_power(a) / a.mass, "W/kg"),
    ):
        limit, source = _limit(kind, a.gear_ratio)
        yield from note(
            kind,
            a.name,
            value > limit * _ROUNDING,
            f"{name} {{value}} of '{a.name}' is beyond {{limit}}, the highest of modules with "
            "such a reduction",
            source,
            value,
            limit,
            unit,
        )
    low, high = aspect_range()
    yield from note(
        "aspect_ratio",
        a.name,
        either(a.aspect_ratio < low / _ROUNDING, a.aspect_ratio > high * _ROUNDING),
        f"length over diameter {{value}} of '{a.name}' is outside the catalogue's "
        f"{low:.2f} to {high:.2f}",
        "catalogue",
        a.aspect_ratio,
    )
    yield from _reduction(a)
    yield from _outside(a)


def _peak_power(a: Actuator) -> Value:
    """Peak power [W]: the stated one, or that of torque and speed if it is higher."""
    return maximum(a.peak_power, a.peak_torque * a.no_load_speed / 4)


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
    inputs = {name for quantity in used for name in a.laws.trends[quantity].ranges}
    if not used:
        return
    ranges = {**a.laws.trends["volume"].ranges, **a.laws.trends["gear_ratio"].ranges}
    for name, unit in (("peak_torque", "N m"), ("gear_ratio", ""), ("no_load_speed", "rad/s")):
        if name not in inputs:
            continue
        low, high = ranges[name]
        value = getattr(a, name)
        yield from note(
            "outside_data",
            a.name,
            either(value < low / _ROUNDING, value > high * _ROUNDING),
            f"{name} {{value}} of '{a.name}' is outside the range of the fitted modules, "
            f"{low:.3g} to {high:.3g}",
            "catalogue",
            value,
            None,
            unit,
        )


def _limit(kind: str, gear_ratio: Value) -> tuple[Value, str]:
    """Highest value of any module with such a reduction, and the modules that reach it.

    A family's extreme holds over its range of reductions, and fades continuously beyond it: within
    about a tenth where another family takes over. Beyond all families it changes as for the same
    motor with another reduction: torque and torque per mass in proportion below the lowest, and
    both densities in inverse proportion above the highest, as gears add mass. A higher reduction
    takes no torque away, and a lower one no power.
    """
    families = extremes()[1].values()
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


def _segments(design: Design, plan: Plan) -> Iterator[Finding]:
    """Compare structural masses with the trends of the population."""
    for segment in design.segments:
        trend = plan.population.segments.get(segment.kind or "")
        if trend is None:
            continue
        if segment.trend is not None:
            low, high = trend.range
            yield from note(
                "outside_data",
                segment.bodies[0],
                trend.outside(segment.length),
                f"length {{value}} of '{segment.bodies[0]}' is outside the surveyed "
                f"{trend.name.replace('_', ' ')}s, {low:.3g} to {high:.3g} m; its mass per metre "
                "is that of the edge",
                f"{plan.population.name} {trend.name}, {trend.formula}, n = {trend.n}",
                segment.length,
                None,
                "m",
            )
        limit = 2 * trend(segment.length)
        yield from note(
            "heavy_link",
            segment.bodies[0],
            segment.mass > limit * _ROUNDING,
            f"the structural mass {{value}} of '{segment.bodies[0]}' is above {{limit}}, twice "
            "that of its class",
            f"{plan.population.name} {trend.name}, {trend.formula}, n = {trend.n}",
            segment.mass,
            limit,
            "kg",
        )


def _whole(design: Design, plan: Plan) -> Iterator[Finding]:
    """Compare legs, actuator share and total mass with the population."""
    population = plan.population
    ends = (body.link.end for body in design.bodies)
    if not any(end is not None and end.is_foot for end in ends):
        yield from note(
            "no_legs",
            design.name,
            True,
            "no limb reaches the ground; the structure trends do not apply",
            f"survey of {population.name}s",
        )
    if any(body.actuator is not None for body in design.bodies):
        low, median, high = population.share
        share = design.actuator_mass / (design.mass - design.payload_mass)
        yield from note(
            "actuator_share",
            design.name,
            either(share < low, share > high),
            f"the actuators' share of the mass, {{value}}, is outside {low:.2f} to {high:.2f}, "
            f"the middle 80 % of {population.name}s (median {median:.2f})",
            f"survey of {population.name}s",
            share,
        )
    yield from _feet(design, plan)
    size = _size(design)
    if size is None:
        return
    a = population.allometry
    usual = a.coefficient * maximum(size, 1e-9) ** a.exponent
    fold = math.exp(1.96 * a.sigma)
    mass = design.mass - design.payload_mass
    yield from note(
        "total_mass",
        design.name,
        either(mass > usual * fold, mass < usual / fold),
        f"total mass {{value}} differs by more than a factor of {fold:.2f} from {{limit}}, the "
        f"mass of {population.name}s of this size",
        f"{a.formula}, 95 % band, n = {a.n}",
        mass,
        usual,
        "kg",
    )


def _thermal(design: Design) -> Iterator[Finding]:
    """Compare the torques of standing with the rated ones."""
    for load in home_loads(design):
        torque, rated = abs(load.torque), load.actuator.rated_torque
        joint = load.joint.names[0]
        origin = load.actuator.origins["rated_torque"]
        yield from note(
            "thermal",
            joint,
            torque > rated * _ROUNDING,
            f"standing in the home pose takes {{value}} at '{joint}', above the rated torque "
            f"{{limit}} of '{load.actuator.name}': it gets too hot in time",
            f"statics of the home pose; rated torque {origin.detail or origin.kind}",
            torque,
            rated,
            "N m",
        )


def _feet(design: Design, plan: Plan) -> Iterator[Finding]:
    """Compare the heights of the feet of legs with knees."""
    feet = _uneven(design, plan)
    if len(feet) < 2:
        return
    depths = foot_depths(design, home=True, bodies=feet)
    deepest = maximum(*depths)
    gap = deepest - minimum(*depths)
    yield from note(
        "uneven_feet",
        design.name,
        gap > maximum(EVEN * abs(deepest), LEAST_UNEVEN),
        "the feet differ in height by {value} in the home pose: the legs differ in length, "
        "attachment or home angles",
        "geometry of the home pose",
        1000.0 * gap,
        None,
        "mm",
    )


def _below_floor(design: Design, plan: Plan) -> Iterator[Finding]:
    """Compare the lowest points of all parts with the feet that the robot stands on."""
    down: Vector = (0.0, 0.0, -1.0)
    placed = _placed(design, plan)
    feet = [
        part.extent(down) - part.center[2]
        for body, parts in placed
        if body.link.end is not None and body.link.end.is_foot
        for part in parts[-1:]
    ]
    if not feet:
        return
    floor = maximum(*feet)
    limit = floor + maximum(EVEN * abs(floor), LEAST_UNEVEN)
    trunk = design.trunk.loft.vertices[:, 2].min(axis=0)
    for body, parts in placed:
        # The sphere around a solid tells at once that most are above the floor.
        low = [part for part in parts if some(part.reach - part.center[2] > limit)]
        depths = [part.extent(down) - part.center[2] for part in low]
        if body.parent is None:
            depths.append(-trunk if is_array(trunk) else -float(trunk))
        if not depths:
            continue
        depth = maximum(*depths)
        yield from note(
            "below_floor",
            body.name,
            depth > limit,
            f"a part of '{body.name}' is {{value}} below the feet in the home pose",
            "geometry of the home pose",
            1000.0 * (depth - floor),
            None,
            "mm",
        )


def _placed(design: Design, plan: Plan) -> list[tuple[Body, list[Solid]]]:
    """Bodies with their solids in the home pose, the end last; of copies on both sides one."""
    frames: dict[int, tuple[Vector, Rotation]] = {}
    paths: dict[int, tuple[object, ...]] = {}
    seen: set[object] = set()
    found: list[tuple[Body, list[Solid]]] = []
    for i, body in enumerate(design.bodies):
        if body.parent is None:
            frames[i], paths[i] = (g.ZERO, None), ()
        elif body.parent in frames:
            signs = design.spec.bodies[i].signs
            own = (plan.link_of[i], plan.placement_of[i], signs[0], signs[2])
            paths[i] = (*paths[body.parent], own)
            if paths[i] in seen:
                continue
            seen.add(paths[i])
            frames[i] = body.placed(frames[body.parent])
        else:
            continue
        found.append((body, [solid(geom, frames[i]) for geom in body.solids()]))
    return found


def _sections(design: Design) -> Iterator[Finding]:
    """Compare the place of each section of the trunk with its own width."""
    if all(s.offset is None and s.polygon is None for s in design.spec.root.sections):
        return  # All are centred on the axis of the loft.
    loft = design.trunk.loft
    points = loft.vertices.reshape(loft.sections, loft.corners, *loft.vertices.shape[1:])
    across = [k for k, name in enumerate("xyz") if name != design.spec.root.axis]
    low, high = points.min(axis=1)[:, across], points.max(axis=1)[:, across]
    centres, widths = (low + high) / 2, high - low
    for i in range(loft.sections):
        others = [centres[k] for k in range(loft.sections) if k != i]
        off = np.min([np.max(abs(centres[i] - c) / widths[i], axis=0) for c in others], axis=0)
        value: Value = off if np.ndim(off) else float(off)
        yield from note(
            "trunk_section",
            design.bodies[0].name,
            value > FAR_OFF,
            f"section {i + 1} of the trunk is {{value}} of its own widths beside the nearest one: "
            "look at its offset, in m",
            "root.yaml",
            value,
        )


def _unused(design: Design) -> Iterator[Finding]:
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


def _uneven(design: Design, plan: Plan) -> list[int]:
    """Feet of the legs with knees; none if the legs are copies, whose feet have the same height."""
    kinds = {segment.label: segment.kind for segment in design.segments}
    feet: list[int] = []
    copies: set[object] = set()
    for i, body in enumerate(design.bodies):
        if body.link.end is None or not body.link.end.is_foot:
            continue
        path = [i]
        while parent := design.bodies[path[-1]].parent:
            path.append(parent)
        if not any(kinds.get(design.bodies[k].segment or "") == "shank" for k in path):
            continue
        feet.append(i)
        own = [(k, design.spec.bodies[k].signs) for k in path]
        copies.add(tuple((plan.link_of[k], plan.placement_of[k], s[0], s[2]) for k, s in own))
    return feet if len(copies) > 1 else []


def _size(design: Design) -> Value | None:
    """Size in the sense of the population's allometry [m]; None if it is undefined."""
    if design.spec.population == "quadruped":
        return design.leg_length
    heights = [
        frame[0][2]
        for body, frame in zip(design.bodies, design.frames(), strict=True)
        if body.joint is not None
    ]
    return maximum(*heights) - minimum(*heights) if len(heights) > 1 else None
