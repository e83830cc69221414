"""Design filter: feasibility of a design, and its similarity to machines that were built.

Definitions: arXiv 2609.38405, design filter. Errors refuse a design, warnings do not. Limits come
from the catalogue and from the data of the trends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from draft.design import filter_units
from draft.design.checks import extended, kinds
from draft.design.design import Design, SegmentMass
from draft.design.filter_actuators import ROUNDING, actuator, unused, used
from draft.design.filter_shape import below_floor, feet, off_part, off_tip, sections
from draft.design.findings import Finding, each, note
from draft.design.legs import count, coupled_bodies
from draft.design.loads import home_loads
from draft.design.packing import actuator_overlaps, limb_overlaps
from draft.design.plan import Plan
from draft.design.solids import Pose
from draft.design.structure_law import leg_of_trunk, structure_laws
from draft.errors import Problem, ResolveError, suggest
from draft.laws.structure import Population, link_laws
from draft.spec.primitives.root import TrunkPart
from draft.values import (
    Mask,
    Value,
    both,
    either,
    is_array,
    maximum,
    minimum,
    negate,
    some,
)

# Legs of the surveyed quadrupeds. The mass per leg is taken to be theirs for other numbers of legs;
# a robot on fewer than three is another kind of machine, and is not compared.
QUADRUPED, LEAST_LEGS = 4, 3


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
    home = Pose(design, home=True)
    drives, reuse = used(design), plan.reuse(design.count)
    trunks = [] if design.lofted is None else [design.lofted]
    found = [
        *_physical(design, invalid),
        *each("actuator", partial(actuator, own=plan.own), drives, reuse),
        *each("units of actuator", filter_units.actuator, drives, reuse),
        *filter_units.robot(design, plan),
        *actuator_overlaps(design, plan),
        *each("segment", partial(_segment, plan.population), design.segments, reuse),
        *(found for trunk in trunks for found in _trunk(design, trunk)),
        *_whole(design, plan, home),
        *_thermal(design),
        *limb_overlaps(design, plan),
        *below_floor(design, plan, home),
        *each("sections", partial(sections, design), [one.loft for one in trunks], reuse),
        *off_tip(design, plan),
        *each("part", off_part, [design.bodies[i] for i in _firsts(plan)], reuse),
        *unused(design),
        *extended(design),
    ]
    return tuple(with_allowance(_whole_mask(finding, design), design) for finding in found)


def _firsts(plan: Plan) -> list[int]:
    """First body of each link that has a part of one's own."""
    shaped = (k for k, link in enumerate(plan.links) if link.shape is not None)
    return [plan.link_of.index(k) for k in shaped]


def _whole_mask(finding: Finding, design: Design) -> Finding:
    """Finding whose mask has an entry per design, also if it is the same for all."""
    if design.count is None or is_array(finding.mask):
        return finding
    return replace(finding, mask=np.full(design.count, bool(finding.mask)))


def _check_allow(design: Design) -> None:
    for item, where in design.spec.allow.items():
        kind = item.split(":", 1)[0]
        known = kinds().keys() - {"not_physical"}
        if kind not in known:
            raise ResolveError(
                Problem(f"'allow' names no finding '{kind}'", where, suggest(kind, known))
            )


def with_allowance(finding: Finding, design: Design) -> Finding:
    """Return a finding as a warning if the design allows it."""
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


def _segment(population: Population, segment: SegmentMass) -> Iterator[Finding]:
    """Compare the structural mass of a segment with the trends of the population."""
    trend = population.segments.get(segment.kind or "")
    if trend is None:
        return
    source = f"{population.origin(segment.kind or '')}, {trend.formula}, n = {trend.n}"
    if segment.trend is not None:
        low, high = trend.range
        yield from note(
            "outside_data",
            segment.bodies[0],
            trend.outside(segment.length),
            f"length {{value}} of '{segment.bodies[0]}' is outside {low:.3g} to {high:.3g} m, "
            f"the surveyed lengths of its class ({trend.name.replace('_', ' ')}); its mass per "
            "metre is that of the edge",
            source,
            segment.length,
            None,
            "m",
        )
    limit = 2 * trend(segment.length)
    yield from note(
        "heavy_link",
        segment.bodies[0],
        segment.mass > limit * ROUNDING,
        f"the structural mass {{value}} of '{segment.bodies[0]}' is above {{limit}}, twice "
        "that of its class",
        source,
        segment.mass,
        limit,
        "kg",
    )


