"""Servos: small motors with gears and electronics in one box, and their laws.

Their laws are of their own: below the weakest module of the catalogue, 4.1 N m, its laws give two
to eleven times the mass of a servo. Sizes are those of the box: `length` is its edge along the
output axis, and `radius` that of a circle of the area of the other two. The ratio of these two is
that of the part, or the median of all servos.

Where the axis of the output horn crosses that face is in no table. It is taken to lie in the middle
of the shorter edge, and half of the shorter edge from one end of the longer: as far from the end as
from both sides. That is an assumption.
"""

from __future__ import annotations

import csv
import json
import math
import re
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from statistics import median

from draft.errors import Location
from draft.laws.actuators import Laws, laws_of
from draft.laws.catalogue import SERVO, Part

FILE = Path(__file__).resolve().parent / "data" / "small_actuators.csv"
TRENDS = FILE.with_name("servo_trends.json")
EXCLUDED = "not in fits"  # Note of rows that are no single actuator, or of a doubtful mass.
_SERIES = re.compile("[0-9]*[A-Za-z]*")  # First letters of a model: XM of XM430-W350.
_REQUIRED = ("stall_torque_Nm", "no_load_speed_rad_s", "length_m", "width_m", "height_m")


def servos() -> dict[str, Part]:
    """Servos by name, in the order of the file, without those that are no single actuator."""
    return {part.name: part for part in read_servos() if EXCLUDED not in part.note}


def small_actuators() -> list[dict[str, str]]:
    """Rows of the table: servos, gearmotors and small modules."""
    with FILE.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def read_servos() -> list[Part]:
    """All servos of the table of which torque, speed and sizes are known."""
    return [
        _part(row, line)
        for line, row in enumerate(small_actuators(), start=2)
        if row["kind"] == SERVO and all(map(row.get, _REQUIRED))
    ]


@lru_cache(maxsize=1)
def servo_laws() -> Laws:
    """Laws of servos; `draft.fitting.actuators.servo_refit` fits them."""
    record = json.loads(TRENDS.read_text(encoding="utf-8"))[SERVO]
    return replace(laws_of(SERVO, record), kind=SERVO)


@lru_cache(maxsize=1)
def usual_face_ratio() -> float:
    """Longer over shorter edge of the face across the axis: the median of all servos."""
    return median(part.face_ratio for part in servos().values() if part.face_ratio is not None)


def _part(row: dict[str, str], line: int) -> Part:
    def known(column: str) -> float | None:
        return float(row[column]) if row[column] else None

    torque, speed, long, wide, high = (float(row[column]) for column in _REQUIRED)
    return Part(
        name=row["model"],
        vendor=row["maker"],
        family=_SERIES.match(row["model"])[0],  # pyright: ignore[reportOptionalSubscript]
        peak_torque=torque,
        no_load_speed=speed,
        gear_ratio=known("gear_ratio"),
        mass=float(row["mass_kg"]),
        radius=math.sqrt(long * wide / math.pi),
        length=high,
        rotor_inertia=known("rotor_inertia_kgm2"),
        small_geared_inrunner=False,
        rated_torque=known("rated_torque_Nm"),
        corner_speed=None,
        rated_source=row["source"],
        source=row["source"],
        note=row["note"],
        doubt="",
        where=Location(str(FILE), line),
        face_ratio=max(long, wide) / min(long, wide),
    )
