"""Foot link: a sole plate with contact sites."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from draft import geometry as g
from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.field_types import Model, Name, Number
from draft.spec.primitives.base import End, Geom, Written
from draft.spec.primitives.basic import LinkBase
from draft.values import Value


class Plate(Model):
    """The sole of a foot link, with contact sites at its corners and toe."""

    length: Number
    """Size along x [m]."""
    width: Number
    """Size along y [m]."""
    thickness: Number
    """Size along z [m]. Its underside is at the tip of the link."""
    offset: Number = 0.0
    """Forward shift of its centre along x [m]."""
    mass: Number | None = None
    """Mass of the plate [kg], part of the segment's. Default: a solid of the density of surveyed
    feet, at most half of the segment."""
    site: Name
    """Name of the site under its centre. Those of corners and toe add a suffix."""


@dataclass(frozen=True, slots=True)
class PlatePart(End):
    """A sole: full sizes along x, y, z, and forward offset [m]."""

    key: ClassVar[str] = "plate"
    # Left and right of the robot: the same on both feet, so they are not mirrored.
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
        return cls(mass, written.fields.site, (x, y, z), offset)

    def mirrored(self, signs: Vector) -> PlatePart:
        """Return its reflection: the offset is reversed by the mirror x = 0."""
        return replace(self, offset=self.offset * signs[0])

    @property
    def center(self) -> Vector:
        """Centre of the plate, from the tip of the link [m]."""
        return (self.offset, 0.0, self.size[2] / 2)

    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Return the plate at the tip of the link."""
        return Geom("_end", "foot", "box", g.add(tip, self.center), self.size, mass)

    def site_places(self, tip: Vector) -> tuple[Vector, ...]:
        """Places of the sites under its centre, its four corners and its toe [m]."""
        length, width, _ = self.size
        sole = g.add(tip, (self.offset, 0.0, 0.0))
        corners = (
            g.add(tip, (self.offset + sx * length / 2, sy * width / 2, 0.0))
            for sx in (1.0, -1.0)
            for sy in (1.0, -1.0)
        )
        return (sole, *corners, g.add(sole, (length / 2, 0.0, 0.0)))


class FootLink(LinkBase):
    """A cylinder that ends in a plate with contact sites."""

    type: Literal["foot"]
    plate: Plate
    """The plate."""
    end: ClassVar = PlatePart
