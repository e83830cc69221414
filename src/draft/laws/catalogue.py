"""The actuator catalogue: one row per module, from the datasheets of vendors.

Source: the data set of "Draft: A Parametric Tool for Robot Design Exploration" (Nguyen, Coelho,
Kim, arXiv 2609.38405; MIT licence). The numbers are those of the vendors; each row has its source.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from statistics import median
from typing import NamedTuple, cast

from draft.errors import DraftError, Location, Problem, suggest
from draft.files import Readable
from draft.laws.table import COLUMNS, Row, read_table

FILE = Path(__file__).resolve().parent / "data" / "actuators.csv"
MODULE, SERVO = "module", "servo"  # Families of actuators, with laws and limits of their own.


@dataclass(frozen=True, slots=True)
class Part:
    """One actuator module as published. Torque and speed are at the output; SI units.

    `gear_ratio`, `rotor_inertia` (motor side) and `rated_torque` (continuous) are None where no
    source publishes them; `rated_torque` also where the only source describes another version.
    `corner_speed`, the highest speed with full peak torque, is known of a few.
    `rated_source` is the source of the rated torque, `doubt` what a source contradicts in this row,
    and `where` its file and line. A servo is a box: its `radius` is that of a circle of the area of
    its face across the axis, whose longer edge is `face_ratio` times its shorter one; the face of a
    module is round, and has none.
    """

    name: str
    vendor: str
    family: str
    peak_torque: float
    no_load_speed: float
    gear_ratio: float | None
    mass: float
    radius: float
    length: float
    rotor_inertia: float | None
    small_geared_inrunner: bool
    rated_torque: float | None
    corner_speed: float | None
    rated_source: str
    source: str
    note: str
    doubt: str
    where: Location
    face_ratio: float | None = None

    @property
    def aspect_ratio(self) -> float:
        """Length over diameter."""
        return self.length / (2 * self.radius)

    @property
    def volume(self) -> float:
        """Volume of the enclosing cylinder [m3]."""
        return math.pi * self.radius**2 * self.length

    @property
    def peak_power(self) -> float:
        """Peak power of a straight torque-speed line, tau w / 4 [W]."""
        return self.peak_torque * self.no_load_speed / 4

    @property
    def armature(self) -> float | None:
        """Inertia of the rotor at the output, N^2 J [kg m2]; None where a factor is unknown."""
        if self.gear_ratio is None or self.rotor_inertia is None:
            return None
        return self.gear_ratio**2 * self.rotor_inertia

    @property
    def torque_density(self) -> float:
        """Peak torque per mass [N m/kg]."""
        return self.peak_torque / self.mass

    @property
    def power_density(self) -> float:
        """Peak power of a straight torque-speed line, tau w / 4, per mass [W/kg]."""
        return self.peak_power / self.mass


@dataclass(frozen=True, slots=True)
class Extremes:
    """Extremes of a family of modules: the range of reductions, and the modules with maxima."""

    name: str
    gear_range: tuple[float, float]
    torque: Part
    torque_density: Part
    power_density: Part


@lru_cache(maxsize=2)
def catalogue(kind: str = MODULE) -> dict[str, Part]:
    """Shipped modules by name, in the order of the file.

    Args:
        kind: family of actuators, "module" or "servo".
    """
    if kind == SERVO:
        from draft.laws.servos import servos

        return servos()
    return read_parts(FILE)[0]


def read_parts(path: Readable) -> tuple[dict[str, Part], list[Problem]]:
    """Read a table of modules; see `draft.laws.table`.

    Returns:
        The modules by name, and the cells that were skipped.

    Raises:
        DraftError: the table is invalid, or a name is not unique.
    """
    rows, skipped = read_table(path)
    parts: dict[str, Part] = {}
    _add(parts, map(_part, rows))
    return parts, skipped


def with_rows(paths: Iterable[Readable]) -> tuple[dict[str, Part], list[Problem]]:
    """Shipped modules together with those of further tables.

    Returns:
        The modules by name, and the cells that were skipped.

    Raises:
        DraftError: a table is invalid, or a name is not unique.
    """
    parts, skipped = dict(catalogue()), []
    for path in paths:
        more, cells = read_parts(path)
        _add(parts, more.values())
        skipped += cells
    return parts, skipped


def _add(parts: dict[str, Part], more: Iterable[Part]) -> None:
    problems = []
    for part in more:
        if part.name in parts:
            first = parts[part.name].where
            cause = f"there is already a module '{part.name}', at {first}"
            problems.append(Problem(cause, part.where, "rename one, or remove one"))
        parts.setdefault(part.name, part)
    if problems:
        raise DraftError(problems)


def find(name: str, more: tuple[Part, ...] = ()) -> Part:
    """Find a module or servo of the catalogue, or one of further ones, by name.

    Raises:
        DraftError: there is none; the message suggests the nearest name.
    """
    parts = {**catalogue(SERVO), **catalogue(), **{part.name: part for part in more}}
    if name not in parts:
        raise DraftError(f"the catalogue has no part '{name}'", suggest(name, parts, "parts"))
    return parts[name]


def nearest(peak_torque: float, no_load_speed: float, parts: Iterable[Part]) -> Part:
    """Find the module nearest to a peak torque and a no-load speed, both compared as ratios.

        >>> nearest(20.0, 45.0, catalogue().values()).name
        'AK80-9 V3'

    Args:
        peak_torque: at the output [N m].
        no_load_speed: at the output [rad/s].
        parts: the modules, at least one; of equally near ones the first is taken.
    """

    def distance(part: Part) -> float:
        ratios = part.peak_torque / peak_torque, part.no_load_speed / no_load_speed
        return math.hypot(*map(math.log, ratios))

    return min(parts, key=distance)


@lru_cache(maxsize=8)
def extremes(
    more: tuple[Part, ...] = (), kind: str = MODULE
) -> tuple[Extremes, dict[str, Extremes]]:
    """Extremes of the whole catalogue with further modules, and of each family.

    Servos of all makers are one family: their makers print few reductions.
    """
    parts = [*catalogue(kind).values(), *more]
    families: dict[str, list[Part]] = {}
    for part in parts:
        families.setdefault("servos" if kind == SERVO else part.family, []).append(part)
    for name, family in [*families.items()]:
        if all(part.gear_ratio is None for part in family):
            del families[name]  # without a reduction there is nothing to compare by
    return _extremes("catalogue", parts), {n: _extremes(n, ps) for n, ps in families.items()}


class Span(NamedTuple):
    """Lowest, median and highest value of a quantity over n modules."""

    low: float
    middle: float
    high: float
    n: int


@lru_cache(maxsize=128)
def span(quantity: str, more: tuple[Part, ...] = (), kind: str = MODULE) -> Span | None:
    """Span of a quantity over the catalogue with further modules; None if no source publishes it.

    Args:
        quantity: an attribute of `Part`.
        more: the further modules.
        kind: family of actuators.
    """
    values = [getattr(part, quantity, None) for part in (*catalogue(kind).values(), *more)]
    known = [value for value in values if value is not None]
    return Span(min(known), median(known), max(known), len(known)) if known else None


def aspect_range(more: tuple[Part, ...] = (), kind: str = MODULE) -> tuple[float, float]:
    """Lowest and highest length over diameter in the catalogue with further modules."""
    known = span("aspect_ratio", more, kind)
    return (known.low, known.high) if known is not None else (0.0, math.inf)


def _extremes(name: str, parts: list[Part]) -> Extremes:
    ratios = [part.gear_ratio for part in parts if part.gear_ratio is not None]
    return Extremes(
        name,
        (min(ratios), max(ratios)),
        max(parts, key=lambda part: part.peak_torque),
        max(parts, key=lambda part: part.torque_density),
        max(parts, key=lambda part: part.power_density),
    )


def _part(row: Row) -> Part:
    text, flag = row.text, row.flag
    numbers = {name: row.number.get(name) for name in _NUMBERS}
    if flag.get("rated_of_another_version", False):
        numbers["rated_torque"] = None
    return Part(
        name=text["name"],
        vendor=text["vendor"].split("/")[0],
        family=text["family"],
        radius=row.number["diameter"] / 2,
        small_geared_inrunner=flag.get("small_geared_inrunner", False),
        rated_source=text.get("rated_source", text["source"]),
        source=text["source"],
        note=text.get("note", ""),
        doubt=text.get("doubt", ""),
        where=row.where,
        **cast("dict[str, float]", numbers),
    )


# Fields of a part that are columns of the table.
_NUMBERS = {one.name for one in fields(Part)} & {c.name for c in COLUMNS if c.kind == "number"}
