"""Tables of actuators in CSV, with the units in the column names.

`COLUMNS` lists the columns. An invalid cell of a required column is an error; an invalid cell of an
optional column is skipped like a blank one, and reported. Lines are counted from 1, including the
header, as in editors.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from draft.errors import DraftError, Location, Problem, suggest
from draft.files import Readable

RPM = 2 * math.pi / 60


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a table of actuators.

    Attributes:
        name: name without the unit.
        units: factor to SI by unit, which is the suffix of the heading; empty for text and
            dimensionless numbers.
        kind: "number", "text" or "flag" (true, false or blank).
        required: whether a blank or invalid cell is an error; otherwise it is skipped.
    """

    name: str
    units: dict[str, float] = field(default_factory=dict)
    kind: str = "number"
    required: bool = False

    @property
    def heading(self) -> str:
        """Name with the unit that the shipped table uses."""
        return f"{self.name}_{next(iter(self.units))}" if self.units else self.name


_LENGTH = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
COLUMNS = (
    Column("name", kind="text", required=True),
    Column("vendor", kind="text", required=True),
    Column("family", kind="text", required=True),
    Column("peak_torque", {"nm": 1.0, "mnm": 1e-3}, required=True),
    Column("no_load_speed", {"rad_s": 1.0, "rpm": RPM}, required=True),
    Column("gear_ratio"),
    Column("mass", {"kg": 1.0, "g": 1e-3}, required=True),
    Column("diameter", _LENGTH, required=True),
    Column("length", _LENGTH, required=True),
    Column("rotor_inertia", {"kg_m2": 1.0, "kg_cm2": 1e-4, "g_cm2": 1e-7, "g_mm2": 1e-9}),
    Column("rotor_inertia_published", kind="text"),
    Column("rotor_inertia_kind", kind="text"),
    Column("small_geared_inrunner", kind="flag"),
    Column("peak_power", {"w": 1.0}),
    Column("rated_torque", {"nm": 1.0, "mnm": 1e-3}),
    Column("rated_condition", kind="text"),
    Column("rated_source", kind="text"),
    Column("rated_of_another_version", kind="flag"),
    Column("corner_speed", {"rad_s": 1.0, "rpm": RPM}),
    Column("source", kind="text", required=True),
    Column("note", kind="text"),
    Column("doubt", kind="text"),
)


@dataclass(frozen=True, slots=True)
class Row:
    """One module of a table, its numbers in SI units; blank cells are missing."""

    where: Location
    text: dict[str, str]
    number: dict[str, float]
    flag: dict[str, bool]


@dataclass(frozen=True, slots=True)
class Heading:
    """Heading of a table: index, column, and factor from its unit to SI."""

    index: int
    column: Column
    factor: float


def read_table(path: Readable) -> tuple[list[Row], list[Problem]]:
    """Read a table of actuators.

    Returns:
        The rows, and the cells of optional columns that were skipped.

    Raises:
        DraftError: the file cannot be read, its columns are not those of `COLUMNS`, or a row lacks
            a required number; every problem is listed with file and line.
    """
    refused: list[Problem] = []
    skipped: list[Problem] = []
    rows: list[Row] = []
    lines = _lines(path)
    header = next(lines, (1, []))[1]
    headings = _headings(header, path, refused)
    if refused:
        raise DraftError(refused)
    for line, cells in lines:
        where = Location(str(path), line)
        if len(cells) != len(header):
            cause = f"{len(cells)} cells under {len(header)} headings"
            refused.append(Problem(cause, where, "quote cells that hold a comma"))
            continue
        rows.append(_row(cells, headings, where, refused, skipped))
    if not rows and not refused:
        refused.append(Problem("no rows", Location(str(path)), "add one row per module"))
    if refused:
        raise DraftError(refused)
    return rows, skipped


def _lines(path: Readable) -> Iterator[tuple[int, list[str]]]:
    """Non-empty lines of a CSV file, with their numbers."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
        reader = csv.reader(io.StringIO(text, newline=""))
        for cells in reader:
            if any(cell.strip() for cell in cells):
                yield reader.line_num, [cell.strip() for cell in cells]
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        problem = Problem(f"cannot be read: {reason}", Location(str(path)), "pass a CSV file")
        raise DraftError(problem) from None
    except (UnicodeDecodeError, csv.Error) as error:
        problem = Problem(f"is not a CSV table: {error}", Location(str(path)), "save it as UTF-8")
        raise DraftError(problem) from None


def _headings(header: list[str], path: Readable, refused: list[Problem]) -> list[Heading]:
    where = Location(str(path), 1)
    found: dict[str, Heading] = {}
    for index, name in enumerate(header):
        match = _match(name)
        if isinstance(match, str):
            refused.append(Problem(f"unknown column '{name}'", where, match))
            continue
        column, factor = match
        if column.name in found:
            refused.append(Problem(f"two columns give '{column.name}'", where, "keep one"))
        found[column.name] = Heading(index, column, factor)
    for column in COLUMNS:
        if column.required and column.name not in found and not refused:
            units = f"; units: {', '.join(column.units)}" if column.units else ""
            remedy = f"add it: it is required{units}"
            refused.append(Problem(f"no column '{column.heading}'", where, remedy))
    return list(found.values())


def _match(name: str) -> tuple[Column, float] | str:
    """Column and factor to SI of a heading, or the remedy for an unknown one."""
    for column in COLUMNS:
        if not column.units and name == column.name:
            return column, 1.0
        for unit, factor in column.units.items():
            if name == f"{column.name}_{unit}":
                return column, factor
    for column in COLUMNS:
        if column.units and (name == column.name or name.startswith(column.name + "_")):
            unit = name.removeprefix(column.name).lstrip("_")
            cause = f"unknown unit '{unit}'" if unit else "the unit is missing"
            return f"{cause}; use {' or '.join(f'{column.name}_{u}' for u in column.units)}"
    return suggest(name, [column.heading for column in COLUMNS], "columns")


def _row(
    cells: list[str],
    headings: list[Heading],
    where: Location,
    refused: list[Problem],
    skipped: list[Problem],
) -> Row:
    row = Row(where, {}, {}, {})
    name = next((cells[h.index] for h in headings if h.column.name == "name"), "")
    owner = f" of '{name}'" if name else ""
    for heading in headings:
        cell, column = cells[heading.index], heading.column
        cause = _put(row, cell, heading)
        if cause and column.required:
            problem = Problem(
                f"{column.heading}{owner} {cause}", where, "correct it: it is required"
            )
            refused.append(problem)
        elif cause:
            problem = Problem(
                f"{column.heading}{owner} {cause}: skipped", where, "correct it, or leave it blank"
            )
            skipped.append(problem)
    return row


def _put(row: Row, cell: str, heading: Heading) -> str:
    """Read a cell into a row; return the cause of an error, or ""."""
    column = heading.column
    if not cell:
        return "is missing" if column.required else ""
    if column.kind == "text":
        row.text[column.name] = cell
        return ""
    if column.kind == "flag":
        row.flag[column.name] = cell.lower() == "true"
        return "" if cell.lower() in ("true", "false") else f"is '{cell}', neither true nor false"
    try:
        value = float(cell) * heading.factor
    except ValueError:
        return f"is '{cell}', not a number"
    if not 0 < value < math.inf:
        return f"is {cell}, not above zero" if value <= 0 else f"is {cell}, not a finite number"
    row.number[column.name] = value
    return ""
