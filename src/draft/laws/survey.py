"""Table of segments: one row per segment, as a file and as values.

Units are in the column names. Cells with a value per joint of the segment separate them by spaces;
"-" is a missing role, limit or centre.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from draft.errors import DraftError, Location, Problem

FILE = Path(__file__).resolve().parent / "data" / "segments.csv"
COLUMNS = (
    "robot",
    "population",
    "segment",
    "parent",
    "class",
    "joints",
    "roles",
    "efforts_nm",
    "velocities_rad_s",
    "mass_kg",
    "length_m",
    "box_a_m",
    "box_b_m",
    "box_c_m",
    "com_x_m",
    "com_y_m",
    "com_z_m",
    "ixx_kg_m2",
    "iyy_kg_m2",
    "izz_kg_m2",
    "ixy_kg_m2",
    "ixz_kg_m2",
    "iyz_kg_m2",
    "centre",
)
LIGHTEST = 1e-6
SHORTEST = 1e-3
THINNEST = 1e-4
STRONGEST = 1000.0


@dataclass(frozen=True)
class Row:
    """One segment of one robot. SI units.

    Attributes:
        robot: the robot's key.
        population: "humanoid" or "quadruped".
        segment: name of its first link.
        parent: name of its parent segment; "" for the root.
        kind: its class; "base" for the root, "" where the survey has none.
        joints: names of the joints merged into it.
        roles: role of each joint; "" where unknown.
        efforts: effort limit of each joint [N m or N]; NaN where unknown.
        velocities: velocity limit of each joint [rad/s or m/s]; NaN where unknown.
        mass: mass [kg].
        length: length [m].
        box: edges of the box with the same inertia [m].
        com: centre of mass in the frame of its first link [m].
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass [kg m2].
        centre: position of the centre of mass along the length, from 0 at its first joint to 1; NaN
            where the length is not a distance between joints or links.
    """

    robot: str
    population: str
    segment: str
    parent: str
    kind: str
    joints: tuple[str, ...]
    roles: tuple[str, ...]
    efforts: tuple[float, ...]
    velocities: tuple[float, ...]
    mass: float
    length: float
    box: tuple[float, float, float]
    com: tuple[float, ...]
    inertia: tuple[float, ...]
    centre: float = math.nan

    @cached_property
    def box_volume(self) -> float:
        """Volume of the box [m3]; 0 where no solid has such an inertia."""
        return math.prod(self.box) if min(self.box) > THINNEST else 0.0


def usable(effort: float) -> bool:
    """Whether a declared torque [N m] gives an actuator mass: above 0, at most 1000."""
    return math.isfinite(effort) and 0.0 < effort <= STRONGEST


def write(rows: Iterable[Row]) -> str:
    """Text of the table, with eight significant digits."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        numbers = (row.mass, row.length, *row.box, *row.com, *row.inertia, row.centre)
        writer.writerow(
            (
                row.robot,
                row.population,
                row.segment,
                row.parent,
                row.kind,
                " ".join(row.joints),
                " ".join(role or "-" for role in row.roles),
                " ".join(map(_cell, row.efforts)),
                " ".join(map(_cell, row.velocities)),
                *map(_cell, numbers),
            )
        )
    return out.getvalue()


def read(path: Path = FILE) -> list[Row]:
    """Read a table of segments; the shipped one by default.

    Raises:
        DraftError: the file is missing or not such a table; the message gives the row.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        cause = f"cannot read it: {getattr(error, 'strerror', None) or 'not UTF-8 text'}"
        raise DraftError(Problem(cause, Location(str(path)))) from None
    reader = csv.DictReader(io.StringIO(text))
    if tuple(reader.fieldnames or ()) != COLUMNS:
        remedy = "write one: draft survey parse"
        cause = "its columns are not those of a segment table"
        raise DraftError(Problem(cause, Location(str(path), 1), remedy))
    rows: list[Row] = []
    for record in reader:
        try:
            rows.append(_row(record))
        except (ValueError, TypeError):
            where = Location(str(path), reader.line_num)
            raise DraftError(Problem("a cell of this row is not a number", where)) from None
    return rows


def _row(record: dict[str, str]) -> Row:
    def numbers(*keys: str) -> tuple[float, ...]:
        values = tuple(float(record[key]) for key in keys)
        if not all(map(math.isfinite, values)):
            raise ValueError(keys)
        return values

    def limits(key: str) -> tuple[float, ...]:
        return tuple(math.nan if cell == "-" else float(cell) for cell in record[key].split())

    mass, length, a, b, c = numbers(*COLUMNS[9:14])
    return Row(
        robot=record["robot"],
        population=record["population"],
        segment=record["segment"],
        parent=record["parent"],
        kind=record["class"],
        joints=tuple(record["joints"].split()),
        roles=tuple("" if cell == "-" else cell for cell in record["roles"].split()),
        efforts=limits("efforts_nm"),
        velocities=limits("velocities_rad_s"),
        mass=mass,
        length=length,
        box=(a, b, c),
        com=numbers(*COLUMNS[14:17]),
        inertia=numbers(*COLUMNS[17:23]),
        centre=math.nan if record["centre"] == "-" else numbers("centre")[0],
    )


def _cell(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.8g}"
