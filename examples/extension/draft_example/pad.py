"""A link primitive: a leg that ends in a round pad.

- name: shank
  type: pad
  joint: {name: knee, axis: y, range: [-2.6, -0.1], actuator: leg}
  link: {axis: -z, length: shank_length, segment: shank}
  pad: {radius: 0.04, thickness: 0.015, site: foot}
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from draft.extend import (
    End,
    Evaluator,
    Fields,
    Geom,
    LinkBase,
    Name,
    Number,
    Value,
    Vector,
    Written,
    primitive,
)


class Pad(Fields):
    """The round sole of a pad link."""

    radius: Number
    """Radius [m]."""
    thickness: Number
    """Thickness [m]. Its underside is at the tip of the link."""
    mass: Number | None = None
    """Mass [kg], part of the segment's. Default: a solid of the density of surveyed feet."""
    site: Name
    """Name of the site under its centre."""


@dataclass(frozen=True, slots=True)
class PadPart(End):
    """A round sole: radius and thickness [m]."""

    key: ClassVar[str] = "pad"

    radius: Value
    thickness: Value

    @classmethod
    def read(cls, written: Written[Pad], link: str, r: Evaluator) -> PadPart:
        """Evaluate the sizes and the mass."""
        stated = written.optional("mass")
        mass = None if stated is None else r.at_least_zero(stated, f"pad mass of {link}")
        radius = r.positive(written.number("radius"), f"pad radius of {link}")
        thickness = r.positive(written.number("thickness"), f"pad thickness of {link}")
        return cls(mass, written.fields.site, radius, thickness)

    @property
    def center(self) -> Vector:
        """Centre of the pad, from the tip of the link [m]."""
        return (0.0, 0.0, self.thickness / 2)

    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Return the pad: a cylinder along z. Boxes and spheres are the other solids."""
        at = (tip[0], tip[1], tip[2] + self.thickness / 2)
        return Geom("_end", "foot", "cylinder", at, (self.radius, self.thickness), mass)


@primitive
class PadLink(LinkBase):
    """A cylinder that ends in a round pad."""

    type: Literal["pad"]
    pad: Pad
    """The pad."""
    end: ClassVar = PadPart
