"""Sphere link: a sphere at the tip, such as a foot, a hand or a head."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.field_types import Model, Name, Number
from draft.spec.primitives.base import End, Geom, Written
from draft.spec.primitives.basic import LinkBase
from draft.values import Value


class Sphere(Model):
    """The sphere of a sphere link: a foot, a hand, a head."""

    radius: Number
    """Radius [m]."""
    mass: Number | None = None
    """Mass of the sphere [kg], part of the segment's. Default: a solid of the density of surveyed
    feet, at most half of the segment."""
    site: Name | None = None
    """Name of a site at its centre."""


@dataclass(frozen=True, slots=True)
class SpherePart(End):
    """A sphere at the tip of the link: its radius [m]."""

    key: ClassVar[str] = "sphere"

    radius: Value

    @classmethod
    def read(cls, written: Written[Sphere], link: str, r: Evaluator) -> SpherePart:
        """Evaluate the radius and the mass."""
        stated = written.optional("mass")
        mass = None if stated is None else r.at_least_zero(stated, f"end mass of {link}")
        radius = r.positive(written.number("radius"), f"sphere radius of {link}")
        return cls(mass, written.fields.site, radius)

    @property
    def depth(self) -> Value:
        """Depth below the tip of an upright link [m]."""
        return self.radius

    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Return the sphere: a foot if it has a site, else structure, such as a head."""
        kind = "foot" if self.site is not None else "structure"
        return Geom("_end", kind, "sphere", tip, (self.radius,), mass)


class SphereLink(LinkBase):
    """A cylinder that ends in a contact sphere."""

    type: Literal["sphere"]
    sphere: Sphere
    """The sphere."""
    end: ClassVar = SpherePart
