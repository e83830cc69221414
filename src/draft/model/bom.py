"""Bill of materials of a design in CSV: its actuators by class, then its links.

A class has the nearest module of the catalogue, by peak torque and no-load speed: something to buy,
or to begin a search with. The masses add up to that of the robot; battery and electronics are part
of the trunk's.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from typing import Any

from draft import geometry as g
from draft.design.actuators import Actuator
from draft.design.design import Design
from draft.design.plan import plan
from draft.design.report import report, used_actuators
from draft.laws.catalogue import catalogue, nearest
from draft.values import Value, scalar

COLUMNS = (
    *("kind", "name", "count", "mass_each_kg", "mass_total_kg", "density_kg_m3"),
    *("peak_torque_nm", "no_load_speed_rad_s", "mass_source"),
    *("nearest_module", "nearest_maker", "nearest_peak_torque_nm"),
    *("nearest_no_load_speed_rad_s", "nearest_mass_kg", "nearest_source"),
)


def bom_csv(design: Design) -> str:
    """Text of the table of a single design; a cell that does not apply is empty."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    table.writeheader()
    record = report(design)
    table.writerows(_actuator(design, one, record) for one in used_actuators(design))
    table.writerows(_links(design, record))
    return text.getvalue()


def _actuator(design: Design, actuator: Actuator, record: Mapping[str, Any]) -> dict[str, object]:
    """Row of a class of actuators."""
    count = sum(body.actuator is actuator for body in design.bodies)
    # Its own part comes first: of modules with the same torque and speed it is the one.
    own = [actuator.part] if actuator.part is not None else []
    parts = (*own, *catalogue(actuator.kind).values(), *plan(design.spec).own)
    part = nearest(scalar(actuator.peak_torque), scalar(actuator.no_load_speed), parts)
    return {
        **_masses("actuator", actuator.name, count, actuator.mass),
        "peak_torque_nm": _number(actuator.peak_torque),
        "no_load_speed_rad_s": _number(actuator.no_load_speed),
        "mass_source": _source(record["actuators"][actuator.name]["mass"]),
        "nearest_module": part.name,
        "nearest_maker": part.vendor,
        "nearest_peak_torque_nm": _number(part.peak_torque),
        "nearest_no_load_speed_rad_s": _number(part.no_load_speed),
        "nearest_mass_kg": _number(part.mass),
        "nearest_source": part.source,
    }


def _links(design: Design, record: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    """Rows of the links that have solids, without their actuators."""
    segments = {
        body: record["segments"][k]
        for k, segment in enumerate(plan(design.spec).segments)
        for copy in segment.copies
        for body in copy
    }
    for i, body in enumerate(design.bodies):
        mass, part = body.member_mass + body.end_mass, body.link.shape
        solids = [geom if own is None else own.mesh for geom, own in body.replaced()]
        volume = g.total(solid.volume for solid in solids)
        sources = [_source(segments[i])] if i in segments else []
        if part is not None:
            stated = part.mass is not None
            alone = stated and body.end_mass == 0  # Else the law has the end.
            words = f"{part.mesh.file}: {'stated' if stated else 'drawn'}"
            sources = [words] if alone else [words, *sources]
        if i == 0 and (trunk := design.lofted) is not None:
            solid = trunk.loft if part is None else part.mesh
            mass, volume = mass + trunk.mass, volume + solid.volume
            if part is None or part.mass is None:
                sources.append(f"density: {_source(record['trunk']['density_kg_m3'])}")
        if body.end_mass and (body.carries or body.parent is None):
            sources.append("end stated")
        if scalar(volume) > 0:
            yield {
                **_masses("link", body.name, 1, mass),
                "density_kg_m3": _number(mass / volume),
                "mass_source": "; ".join(sources),
            }


def _masses(kind: str, name: str, count: int, each: Value) -> dict[str, object]:
    """Cells that all rows have."""
    return {
        "kind": kind,
        "name": name,
        "count": count,
        "mass_each_kg": _number(each),
        "mass_total_kg": _number(each * count),
    }


def _source(record: Mapping[str, Any]) -> str:
    """Origin of a number in the report: a law with its data, a part of the catalogue, or stated."""
    law = record.get("fit") or record.get("from")
    if record["origin"] == "stated" or law is None:
        return record["origin"]
    return f"{record.get('from', law)} ({record['source']})" if "source" in record else law


def _number(value: Value) -> str:
    return f"{scalar(value):.6g}"