def _trunk(design: Design, trunk: TrunkPart) -> Iterator[Finding]:
    """Compare leg length and trunk with those that the calibrated law was fitted to."""
    population, leg = structure_laws(design), leg_of_trunk(design, trunk)
    if leg is None:
        return
    law = population.calibrated
    values = {"volume": trunk.loft.volume, "leg_length": leg}
    words = {"volume": "volume {value} of the trunk", "leg_length": "leg length {value}"}
    for (name, value), unit in zip(values.items(), law.input_units, strict=True):
        low, high = law.ranges[name]
        yield from note(
            "outside_data",
            design.bodies[0].name,
            either(value < low, value > high),
            f"{words[name]} is outside the surveyed {population.name}s, {low:.3g} to {high:.3g} "
            f"{unit}; the density of the trunk is that at the edge",
            f"{population.name} trunk, {law.formula}, n = {law.n}",
            value,
            None,
            unit,
        )


def _whole(design: Design, plan: Plan, home: Pose) -> Iterator[Finding]:
    """Compare legs, actuator share and total mass with the population."""
    population = plan.population
    if not design.floating:
        yield from _legged_trends(design, population)
        return
    if not design.feet:
        yield from note(
            "no_legs",
            design.name,
            True,
            "no limb reaches the ground; the structure trends do not apply",
            f"survey of {population.name}s",
        )
    for body in coupled_bodies(design):
        yield from note(
            "coupled_leg",
            body.name,
            True,
            f"the joint of '{body.name}' follows another: loads, jump and speed of such a leg are "
            "not judged",
            "closed forms of legs",
        )
    legs = count(design) if population.name == "quadruped" else 0
    if 0 < legs < LEAST_LEGS:
        yield from feet(design, plan, home)
        return
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
    yield from feet(design, plan, home)
    size = _size(design)
    if size is None:
        return
    a = population.allometry
    usual = a.coefficient * maximum(size, 1e-9) ** a.exponent
    of = f"{population.name}s of this size"
    if legs not in (0, QUADRUPED):
        usual, of = usual * (legs / QUADRUPED), f"{of}, for {legs} legs instead of {QUADRUPED}"
    fold = math.exp(1.96 * a.sigma)
    mass = design.mass - design.payload_mass
    boxes = some(design.carried_mass - design.payload_mass > 0)
    yield from note(
        "total_mass",
        design.name,
        either(mass > usual * fold, mass < usual / fold),
        f"total mass {{value}} differs by more than a factor of {fold:.2f} from {{limit}}, the "
        f"mass of {of}" + "; boxes count, a load given as 'payload' does not" * boxes,
        f"{a.formula}, 95 % band, n = {a.n}",
        mass,
        usual,
        "kg",
    )


def _legged_trends(design: Design, population: Population) -> Iterator[Finding]:
    """Links of a fixed base whose masses follow from robots with legs."""
    names = [
        segment.bodies[0]
        for segment in design.segments
        if segment.trend is not None and segment.trend not in link_laws()
    ]
    if names:
        yield from note(
            "outside_data",
            design.name,
            True,
            f"the trends of surveyed {population.name}s, robots with legs, give the masses of the "
            f"links of this fixed base, such as '{names[0]}'; give its member a "
            f"'segment' of arms or hands, {' or '.join(link_laws())}, or state its 'mass'",
            f"survey of {population.name}s",
        )


def _thermal(design: Design) -> Iterator[Finding]:
    """Compare the torques of standing, or of a fixed base's joints, with rated and peak ones."""
    kind, doing, what = "cannot_stand", "standing in", "robot"
    if not design.floating:
        kind, doing, what = "cannot_hold", "holding", "links"
    loads = home_loads(design)
    shares = [abs(load.torque) / load.actuator.peak_torque for load in loads]
    worst = maximum(0.0, *shares)
    refused: Mask = False
    for load, share in zip(loads, shares, strict=True):
        torque, rated = abs(load.torque), load.actuator.rated_torque
        joint, peak = load.joint.names[0], load.actuator.peak_torque
        origin = load.actuator.origins["rated_torque"]
        limits = both(share > ROUNDING, both(share >= worst, negate(refused)))
        refused = either(refused, limits)
        yield from note(
            kind,
            design.name,
            limits,
            f"{doing} the home pose takes {{value}} at '{joint}', above the peak torque "
            f"{{limit}} of '{load.actuator.name}': the motors cannot hold the {what} at all",
            "statics of the home pose",
            torque,
            peak,
            "N m",
        )
        yield from note(
            "thermal",
            joint,
            torque > rated * ROUNDING,
            f"{doing} the home pose takes {{value}} at '{joint}', above the rated torque "
            f"{{limit}} of '{load.actuator.name}': it gets too hot in time",
            f"statics of the home pose; rated torque {origin.detail or origin.kind}",
            torque,
            rated,
            "N m",
        )


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
