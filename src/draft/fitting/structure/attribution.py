"""Masses of the actuators of a surveyed robot, attributed to the segments that carry them.

The mass of an actuator is that of the mass trend at the declared torque, or that of a unit
disclosed by the maker. Humanoids: half of it on each side of the joint. Quadrupeds: on the segment
that carries the drive, from a table; abduction drives on the trunk. Source: arXiv 2609.38405,
structure survey.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from draft.fitting.structure.robots import disclosed_units, hosts
from draft.laws.joint_roles import priced
from draft.laws.segment_classes import BASE
from draft.laws.survey import LIGHTEST, SHORTEST, Row, usable

# The mass trend of `draft.laws.actuators` in the digits behind the published table. All digits
# would change three published figures, since some structural masses are almost zero.
MASS = (0.065255, 0.6662)


@dataclass(frozen=True, slots=True)
class Piece:
    """A segment with its mass split into actuators and structure.

    Attributes:
        row: the segment.
        actuators: mass of the actuators it carries [kg].
        torque: sum of their peak torques [N m]; of half an actuator, half its torque.
        far: mass of the actuators at its far end, at the next joints [kg].
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
        """Mass without the actuators [kg]; negative if these outweigh the segment."""
        return self.row.mass - self.actuators

    @property
    def centre(self) -> float:
        """Centre of mass of its structure along its length, from 0 at its first joint to 1.

        For a piece that `fits`. Actuators are point masses at its two ends: at the far end a
        humanoid's halves of the actuators of the next joints, at the near end all others. NaN
        where the centre of the segment is unknown.
        """
        return (self.row.mass * self.row.centre - self.far) / self.structure

    @property
    def fits(self) -> bool:
        """Whether it can be a row of a fit: long and heavy enough, with a positive structure."""
        return self.row.mass > LIGHTEST and self.structure > 0.0 and self.row.length > SHORTEST


@dataclass(frozen=True)
class Machine:
    """A surveyed robot with the masses of its actuators.

    Attributes:
        key: key of the robot.
        population: "humanoid" or "quadruped".
        pieces: its segments, root first.
        mass: total mass [kg].
        actuators: mass of all actuators [kg].
    """

    key: str
    population: str
    pieces: tuple[Piece, ...]
    mass: float
    actuators: float

    @property
    def share(self) -> float:
        """Share of the actuators in the mass."""
        return self.actuators / self.mass

    @property
    def remote_knees(self) -> bool:
        """Whether its knees are driven from the hip (quadrupeds)."""
        return self.key in hosts() and hosts()[self.key].remote


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
    """Attribute the actuators of every robot of a table, in its order."""
    by_robot: dict[str, list[Row]] = {}
    for row in rows:
        by_robot.setdefault(row.robot, []).append(row)
    return [machine(own) for own in by_robot.values()]


def machine(rows: Sequence[Row]) -> Machine:
    """Attribute the actuators of one robot to its segments."""
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
        # The base carries the whole actuator of a joint merged into it.
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
