"""Findings about stated values far outside the modules and robots that were built.

A value in another unit is outside by the ratio of the units. What is stated is compared with the
catalogue of modules and with the survey of robots; what follows from a trend is not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

from draft.design.actuators import Actuator
from draft.design.battery import usual as usual_battery
from draft.design.design import Design, SegmentMass
from draft.design.findings import Finding, each, note
from draft.design.plan import Plan
from draft.laws.catalogue import span
from draft.laws.limits import limits
from draft.laws.quantities import CORNER, QUANTITIES
from draft.laws.structure import Population
from draft.spec.primitives.root import TrunkPart
from draft.values import (
    Value,
    both,
    brief,
    either,
    is_array,
    log,
    maximum,
    minimum,
    negate,
    some,
    where,
)

# A stated value is remarked on beyond the data by this factor: no vendor's modules are further
# outside those of all others (2.6), but for the rotors of one.
FAR = 3.0
# Beyond these it is refused where another unit explains it. Of 165 small servos outside the
# catalogue none is further above it (7.9, speed) or below it (88, torque).
ABOVE, BELOW = 10.0, 100.0
# A link of 12 m may be meant: lengths are refused from there, and volumes accordingly.
LONG = 30.0
# Turns of a joint between its limits: of 66 surveyed robots those of Solo have 3.2, those of ANYmal
# 3.0, and no other more than 2.
TURNS, MOST_TURNS = 2.0, 4.0
ROUNDING = 1e-3


class Unit(NamedTuple):
    """A unit in which a value may be stated by mistake: its name, and one of it in SI."""

    name: str
    factor: float


class Data(NamedTuple):
    """Values to compare with: their ends and middle, what they are of, and what to refuse beyond.

    Attributes:
        low, middle, high: lowest, typical and highest value; a low of 0 compares with nothing.
        of: what has them, in words.
        source: their source.
        far: factor beyond them from which a value is remarked on.
        above, below: factors beyond them from which another unit refuses it.
    """

    low: Value
    middle: Value
    high: Value
    of: str
    source: str
    far: float = FAR
    above: float = ABOVE
    below: float = BELOW


UNITS: dict[str, tuple[Unit, ...]] = {
    "kg": (Unit("grams", 1e-3),),
    "m": (Unit("millimetres", 1e-3), Unit("centimetres", 1e-2), Unit("inches", 0.0254)),
    "m3": (Unit("cubic millimetres", 1e-9), Unit("cubic centimetres", 1e-6)),
    "N m": (Unit("N mm", 1e-3), Unit("N cm", 1e-2), Unit("kgf cm", 0.0980665)),
    "rad/s": (Unit("revolutions per minute", math.pi / 30), Unit("degrees per second", 0.0174533)),
    "kg m2": (Unit("g cm2", 1e-7), Unit("kg mm2", 1e-6), Unit("kg cm2", 1e-4)),
    "W": (Unit("kilowatts", 1e3), Unit("milliwatts", 1e-3)),
    "Wh": (Unit("joules", 1 / 3600), Unit("kilowatt hours", 1e3)),
    "kg/m3": (Unit("g/cm3", 1e3),),
}
# Quantities with a check of their own.
_CHECKED = (CORNER, "aspect_ratio")


def actuator(a: Actuator) -> Iterator[Finding]:
    """Compare what a class states, or has from a robot's own table, with the shipped modules."""
    for name in a.quantities:
        one, known = QUANTITIES[name], span(name, kind=a.kind)
        if not one.stated or known is None or name in _CHECKED:
            continue
        if a.origins[name].kind not in ("stated", "catalogue"):
            continue
        of = f"{known.n} {a.kind}s of the catalogue"
        data = Data(known.low, known.middle, known.high, of, "catalogue")
        unit = "" if one.unit == "1" else one.unit
        yield from compare(a.name, one.label, getattr(a, name), unit, data)


def robot(design: Design, plan: Plan) -> Iterator[Finding]:
    """Compare stated lengths, masses, densities, battery and joint ranges with surveyed robots."""
    reuse = plan.reuse(design.count)
    segment = partial(_segment, plan.population)
    yield from each("units of segment", segment, design.segments, reuse)
    yield from _masses(design, plan)
    if design.lofted is not None:
        yield from _trunk(design.lofted, design.bodies[0].name, plan.population)
    yield from _battery(design)
    yield from _ranges(design)


def compare(place: str, what: str, value: Value, unit: str, data: Data) -> Iterator[Finding]:
    """Remark on a value far outside the data, or refuse it where another unit explains it.

    Args:
        place: actuator class or body.
        what: the quantity, in words.
        value: its value [unit].
        unit: its unit.
        data: what to compare it with.
    """
    outside = either(value > data.high * data.far, value < data.low / data.far)
    if not some(outside):
        return
    refused = either(value > data.high * data.above, value < data.low / data.below)
    away = [_away(value * other.factor, data) for other in UNITS.get(unit, ())]
    nearest = minimum(math.inf, *away)
    shown = f" {unit}" if unit else ""
    text = (
        f"{what} {{value}} of '{place}' is far outside the {brief(data.low)} to "
        f"{brief(data.high)}{shown} of {data.of}"
    )
    if not some(data.low > 0):
        text = (
            f"{what} {{value}} of '{place}' is far above the {brief(data.high)}{shown} of {data.of}"
        )
    unexplained = outside
    for other, distance in zip(UNITS.get(unit, ()), away, strict=True):
        explains = both(both(outside, unexplained), both(distance <= nearest, distance < math.inf))
        unexplained = both(unexplained, negate(explains))
        wanted = (
            f"multiply it by {other.factor:.4g}"
            if is_array(value)
            else f"write {brief(value * other.factor)}"
        )
        looks = f"{text}: it looks like {other.name}; {wanted}"
        for kind, mask in (
            ("wrong_unit", both(explains, refused)),
            ("stated_value", both(explains, negate(refused))),
        ):
            yield from note(kind, place, mask, looks, data.source, value, None, unit)
    yield from note("stated_value", place, unexplained, text, data.source, value, None, unit)


