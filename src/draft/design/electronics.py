"""Power that a design draws without moving: computers, sensors and idle drives."""

from __future__ import annotations

from dataclasses import dataclass

from draft.design.bands import Band
from draft.design.design import Design
from draft.laws.law import Law
from draft.laws.limits import limits
from draft.values import Value


@dataclass(frozen=True, slots=True)
class Electronics:
    """Computers, sensors and idle drives.

    Attributes:
        power: power [W].
        law: the law of the power; None if it is stated.
    """

    power: Value
    law: Law | None

    @property
    def band(self) -> Band:
        """Ends of the 90 % band of the power [W]; the power twice if it is stated."""
        fold = 1.0 if self.law is None else self.law.band(0.9)
        return Band(self.power / fold, self.power * fold)


def electronics(design: Design) -> Electronics:
    """Electronics of a design: as stated, or usual for its mass without the payload."""
    if design.electronics_stated is not None:
        return Electronics(design.electronics_stated, None)
    return usual_electronics(design.mass - design.payload_mass)


def usual_electronics(mass: Value) -> Electronics:
    """Electronics that are usual for a robot.

    Args:
        mass: mass of the robot without payload [kg].
    """
    law = limits().electronics_power
    return Electronics(law(mass), law)
