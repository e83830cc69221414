"""The sole of a foot: a plate with contact sites."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from draft import geometry as g
from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.primitives.base import End, Geom, Written
from draft.spec.primitives.basic import LinkBase
from draft.spec.words import Model, Name, Number
from draft.values import Value


class Plate(Model):
    """The sole of a foot link, with contact sites at its corners and toe."""

    length: Number
    """Size along x [m]."""
    width: Number
    """Size along y [m]."""
    thickness: Number
    """Size along z [m]; its underside lies at the link's tip."""
    offset: Number = 0.0
    """Shift of its centre forward along x [m]."""
    mass: Number | None = None
    """Mass [kg] that the plate takes of the segment's. Default: a solid as dense as
    surveyed feet, and at most half of the segment."""
    site: Name
    """Name of the site under its centre; corners and toe add a suffix."""


@dataclass(frozen=True, slots=True)
class PlatePart(End):
    """A sole: full sizes along x, y, z and forward offset [m]."""

    key: ClassVar[str] = "plate"
    # Left and right are the robot's: the same on both feet, and so not mirrored.
    sites: ClassVar[tuple[str, ...]] = (
        *("", "_front_left", "_front_right", "_rear_left", "_rear_right", "_toe"),
    )

    size: Vector
    offset: Value

    @classmethod
    def read(cls, written: Written[Plate], link: str, r: Evaluator) -> PlatePart:
        """Evaluate the sizes, the offset and the mass."""
        stated = written.optional("mass")
        mass = None if stated is None else r.at_least_zero(stated, f"end mass of {link}")
        x, y, z = (
            r.positive(written.number(side), f"plate {side} of {link}")
            for side in ("length", "width", "thickness")
        )
        offset = r.number(written.number("offset"), f"plate offset of {link}")
        return cls(mass, written.words.site, (x, y, z), offset)

    def mirrored(self, signs: Vector) -> PlatePart:
        """Give its reflection: it points backwards in a mirror x = 0."""
        return replace(self, offset=self.offset * signs[0])

    @property
    def center(self) -> Vector:
        """Its centre from the link's tip [m]."""
        return (self.offset, 0.0, self.size[2] / 2)

    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Give the plate, on the link's tip."""
        return Geom("_end", "foot", "box", g.add(tip, self.center), self.size, mass)

    def site_places(self, tip: Vector) -> tuple[Vector, ...]:
        """Places under its centre, its four corners and its toe [m]."""
        length, width, _ = self.size
        sole = g.add(tip, (self.offset, 0.0, 0.0))
        corners = (
            g.add(tip, (self.offset + sx * length / 2, sy * width / 2, 0.0))
            for sx in (1.0, -1.0)
            for sy in (1.0, -1.0)
        )
        return (sole, *corners, g.add(sole, (length / 2, 0.0, 0.0)))


class FootLink(LinkBase):
    """A shank end that carries a plate with contact sites."""

    type: Literal["foot"]
    plate: Plate
    """The plate."""
    end: ClassVar = PlatePart
