"""What the feet of surveyed quadrupeds weigh, as solid balls of their contact spheres.

One foot per robot whose description gives it a link of its own with a mass and a collision sphere
(the largest counts). Data: feet.csv; its masses and radii are those of the descriptions.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from draft.fitting.structure.robots import DATA

FILE = DATA / "feet.csv"


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
    def density(self) -> float:
        """Mass over the volume of the sphere [kg/m3]."""
        return self.mass / (4 / 3 * math.pi * self.radius**3)


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


def density(known: Iterable[Foot]) -> dict[str, float | int]:
    """Median density of the feet that count [kg/m3], of how many, and its quartiles."""
    values = [foot.density for foot in known if foot.used]
    low, middle, high = map(float, np.percentile(values, (25, 50, 75)))
    return {"density": middle, "n": len(values), "p25": low, "p75": high}
