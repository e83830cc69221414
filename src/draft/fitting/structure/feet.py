"""What the feet of surveyed quadrupeds weigh, as solid balls of their contact spheres.

One foot per robot whose description gives it a link of its own with a mass and a collision sphere
(the largest counts). Data: feet.csv; its masses and radii are those of the descriptions.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from draft.fitting.structure import fits
from draft.fitting.structure.robots import DATA
from draft.laws.law import Law
from draft.values import Array

FILE = DATA / "feet.csv"
SOURCE = "draft/fitting/structure/data/feet.csv"


@dataclass(frozen=True, slots=True)
class Foot:
    """The foot of one robot.

    Attributes:
        key: the robot's key.
        link: the foot's link in its description.
        mass: mass of that link [kg].
        radius: of its largest collision sphere [m].
        used: whether the density rests on it.
        reason: why it does not.
    """

    key: str
    link: str
    mass: float
    radius: float
    used: bool
    reason: str

    @property
    def volume(self) -> float:
        """Volume of the sphere [m3]."""
        return 4 / 3 * math.pi * self.radius**3

    @property
    def density(self) -> float:
        """Mass over the volume of the sphere [kg/m3]."""
        return self.mass / self.volume


@lru_cache(maxsize=1)
def feet() -> tuple[Foot, ...]:
    """All feet of the table."""
    with FILE.open(newline="", encoding="utf-8") as file:
        return tuple(
            Foot(
                row["key"],
                row["link"],
                float(row["mass_kg"]),
                float(row["radius_m"]),
                row["used"] == "true",
                row["reason"],
            )
            for row in csv.DictReader(file)
        )


def columns(known: Sequence[Foot]) -> tuple[Array, Array]:
    """Volumes [m3] and masses [kg] of feet, shape (n,) each."""
    return np.array([foot.volume for foot in known]), np.array([foot.mass for foot in known])


def fit(known: Sequence[Foot]) -> Law:
    """Mass of an end over its volume, by the median density of these feet."""
    volume, mass = columns(known)
    found = fits.law("end", fits.proportional(volume[:, None], mass), volume, mass, fits.VOLUME)
    return replace(found, source=SOURCE)


def quartiles(known: Sequence[Foot]) -> dict[str, float]:
    """Quartiles of the density of these feet [kg/m3]."""
    low, high = map(float, np.percentile([foot.density for foot in known], (25, 75)))
    return {"p25": low, "p75": high}
