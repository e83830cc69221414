"""Density of the feet of surveyed quadrupeds, taken as solid spheres.

The radius is that of the contact sphere. There is one foot per robot whose description has a foot
link with a mass and a collision sphere (the largest, if it has several). Data: feet.csv, with
masses and radii from the descriptions.
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
        radius: radius of its largest collision sphere [m].
        used: whether the fit of the density uses it.
        reason: why the fit does not use it.
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
    """Fit mass proportional to volume, with the median density of these feet."""
    volume, mass = columns(known)
    law = fits.law("end", fits.proportional(volume[:, None], mass), volume, mass, fits.VOLUME)
    return replace(law, source=SOURCE)


def quartiles(known: Sequence[Foot]) -> dict[str, float]:
    """Quartiles of the density of these feet [kg/m3]."""
    low, high = map(float, np.percentile([foot.density for foot in known], (25, 75)))
    return {"p25": low, "p75": high}
