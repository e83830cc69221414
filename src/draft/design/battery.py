"""The battery of a design, and its place in the mass of the trunk.

The surveyed trunks were weighed with their batteries, so the trend of the trunk's mass includes a
battery of the usual share of the robot's mass. Without a stated battery nothing is added. A stated
one replaces the usual one: the trunk's mass changes by the difference. A trunk of stated density
keeps it, with whatever battery it holds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from draft.design.bands import Band
from draft.design.cached import once
from draft.design.design import Design
from draft.laws.law import Law
from draft.laws.limits import limits
from draft.spec.primitives.root import TrunkPart
from draft.values import Value, maximum


@dataclass(frozen=True, slots=True)
class Battery:
    """A battery.

    Attributes:
        energy: its energy [Wh].
        mass: its mass [kg], part of the trunk's.
        law: the law of its energy; None if that is stated.
    """

    energy: Value
    mass: Value
    law: Law | None

    @property
    def band(self) -> Band:
        """Ends of the 90 % band of its energy [Wh]; its energy twice if that is stated."""
        fold = 1.0 if self.law is None else self.law.band(0.9)
        return Band(self.energy / fold, self.energy * fold)


@once
def battery(design: Design) -> Battery:
    """Battery of a design: as stated, or usual for the mass of the robot without its payload."""
    laws, stated = limits(), design.battery_stated
    if not stated:
        return usual(design.mass - design.payload_mass)
    if "energy" not in stated:
        mass = stated["mass"]
        return Battery(laws.specific_energy(mass), mass, laws.specific_energy)
    return Battery(stated["energy"], _stated_mass(design), None)


def usual(mass: Value) -> Battery:
    """Battery of the usual share of a robot.

    Args:
        mass: mass of the robot without payload [kg].
    """
    laws = limits()
    return Battery(laws.energy_share(mass), laws.battery_share(mass), laws.energy_share)


def _stated_mass(design: Design) -> Value:
    """Mass of the stated battery [kg], from its energy if need be."""
    stated = design.battery_stated
    if "mass" in stated:
        return stated["mass"]
    return stated["energy"] / limits().specific_energy.coefficient


def trunk_with_battery(design: Design, trunk: TrunkPart) -> TrunkPart:
    """Trunk in which a stated battery replaces the usual one; at least as heavy as the battery.

    Args:
        design: the design.
        trunk: its trunk as the trend or a stated density gives it.
    """
    if not design.battery_stated or trunk.density_stated:
        return trunk
    stated = _stated_mass(design)
    usual = limits().battery_share(design.mass - design.payload_mass)
    mass = maximum(trunk.mass + stated - usual, stated)
    return replace(trunk, mass=mass, density=trunk.density * (mass / trunk.mass))
