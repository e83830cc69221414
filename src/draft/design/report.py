"""Report of a design as plain data, each number with its origin."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from draft.design.actuators import Actuator, Origin
from draft.design.bands import SHARES, actuator_bands
from draft.design.battery import battery
from draft.design.design import Body, Design, SegmentMass
from draft.design.electronics import electronics
from draft.design.machine import machine
from draft.design.plan import plan
from draft.design.structure_law import leg_of_trunk, structure_laws, trunk_words
from draft.errors import DraftError
from draft.laws import catalogue
from draft.laws.catalogue import Part
from draft.laws.law import Law
from draft.laws.quantities import CORNER, QUANTITIES, Quantity
from draft.laws.structure import Centre, Population, link_laws
from draft.spec.load import load
from draft.spec.schema import STATED, TREND
from draft.values import Value, plain, scalar, some

# Relative difference of masses that are equal but for rounding.
SAME = 1e-9
SEGMENTS = "draft/laws/data/segments.csv"


def report(design: Design) -> dict[str, Any]:
    """Report of a single design: masses, actuators, segments and findings, with origins.

    Returns:
        Plain data for JSON: numbers in SI units, each derived number with its inputs, the fit, n
        and its held-out errors (geometric mean folds, by row and by vendor), and with the bands
        that contain 50 and 90 % of real ones.
    """
    population = structure_laws(design)
    used = [actuator.name for actuator in used_actuators(design)]
    return {
        "name": design.name,
        "design": design.label,
        "machine": machine(design),
        "folder": design.spec.origin,
        "population": population.name,
        "mass_kg": design.mass,
        "mass_band_kg": {f"{share * 100:.0f}": list(design.mass_band(share)) for share in SHARES},
        "mass_by_leg_length": _by_leg_length(design, population),
        "actuator_mass_kg": design.actuator_mass,
        "structure_mass_kg": design.structure_mass,
        "carried_mass_kg": design.carried_mass,
        "mass_by_origin_kg": mass_by_origin(design),
        "n_joints": len(design.joints),
        "accepted": design.accepted,
        "findings": [finding.record() for finding in design.findings],
        "parameters": _parameters(design),
        "actuators": {
            name: actuator_record(actuator, plan(design.spec).own) | {"used": name in used}
            for name, actuator in design.actuators.items()
        },
        # A fixed base has no trunk with these; it draws mains power.
        "battery": _battery(design) if design.floating else None,
        "electronics": _electronics(design) if design.floating else None,
        "trunk": _trunk(design, population),
        "end_density_kg_m3": _end_density(population),
        "segments": [_segment(segment, population) for segment in design.segments],
        "carried": [_carried(name, of) for name, of in carried_parts(design).items()],
        "own_parts": own_parts(design),
        "bodies": design.body_masses(),
    }


def summary(design: Design) -> dict[str, Any]:
    """Short report of a single design, as plain data: verdict, masses, numbers and findings."""
    bounds = {name: one.bounds for name, one in design.spec.parameters.items()}
    actuators = {
        name: {"like": actuator.like} | {key: getattr(actuator, key) for key in actuator.quantities}
        for name, actuator in design.actuators.items()
    }
    return plain(
        {
            "name": design.name,
            "design": design.label,
            "machine": machine(design),
            "mass_kg": design.mass,
            "n_joints": len(design.joints),
            "accepted": design.accepted,
            "findings": [finding.record() for finding in design.findings],
            "parameters": {
                name: one | {"range": bounds[name]} for name, one in _parameters(design).items()
            },
            "actuators": actuators,
            "bodies": design.body_masses(),
        }
    )


def designs_of(robots: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Mass, joints and description of all designs of robots, by reference; or what is wrong."""
    found: dict[str, dict[str, Any]] = {}
    for robot in robots:
        try:
            spec = load(robot)
            named = {robot: (None, spec.doc)}
            named |= {f"{robot}:{one.name}": (one.name, one.doc) for one in spec.designs.values()}
            for reference, (name, doc) in named.items():
                one = spec.resolve(name)
                mass, joints = scalar(one.mass), len(one.joints)
                found[reference] = {"mass_kg": mass, "n_joints": joints, "doc": doc}
        except DraftError as error:
            found[robot] = {"problem": str(error)}  # The others are listed all the same.
    return found