def _away(value: Value, data: Data) -> Value:
    """Distance of a value from the middle of the data, as |ln ratio|; inf outside of them."""
    inside = both(value >= data.low, value <= data.high)
    if not some(inside):
        return math.inf
    return where(inside, abs(log(value / data.middle)), math.inf)


def _segment(population: Population, segment: SegmentMass) -> Iterator[Finding]:
    """Compare the length and the stated mass of a segment with those of its class.

    `outside_data` and `heavy_link` remark on those that are not refused.
    """
    known = population.segments.get(segment.kind or "")
    if segment.trend is None and known is not None:
        usual = known(segment.length)
        of, source = f"a link of its class ({known.name}) and length", known.formula
        data = Data(0.0, usual, 2 * usual, of, source, far=ABOVE)
        yield from compare(segment.bodies[0], "mass", segment.mass, "kg", data)
    law = known or population.segments["other"]
    low, high = law.range
    if not some(segment.length > high * LONG):
        return
    of = f"{law.n} surveyed links" + (f" of its class ({law.name})" if segment.kind else "")
    data = Data(0.0, math.sqrt(low * high), high, of, population.name, LONG, LONG)
    yield from compare(segment.bodies[0], "length", segment.length, "m", data)


def _masses(design: Design, plan: Plan) -> Iterator[Finding]:
    """Compare the stated mass of each link with the heaviest surveyed robot."""
    _, heaviest = limits().energy_share.range
    of = "the heaviest surveyed robot with a known battery"
    data = Data(0.0, 1.0, heaviest, of, limits().energy_share.source)
    seen: set[int] = set()
    for i, body in enumerate(design.bodies):
        link = body.link
        if plan.link_of[i] in seen:
            continue
        seen.add(plan.link_of[i])
        for part in (link.member, link.end):
            if part is not None and part.mass is not None:
                yield from compare(body.name, "mass", part.mass, "kg", data)


def _trunk(trunk: TrunkPart, name: str, population: Population) -> Iterator[Finding]:
    """Compare the volume and a stated density of the trunk with those of surveyed robots."""
    low, high = population.trunk.range
    of = f"{population.trunk.n} surveyed {population.name}s"
    middle = math.sqrt(low * high)
    data = Data(0.0, middle, high, of, population.name, LONG**3, LONG**3)
    yield from compare(name, "volume", trunk.loft.volume, "m3", data)
    if trunk.density_stated:
        usual = population.trunk_density
        fold = (population.trunk.fold or 1.0) ** 2
        ends = usual / fold, usual, usual * fold
        yield from compare(
            name, "density", trunk.density, "kg/m3", Data(*ends, of, population.name, far=ABOVE)
        )


def _battery(design: Design) -> Iterator[Finding]:
    """Compare a stated battery with those that are usual for the surveyed robots with batteries."""
    if not design.battery_stated:
        return
    law = limits().energy_share
    ends = [usual_battery(mass) for mass in law.range]
    of = f"batteries usual for {law.n} surveyed robots"
    for name, unit in (("energy", "Wh"), ("mass", "kg")):
        if name in design.battery_stated:
            low, high = (getattr(end, name) for end in ends)
            data = Data(low, math.sqrt(low * high), high, of, law.source)
            value = design.battery_stated[name]
            yield from compare(design.bodies[0].name, f"battery {name}", value, unit, data)


def _ranges(design: Design) -> Iterator[Finding]:
    """Compare the range of each hinge with turns, and with the same number of degrees."""
    seen: set[int] = set()
    turn = 2 * math.pi * (1 + ROUNDING)
    for body in design.bodies:
        joint = body.joint
        if joint is None or joint.slide or joint.continuous or id(joint.range) in seen:
            continue
        seen.add(id(joint.range))
        low, high = joint.range
        turns = maximum(high - low, abs(low), abs(high)) / turn
        if not some(turns > TURNS):
            continue
        text = f"joint '{body.prefix}{joint.name}' ranges over {{value}}"
        source = "joints of the surveyed robots"
        wide = turns > MOST_TURNS
        yield from note(
            "wrong_unit",
            body.name,
            wide,
            f"{text}, more than any joint of the surveyed robots: it looks like degrees; write "
            "deg(...), angles are in rad",
            source,
            turns,
            None,
            "turns",
        )
        yield from note(
            "joint_range",
            body.name,
            both(turns > TURNS, negate(wide)),
            f"{text}, more than two turns; in degrees write deg(...)",
            source,
            turns,
            None,
            "turns",
        )
