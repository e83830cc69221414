"""What the actuators of a surveyed robot weigh, and which segments carry them.

The mass trend is read at the declared torque, taken at face value; a maker's disclosed units go
before it. Humanoids: half to each side of the joint. Quadrupeds: to the segment that carries the
drive, by a table; abduction drives to the trunk. Source: arXiv 2609.38405, structure survey.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from draft.fitting.structure.classes import BASE
from draft.fitting.structure.robots import disclosed_units, hosts
from draft.fitting.structure.roles import priced
from draft.fitting.structure.rows import LIGHTEST, SHORTEST, Row

STRONGEST = 1000.0
# The mass trend of `draft.laws.actuators` in the digits that the published table was made with;
# all its digits would move two printed ones, because some remainders are almost nothing.
MASS = (0.065255, 0.6662)


@dataclass(frozen=True, slots=True)
class Piece:
    """A segment and what of it is structure.

    Attributes:
        row: the segment.
        actuators: mass of the actuators it carries [kg].
        torque: sum of their peak torques, halves counted as halves [N m].
        far: mass of those among them that sit at its far end, at the next joints [kg].
    """

    row: Row
    actuators: float
    torque: float
    far: float = 0.0

    @property
    def kind(self) -> str:
        """Class of the segment."""
        return self.row.kind

    @property
    def structure(self) -> float:
        """Mass that is not actuators [kg]; not positive where the prices exceed the segment."""
        return self.row.mass - self.actuators

    @property
    def centre(self) -> float:
        """Where its structure balances along its length, from 0 at its first joint to 1.

        Of a piece that `fits`. Actuators count as points at its two ends: at the far one a
        humanoid's halves of the next joints' drives, all others at the near one. NaN where no
        centre of the segment is known.
        """
        return (self.row.mass * self.row.centre - self.far) / self.structure

    @property
    def fits(self) -> bool:
        """Whether it can be a row of a fit."""
        return self.row.mass > LIGHTEST and self.structure > 0.0 and self.row.length > SHORTEST


@dataclass(frozen=True)
class Machine:
    """A surveyed robot, taken apart.

    Attributes:
        key, population: which robot.
        pieces: its segments, root first.
        mass: total mass [kg].
        actuators: mass of all priced actuators [kg].
    """

    key: str
    population: str
    pieces: tuple[Piece, ...]
    mass: float
    actuators: float

    @property
    def share(self) -> float:
        """The actuators' share of the mass."""
        return self.actuators / self.mass

    @property
    def remote_knees(self) -> bool:
        """Whether its knees are driven from the hip (quadrupeds)."""
        return self.key in hosts() and hosts()[self.key].remote


def usable(effort: float) -> bool:
    """Whether a declared torque [N m] can be priced: finite, above 0, at most 1000."""
    return math.isfinite(effort) and 0.0 < effort <= STRONGEST


def price(robot: str, effort: float) -> float:
    """Mass [kg] of the actuator behind a declared torque [N m].

    The trend's value, or the lightest disclosed unit that gives the torque.
    """
    for torque, mass in disclosed_units().get(robot, ()):
        if torque >= effort:
            return mass
    coefficient, exponent = MASS
    return coefficient * effort**exponent


def machines(rows: Sequence[Row]) -> list[Machine]:
    """Take every robot of a table apart, in the table's order."""
    by_robot: dict[str, list[Row]] = {}
    for row in rows:
        by_robot.setdefault(row.robot, []).append(row)
    return [machine(own) for own in by_robot.values()]


def machine(rows: Sequence[Row]) -> Machine:
    """Price one robot's actuators and charge them to its segments."""
    by_name = {row.segment: row for row in rows}
    carried = {row.segment: [0.0, 0.0, 0.0] for row in rows}
    total = 0.0
    for row in rows:
        for role, effort in zip(row.roles, row.efforts, strict=True):
            if not priced(role or None) or not usable(effort):
                continue
            mass = price(row.robot, effort)
            total += mass
            for name, share in _carriers(row, role, by_name):
                carried[name][0] += share * mass
                carried[name][1] += share * effort
                if row.population == "humanoid" and name == row.parent:
                    carried[name][2] += share * mass
    return Machine(
        key=rows[0].robot,
        population=rows[0].population,
        pieces=tuple(Piece(row, *carried[row.segment]) for row in rows),
        mass=math.fsum(row.mass for row in rows),
        actuators=total,
    )


def _carriers(row: Row, role: str, by_name: dict[str, Row]) -> list[tuple[str, float]]:
    """Segments that carry the actuator of a joint, and their shares of it."""
    if row.population == "humanoid":
        # A joint merged into the base charges the base in full.
        sides = [row.segment, row.parent] if row.parent else [row.segment]
        return [(name, 1.0 / len(sides)) for name in sides]
    table = hosts().get(row.robot)
    if role == "abduction" or table is None:
        wanted = BASE if role == "abduction" else row.kind
    else:
        wanted = table.hip_pitch if role == "flexion" else table.knee
    while row.parent and row.kind != wanted:
        row = by_name[row.parent]
    return [(row.segment, 1.0)]
