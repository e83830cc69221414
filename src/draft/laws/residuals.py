"""Residuals of real robots against the trends by group of links, for studies of robustness.

The shipped file has every surveyed robot, predicted by trends fitted without it, and four robots
with meshes; `docs.twins` writes it. Its twins weigh by the published
sum of structure, as the published designs do that studies perturb; it stays as it is, so that
results of studies stay comparable. Method: arXiv 2609.38405, inertia mismatch.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

FILE = Path(__file__).resolve().parent / "data" / "twin_residuals.json"


@dataclass(frozen=True, slots=True)
class Residual:
    """Residuals of one group of links of a real robot against its twin.

    Attributes:
        mass: real mass over the twin's, all copies together.
        gyration: real radius of gyration over the twin's, geometric mean over the copies; None
            where the description gives no inertia.
        com_shift: real centre of mass minus the twin's: forward, outboard, up; mean over the
            copies, as shares of the twin's leg length (thigh + shank), or [m] for a robot without
            legs.
        com_spread: standard deviation of that shift over the copies, such as fore and hind legs.
        bodies: number of rigid bodies in the group.
    """

    mass: float
    gyration: float | None
    com_shift: tuple[float, float, float]
    com_spread: tuple[float, float, float]
    bodies: int


@dataclass(frozen=True, slots=True)
class Real:
    """Residuals of a real robot.

    Attributes:
        population: "humanoid" or "quadruped".
        held_out: whether the trends were fitted without it.
        groups: residuals by group of links.
    """

    population: str
    held_out: bool
    groups: dict[str, Residual]


@lru_cache(maxsize=1)
def residuals() -> dict[str, Real]:
    """Residuals of all robots by key."""
    table = json.loads(FILE.read_text(encoding="utf-8"))
    return {
        key: Real(row["population"], row["held_out"], dict(map(_group, row["groups"].items())))
        for key, row in table.items()
    }


def _group(item: tuple[str, dict[str, Any]]) -> tuple[str, Residual]:
    name, row = item
    vectors = {key: tuple(row[key]) for key in ("com_shift", "com_spread")}
    return name, Residual(**{**row, **vectors})
