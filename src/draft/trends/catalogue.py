"""The actuator catalogue: one row per module, from vendors' datasheets.

Source: the data set of "Draft: A Parametric Tool for Robot Design Exploration" (Nguyen, Coelho,
Kim, arXiv 2609.38405; MIT licence); the numbers are the vendors', each row names its page.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from draft.errors import DraftError, Problem, suggest

FILE = Path(__file__).resolve().parent / "data" / "actuators.csv"


@dataclass(frozen=True, slots=True)
class Part:
    """One actuator module as published. Torque and speed are at the output; SI units.

    `gear_ratio` and `rotor_inertia` (motor side) are None where the vendor gives none.
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
    source: str

    @property
    def aspect_ratio(self) -> float:
        """Length over diameter."""
        return self.length / (2 * self.radius)

    @property
    def volume(self) -> float:
        """Volume of the enclosing cylinder [m3]."""
        return math.pi * self.radius**2 * self.length

    @property
    def torque_density(self) -> float:
        """Peak torque per mass [N m/kg]."""
        return self.peak_torque / self.mass

    @property
    def power_density(self) -> float:
        """Peak power of a straight torque-speed line, tau w / 4, per mass [W/kg]."""
        return self.peak_torque * self.no_load_speed / 4 / self.mass


@dataclass(frozen=True, slots=True)
class Extremes:
    """The most that any module of a family does, each with the module that does it."""

    name: str
    gear_range: tuple[float, float]
    torque: Part
    torque_density: Part
    power_density: Part


@lru_cache(maxsize=1)
def catalogue() -> dict[str, Part]:
    """All modules by name, in the file's order."""
    with FILE.open(newline="", encoding="utf-8") as file:
        return {row["name"]: _part(row) for row in csv.DictReader(file)}


def find(name: str) -> Part:
    """Look a module up.

    Raises:
        DraftError: no module of this name; the nearest is named.
    """
    parts = catalogue()
    if name not in parts:
        raise DraftError(
            Problem(f"the catalogue has no part '{name}'", None, suggest(name, parts, "parts"))
        )
    return parts[name]


@lru_cache(maxsize=1)
def extremes() -> tuple[Extremes, dict[str, Extremes]]:
    """Extremes of the whole catalogue, and of each family."""
    parts = list(catalogue().values())
    families: dict[str, list[Part]] = {}
    for part in parts:
        families.setdefault(part.family, []).append(part)
    return _extremes("catalogue", parts), {n: _extremes(n, ps) for n, ps in families.items()}


@lru_cache(maxsize=1)
def aspect_range() -> tuple[float, float]:
    """Lowest and highest length over diameter in the catalogue."""
    ratios = [part.aspect_ratio for part in catalogue().values()]
    return min(ratios), max(ratios)


def _extremes(name: str, parts: list[Part]) -> Extremes:
    ratios = [part.gear_ratio for part in parts if part.gear_ratio is not None]
    return Extremes(
        name,
        (min(ratios), max(ratios)),
        max(parts, key=lambda part: part.peak_torque),
        max(parts, key=lambda part: part.torque_density),
        max(parts, key=lambda part: part.power_density),
    )


def _part(row: dict[str, str]) -> Part:
    def perhaps(key: str) -> float | None:
        return float(row[key]) if row[key] else None

    return Part(
        name=row["name"],
        vendor=row["vendor"].split("/")[0],
        family=row["family"],
        peak_torque=float(row["peak_torque_nm"]),
        no_load_speed=float(row["no_load_speed_rad_s"]),
        gear_ratio=perhaps("gear_ratio"),
        mass=float(row["mass_kg"]),
        radius=float(row["diameter_mm"]) / 2000,
        length=float(row["length_mm"]) / 1000,
        rotor_inertia=perhaps("rotor_inertia_kg_m2"),
        small_geared_inrunner=row["small_geared_inrunner"] == "true",
        source=row["source"],
    )