def _parameters(design: Design) -> dict[str, dict[str, Any]]:
    known = design.spec.parameters
    return {
        name: {"value": value, "unit": known[name].unit, "doc": known[name].doc}
        for name, value in design.parameters.items()
    }


def used_actuators(design: Design) -> list[Actuator]:
    """Actuator classes that drive a joint of the robot."""
    used = {body.actuator.name for body in design.bodies if body.actuator is not None}
    return [actuator for name, actuator in design.actuators.items() if name in used]


def actuator_rows(actuators: Iterable[Actuator]) -> dict[str, Quantity]:
    """Rows of a table of some actuators: those of the table of quantities that any of them has."""
    found = {name for actuator in actuators for name in actuator.quantities}
    return {name: one for name, one in QUANTITIES.items() if one.row and name in found}


def actuator_record(actuator: Actuator, own: tuple[Part, ...] = ()) -> dict[str, Any]:
    """Record of an actuator class: each quantity with value, unit and origin."""
    record: dict[str, Any] = {"like": actuator.like, "trends": actuator.laws.name}
    bands = {share: actuator_bands(actuator, share) for share in SHARES}
    for quantity in actuator.quantities:
        origin = actuator.origins.get(quantity, Origin("stated"))
        entry: dict[str, Any] = {
            "value": getattr(actuator, quantity),
            "unit": QUANTITIES[quantity].unit,
            "origin": origin.kind,
        }
        if origin.detail:
            entry["from"] = origin.detail
        if origin.inputs:
            entry["inputs"] = {name: getattr(actuator, name) for name in origin.inputs}
        if origin.trend is not None:
            entry |= trend_record(actuator.laws.law(origin.trend))
        if origin.kind == "catalogue" and quantity == "rated_torque":
            entry["source"] = catalogue.find(origin.detail, own).rated_source
        if quantity in bands[SHARES[0]]:
            entry["band"] = {f"{s * 100:.0f}": list(of[quantity]) for s, of in bands.items()}
        record[quantity] = entry
    return record


def trend_record(trend: Law) -> dict[str, Any]:
    """Fit, n and errors of an actuator trend."""
    return {
        "fit": trend.formula,
        "n": trend.n,
        "r_squared": trend.r_squared,
        "held_out_error": trend.held_out.get("row"),
        "held_out_vendor_error": trend.held_out.get("vendor"),
        "source": trend.source,
    }


def design_file(design: Design) -> dict[str, Any]:
    """Content of a design file that reproduces a design, with all resulting numbers."""
    values: dict[str, Any] = {}
    for name, parameter in design.spec.parameters.items():
        if parameter.value.constant is not None or name in design.values:
            values[name] = design.parameters[name]
    for name, actuator in design.actuators.items():
        declared = design.spec.actuators[name]
        if actuator.like is not None or declared.like is not None:
            values[f"actuators.{name}.like"] = actuator.like
        for quantity in STATED:
            key = f"actuators.{name}.{quantity}"
            origin = actuator.origins.get(quantity)
            free = QUANTITIES[quantity].default is not None
            if free or (origin is not None and origin.kind == "stated"):
                values[key] = getattr(actuator, quantity)
            elif quantity == CORNER and actuator.has_corner:
                values[key] = TREND
            elif quantity in declared.stated or quantity in declared.by_trend:
                values[key] = None
    return {
        "doc": f"{design.name}, {design.label}, as resolved by Draft.",
        "values": values,
        "resolved": {
            "mass_kg": design.mass,
            "parameters": dict(design.parameters),
            "actuators": {
                name: {row: getattr(actuator, row) for row in actuator.quantities}
                for name, actuator in design.actuators.items()
            },
            "bodies_kg": design.body_masses(),
        },
    }


