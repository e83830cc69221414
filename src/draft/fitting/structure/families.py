"""Trunks of surveyed robots of one maker: what longer legs mean for them.

The calibrated law of the trunk compares robots of all makers. This compares those of one maker, to
see what holds for a design of which only the legs change. `python -m
draft.fitting.structure.families` prints the table of docs/structure-trends.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from operator import attrgetter

import numpy as np

from draft.fitting.structure.attribution import Machine, machines
from draft.fitting.structure.calibrated import OF_VOLUME, trunk_volume
from draft.fitting.structure.fits import TRUNKS
from draft.fitting.structure.robots import robots as known
from draft.fitting.structure.whole import leg_length
from draft.laws.survey import FILE, read

# Pairs whose legs differ by less say nothing about legs.
LEAST_LEG = 1.03
# Robots on the same drives with much the same trunk: largest ratio of the mass of all actuators,
# and of the volume of the trunk.
SAME_DRIVES, SAME_TRUNK = 1.1, 1.25


@dataclass(frozen=True, slots=True)
class Pair:
    """Two robots of one maker, by what the one with longer legs has over the other.

    Attributes:
        names: keys of the robots, shorter legs first.
        leg, volume, drives, trunk: ratios of leg length, volume of the trunk, mass of the actuators
            and structural mass of the trunk.
    """

    names: tuple[str, str]
    leg: float
    volume: float
    drives: float
    trunk: float

    @property
    def exponent(self) -> float:
        """Exponent of the leg length in the mass of the trunk, its volume accounted for."""
        return math.log(self.trunk / self.volume**OF_VOLUME) / math.log(self.leg)

    @property
    def alike(self) -> bool:
        """Whether drives and trunks are so alike that the pair can show what legs alone do."""
        drives, volume = (max(x, 1 / x) for x in (self.drives, self.volume))
        return drives <= SAME_DRIVES and volume <= SAME_TRUNK


@dataclass(frozen=True, slots=True)
class Exponent:
    """Exponent b of m = c V^(1/2) L^b for the trunk, with one c, or one c for each maker.

    Attributes:
        value: the exponent.
        error: its standard error.
        n: number of robots.
        makers: number of makers with an own c; 1 for all together.
    """

    value: float
    error: float
    n: int
    makers: int


def surveyed(population: str) -> list[Machine]:
    """Surveyed robots of a population."""
    return [robot for robot in machines(read(FILE)) if robot.population == population]


def trunk_mass(robot: Machine) -> float:
    """Structural mass of the trunk [kg]: root, and torso of a humanoid with a waist."""
    return sum(piece.structure for piece in robot.pieces if piece.kind in TRUNKS)


def pairs(robots: Sequence[Machine]) -> list[Pair]:
    """Pairs of robots of one maker whose legs differ, in the order of the survey."""
    makers = known()
    found = []
    for a, b in combinations(robots, 2):
        if makers[a.key].maker != makers[b.key].maker:
            continue
        short, long = sorted((a, b), key=leg_length)
        leg, volume, drives, trunk = (
            of(long) / of(short)
            for of in (leg_length, trunk_volume, attrgetter("actuators"), trunk_mass)
        )
        if leg >= LEAST_LEG:
            found.append(Pair((short.key, long.key), leg, volume, drives, trunk))
    return found


def exponent(robots: Sequence[Machine], within: bool) -> Exponent:
    """Fit the exponent of the leg length by least squares of ln(mass of the trunk).

    Args:
        robots: robots of one population.
        within: whether each maker has its own factor; makers of one robot are left out.
    """
    makers = known()
    groups = [makers[robot.key].maker if within else "" for robot in robots]
    used = [i for i, group in enumerate(groups) if groups.count(group) > 1]
    leg = np.log([leg_length(robots[i]) for i in used])
    left = np.log([trunk_mass(robots[i]) for i in used])
    left -= OF_VOLUME * np.log([trunk_volume(robots[i]) for i in used])
    own = np.array([groups[i] for i in used])
    names = sorted(set(own))
    for group in names:
        leg[own == group] -= leg[own == group].mean()
        left[own == group] -= left[own == group].mean()
    value = float(leg @ left / (leg @ leg))
    rest = left - value * leg
    free = len(used) - len(names) - 1
    error = math.sqrt(float(rest @ rest) / free / float(leg @ leg))
    return Exponent(value, error, len(used), len(names))


def main() -> None:
    """Print the exponents, and the pairs that can show what legs alone do."""
    for name in ("quadruped", "humanoid"):
        robots = surveyed(name)
        for words, within in (("all makers together", False), ("within a maker", True)):
            b = exponent(robots, within)
            low, high = b.value - 2 * b.error, b.value + 2 * b.error
            print(f"{name}s, {words}: L^{b.value:.2f}, {low:.2f} to {high:.2f}, {b.n} robots")
        found = pairs(robots)
        print(f"{len(found)} pairs of one maker; on the same drives with much the same trunk:")
        for pair in found:
            if pair.alike:
                print(
                    f"  {' -> '.join(pair.names)}: legs x {pair.leg:.2f}, volume x "
                    f"{pair.volume:.2f}, trunk x {pair.trunk:.2f}: L^{pair.exponent:.1f}"
                )


if __name__ == "__main__":
    main()
