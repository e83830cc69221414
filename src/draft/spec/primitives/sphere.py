"""The sphere at the end of a link: a foot, a hand, a head."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.primitives.base import End, Geom, Written
from draft.spec.primitives.basic import LinkBase
from draft.spec.words import Model, Name, Number
from draft.values import Value


class Sphere(Model):
    """The sphere at the end of a sphere link: a foot, a hand, a head."""

    radius: Number
    """Radius [m]."""
    mass: Number | None = None
    """Mass [kg] that the sphere takes of the segment's. Default: a solid as dense as
    surveyed feet, and at most half of the segment."""
    site: Name | None = None
    """Name of a site at its centre."""


@dataclass(frozen=True, slots=True)
class SpherePart(End):
    """A sphere at the link's tip: its radius [m]."""

    key: ClassVar[str] = "sphere"

    radius: Value

    @classmethod
    def read(cls, written: Written[Sphere], link: str, r: Evaluator) -> SpherePart:
        """Evaluate the radius and the mass."""
        stated = written.optional("mass")
        mass = None if stated is None else r.at_least_zero(stated, f"end mass of {link}")
        radius = r.positive(written.number("radius"), f"sphere radius of {link}")
        return cls(mass, written.words.site, radius)

    @property
    def depth(self) -> Value:
        """How far it reaches below the link's tip [m]."""
        return self.radius

    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Give the sphere. Without a site, such as a head, it is not there to touch the ground."""
        kind = "foot" if self.site is not None else "structure"
        return Geom("_end", kind, "sphere", tip, (self.radius,), mass)


class SphereLink(LinkBase):
    """A cylinder that ends in a contact sphere."""

    type: Literal["sphere"]
    sphere: Sphere
    """The sphere."""
    end: ClassVar = SpherePart