def mass_parts(design: Design) -> list[tuple[str, float]]:
    """Parts of the total mass of a design [kg]: actuators, trunk, segments, carried parts.

    Segments of one name and mass are one row, also where their joints differ.
    """
    rows: list[tuple[str, float]] = []
    for name, actuator in design.actuators.items():
        count = sum(body.actuator is actuator for body in design.bodies)
        if count:
            rows.append((f"{count} × actuator {name}", float(actuator.mass * count)))
    rows.append((design.bodies[0].name, scalar(design.base_mass)))
    links = {body.name: body.link.name for body in design.bodies}
    of_label: dict[str, list[tuple[SegmentMass, int]]] = {}
    for segment in design.segments:
        label = ", ".join(links[name] for name in segment.bodies)
        alike = of_label.setdefault(label, [])
        for k, (first, count) in enumerate(alike):
            if math.isclose(scalar(first.mass), scalar(segment.mass), rel_tol=SAME):
                alike[k] = first, count + segment.copies
                break
        else:
            alike.append((segment, segment.copies))
    for label, alike in of_label.items():
        for segment, count in alike:
            # Left and right that differ are told apart by the names of their bodies.
            shown = label if len(alike) == 1 else ", ".join(segment.bodies)
            rows.append((f"{count} × {shown}", scalar(segment.mass) * count))
    for name, bodies in carried_parts(design).items():
        mass = sum(scalar(body.end_mass) for body in bodies)
        rows.append((f"{len(bodies)} × {name}", mass))
    return rows


def carried_parts(design: Design) -> dict[str, list[Body]]:
    """Bodies with carried parts, by the names of their links in the tree file."""
    found: dict[str, list[Body]] = {}
    for body in design.bodies:
        if body.carries:
            found.setdefault(body.link.name, []).append(body)
    return found


def mass_by_origin(design: Design) -> dict[str, Value]:
    """Mass of a design [kg] that is stated, that laws predict, and that a catalogue has."""
    found: dict[str, Value] = {"stated": design.carried_mass, "trend": 0.0, "catalogue": 0.0}

    def add(origin: str, mass: Value) -> None:
        kind = origin if origin in found else "trend"
        found[kind] = found[kind] + mass

    for body in design.bodies:
        if (actuator := body.actuator) is not None:
            add(actuator.origins["mass"].kind, actuator.mass)
    for segment in design.segments:
        of_parts = segment.mass if segment.trend is None else segment.of_parts
        add("stated", of_parts * segment.copies)
        add("trend", (segment.mass - of_parts) * segment.copies)
    trunk = design.lofted
    add("stated" if trunk is None or trunk.density_stated else "trend", design.base_mass)
    return found


def own_parts(design: Design) -> list[dict[str, Any]]:
    """Records of the parts in place of drawn solids, each with the bodies that have it."""
    records: dict[tuple[str, str], dict[str, Any]] = {}
    for body in design.bodies:
        for place, part in body.shapes:
            mass, of = body.member_mass, body.link.name
            member = body.link.member
            stated = part.mass is not None or (member is not None and member.mass is not None)
            origin = "stated" if stated else "trend"
            if place == "motor" and (actuator := body.actuator) is not None:
                mass, of, origin = actuator.mass, actuator.name, actuator.origins["mass"].kind
            elif body.parent is None and design.lofted is not None:
                mass = design.lofted.mass
                origin = "stated" if design.lofted.density_stated else "trend"
            mesh = part.mesh
            record = records.setdefault(
                (place, of),
                {
                    "file": mesh.file,
                    "in_place_of": f"{'actuator' if place == 'motor' else 'link'} {of}",
                    "bodies": [],
                    "mass_kg": mass,
                    "origin": origin,
                    "volume_m3": mesh.volume,
                    "density_kg_m3": mass / mesh.volume,
                    "com_m": list(part.com),
                    "triangles": len(mesh.corners),
                    "collides": part.collides,
                },
            )
            record["bodies"].append(body.name)
    return [*records.values()]


def _by_leg_length(design: Design, population: Population) -> dict[str, Any] | None:
    """Second estimate of the total mass, with the structure predicted from leg length alone.

    On held-out robots its error is smaller than that of the sum over segments, but it ignores the
    trunk of the design: it is reported beside the mass and does not replace it.
    """
    leg = design.leg_length
    if leg is None:
        return None
    low, high = population.whole.range
    return {
        "mass_kg": design.actuator_mass + population.whole(leg) + design.carried_mass,
        "leg_length_m": leg,
        "inside_the_data": bool(low <= leg <= high),
        "fit": population.whole.formula,
        "n": population.whole.n,
        "held_out_error": population.held_out.draft,
        "held_out_error_of_the_sum_over_segments": population.held_out_total,
    }


def _battery(design: Design) -> dict[str, Any]:
    """Record of the battery, whose mass is part of the trunk's."""
    found = battery(design)
    return {
        "energy_wh": found.energy,
        "mass_kg": found.mass,
        "origin": "trend" if not design.battery_stated else "stated",
        "band_of_energy_wh": {"90": list(found.band)},
        **_of_law(found.law),
    }


