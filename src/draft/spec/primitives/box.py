"""Box link: a block that the robot carries, such as a payload, battery, computer or gripper."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

from pydantic import model_validator

from draft import geometry as g
from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.field_types import Model, Name, Number, NumberVector
from draft.spec.primitives.base import (
    MASS_OR_DENSITY,
    Color,
    End,
    Geom,
    Written,
    check_mass_or_density,
    stated_mass,
)
from draft.spec.primitives.basic import LinkBase
from draft.values import Value


class Box(Model):
    """The block of a box link. Its mass is stated, and not part of a segment's structure."""

    model_config = MASS_OR_DENSITY

    size: NumberVector
    """Full sizes along x, y and z of the link [m]."""
    mass: Number | None = None
    """Mass [kg]. State either this or `density`."""
    density: Number | None = None
    """Mass over volume [kg/m3]. State either this or `mass`."""
    shift: NumberVector | None = None
    """Centre of the block, from the tip of the link [m]. Default: at the tip."""
    collides: bool = True
    """Whether it collides with the floor and with objects. It occupies space in either case."""
    site: Name | None = None
    """Name of a site at its centre."""

    @model_validator(mode="after")
    def _one_of_mass_and_density(self) -> Self:
        check_mass_or_density("box", self.mass, self.density)
        return self


@dataclass(frozen=True, slots=True)
class BoxPart(End):
    """A block: full sizes along x, y, z, and shift of its centre from the tip of the link [m]."""

    key: ClassVar[str] = "box"
    of_segment: ClassVar[bool] = False
    colors: ClassVar[dict[str, Color]] = {"carried": (0.36, 0.55, 0.47, 1)}

    size: Vector
    shift: Vector
    collides: bool

    @classmethod
    def read(cls, written: Written[Box], link: str, r: Evaluator) -> BoxPart:
        """Evaluate the sizes, the mass and the shift."""
        x, y, z = (
            r.positive(expression, f"box size along {axis} of {link}")
            for expression, axis in zip(written.triple("size"), "xyz", strict=True)
        )
        mass = stated_mass(written, "box", link, x * y * z, r)
        shift = r.vector(written.triple("shift")) if "shift" in written.numbers else g.ZERO
        return cls(mass, written.fields.site, (x, y, z), shift, written.fields.collides)

    def mirrored(self, signs: Vector) -> BoxPart:
        """Return its reflection: the same block at the mirrored place."""
        return replace(self, shift=g.reflect(self.shift, signs))

    @property
    def center(self) -> Vector:
        """Centre of the block, from the tip of the link [m]."""
        return self.shift

    @property
    def is_foot(self) -> bool:
        """Return False: a robot does not stand on what it carries."""
        return False

    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Return the block."""
        at = g.add(tip, self.shift)
        return Geom("_box", "carried", "box", at, self.size, mass, collides=self.collides)

    def site_places(self, tip: Vector) -> tuple[Vector, ...]:
        """Place of the site at its centre [m]."""
        return (g.add(tip, self.shift),)


class BoxLink(LinkBase):
    """A block of stated size and mass that is carried. A member of the link is structure."""

    type: Literal["box"]
    box: Box
    """The block."""
    end: ClassVar = BoxPart
