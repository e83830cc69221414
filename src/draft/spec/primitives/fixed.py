"""The fixed base: root of a tree that is bolted to the world, with an optional pedestal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Self

from pydantic import Field, model_validator

from draft import geometry as g
from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.field_types import Model, Name, Number, NumberVector, broken_rule
from draft.spec.primitives.base import End, Form, Geom, Written
from draft.values import Value, some

if TYPE_CHECKING:
    from draft.spec.schema import Node


class Pedestal(Model):
    """The solid of a fixed base, a box or a cylinder along z, which stands on the base's origin."""

    size: NumberVector | None = None
    """Full sizes of a box along x, y and z of the base [m]."""
    radius: Number | None = None
    """Radius of a cylinder [m]."""
    height: Number | None = None
    """Height of a cylinder [m]."""
    shift: NumberVector | None = None
    """Middle of its lower face, from the base's origin [m]. Default: at the origin."""
    mass: Number = 0.0
    """Mass [kg]. It counts in the mass of the robot, and moves nothing."""

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        cylinder = (self.radius is not None, self.height is not None)
        if cylinder not in ((True, True), (False, False)) or any(cylinder) == bool(self.size):
            remedy = "give 'size: [x, y, z]' of a box, or 'radius: ...' and 'height: ...' [m]"
            raise broken_rule("a pedestal is either a box or a cylinder", remedy)
        return self


class FixedBase(Model):
    """A base that is bolted to the world, as of an arm or a hand.

    Such a robot has no root.yaml, no feet, and no trunk with a battery or a payload.
    """

    name: Name = "base"
    """Name of the body."""
    type: Literal["fixed"]
    at: NumberVector | None = None
    """Origin in the world, whose floor is at z = 0 [m]. Default: on the floor."""
    rpy: NumberVector | None = None
    """Roll, pitch, yaw in the world [rad], as of a base on a wall or under a ceiling."""
    pedestal: Pedestal | None = None
    """Its solid. Default: none; the base then has no mass."""
    children: list[Node] = Field([])
    """Links attached to it."""


@dataclass(frozen=True, slots=True)
class PedestalPart(End):
    """A pedestal: full sizes of a box, or radius and height of a cylinder, and its shift [m]."""

    key: ClassVar[str] = "pedestal"
    of_segment: ClassVar[bool] = False

    form: Form
    size: tuple[Value, ...]
    shift: Vector = g.ZERO

    @classmethod
    def read(cls, written: Written[Pedestal], link: str, r: Evaluator) -> PedestalPart:
        """Evaluate the sizes and the mass."""
        mass = r.at_least_zero(written.number("mass"), f"mass of the pedestal of {link}")
        form: Form = "box" if "size" in written.numbers else "cylinder"
        keys = ("radius", "height") if form == "cylinder" else ("size",) * 3
        numbers = written.triple("size") if form == "box" else (written.number(key) for key in keys)
        size = tuple(
            r.positive(number, f"{key} of the pedestal of {link}")
            for key, number in zip(keys, numbers, strict=True)
        )
        shift = r.vector(written.triple("shift")) if "shift" in written.numbers else g.ZERO
        return cls(mass, None, form, size, shift)

    @property
    def center(self) -> Vector:
        """Centre of the pedestal, from the base's origin [m]."""
        return g.add(self.shift, (0.0, 0.0, self.size[-1] / 2))

    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Return the pedestal, in the colour of a trunk."""
        weight = mass if some(mass > 0) else None
        return Geom("_pedestal", "trunk", self.form, g.add(tip, self.center), self.size, weight)