def _electronics(design: Design) -> dict[str, Any]:
    """Record of the power of computers, sensors and idle drives."""
    found = electronics(design)
    return {
        "power_w": found.power,
        "origin": "stated" if found.law is None else "trend",
        "band_of_power_w": {"90": list(found.band)},
        **_of_law(found.law),
    }


def _of_law(law: Law | None) -> dict[str, Any]:
    """Record of the law that gave a number; nothing for a stated one."""
    if law is None:
        return {}
    held_out = {f"held_out_{what}_error": error for what, error in law.held_out.items()}
    return {"fit": law.formula, "n": law.n, **held_out, "source": law.source}


def _trunk(design: Design, population: Population) -> dict[str, Any] | None:
    trunk = design.lofted
    if trunk is None:
        return None
    origin: dict[str, Any] = {"origin": "stated"}
    if not trunk.density_stated:
        origin = {
            "origin": "trend",
            "fit": trunk_words(design, trunk),
            "n": population.trunk_law.n,
            "source": population.source,
        }
    leg = leg_of_trunk(design, trunk)
    if leg is not None:
        origin["inputs"] = {"volume": trunk.loft.volume, "leg_length": leg}
        origin["leg_length_origin"] = "design" if trunk.leg_length is None else "stated"
    com = trunk.loft.com.tolist()
    inertia = trunk.loft.inertia * (trunk.mass / trunk.loft.volume)
    if trunk.shape is not None:
        com, inertia = list(trunk.shape.com), trunk.shape.inertia(trunk.mass)
    if trunk.shape is not None and trunk.shape.mass is not None:
        origin["from"] = trunk.shape.mesh.file
    return {
        "mass_kg": trunk.mass,
        "volume_m3": trunk.loft.volume,
        "com_m": com,
        "inertia_kg_m2": inertia.tolist(),
        "density_kg_m3": {"value": trunk.density} | origin,
    }


def _end_density(population: Population) -> dict[str, Any]:
    """Record of the mass over volume of an end without a stated mass."""
    return {
        "value": population.end_density,
        "fit": "median mass / volume of the spheres that quadrupeds stand on",
        "n": population.end.n,
        "source": population.end.source,
    }


def _segment(segment: SegmentMass, population: Population) -> dict[str, Any]:
    record: dict[str, Any] = {
        "segment": segment.label,
        "bodies": list(segment.bodies),
        "copies": segment.copies,
        "length_m": segment.length,
        "mass_kg": segment.mass,
    }
    if some(segment.of_parts > 0):
        record["of_own_parts_kg"] = segment.of_parts
    if segment.trend is None:
        return record | {"origin": "stated"}
    trend = population.segments[segment.trend]
    centre = population.centres.get(segment.trend)
    if segment.member_centre is not None and centre is not None:
        record["centre"] = _centre(centre, segment.member_centre)
    record |= {
        "origin": "trend",
        "fit": trend.formula,
        "n": trend.n,
        "in_sample_error": trend.fold,
    }
    if segment.trend in link_laws():
        return record | {"source": trend.source}
    return record | {
        "whole_robot_held_out_error": population.held_out_total,
        "source": population.source,
    }


def _carried(name: str, bodies: list[Body]) -> dict[str, Any]:
    """Record of a part carried on every copy of one link; moments are about its centre."""
    geom = bodies[0].end_geom
    if geom is None or geom.mass is None:
        return {}
    return {
        "part": name,
        "bodies": [body.name for body in bodies],
        "copies": len(bodies),
        "form": geom.form,
        "size_m": list(geom.size),
        "mass_kg": geom.mass,
        "density_kg_m3": geom.mass / geom.volume,
        "inertia_kg_m2": list(geom.inertia),
        "origin": "stated",
    }


def _centre(centre: Centre, member: Value) -> dict[str, Any]:
    """Record of the centres of mass of a segment and of its member, as shares of the length."""
    return {
        "value": centre.value,
        "unit": "share of the length from its first joint",
        "of_the_member": member,
        "fit": "median of where the structure of robots' segments balances",
        "n": centre.n,
        "quartiles": [centre.p25, centre.p75],
        "held_out_error": centre.held_out,
        "held_out_maker_error": centre.held_out_maker,
        "held_out_error_of_the_middle": centre.held_out_middle,
        "source": SEGMENTS,
    }
