"""Wheel link: a cylinder about the axis of its joint that rolls on the ground."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

from pydantic import model_validator

from draft import geometry as g
from draft.geometry import Vector
from draft.spec.evaluate import Evaluator
from draft.spec.field_types import Axis, Model, Name, Number
from draft.spec.primitives.base import (
    MASS_OR_DENSITY,
    End,
    Geom,
    Written,
    check_mass_or_density,
    stated_mass,
)
from draft.spec.primitives.basic import LinkBase, Transmission
from draft.values import Value

_ENDLESS = "a wheel turns without end: remove it"


class WheelJoint(Model):
    """The joint of a wheel, which turns without end.

    With an actuator it is driven by a servo of its speed, not of its angle.
    """

    absent: ClassVar[Mapping[str, str]] = {
        "range": _ENDLESS,
        "type": _ENDLESS,
        "home": "a wheel is the same at every angle: remove it",
    }

    name: Name
    """Name, after the prefix of the chain."""
    axis: Axis
    """Axis of positive rotation in the link's frame, along that of the wheel."""
    actuator: Name | None = None
    """Actuator class that drives it. Omit it for a passive wheel, such as a caster."""
    transmission: Transmission | None = None
    """Ratio between the actuator and the wheel, and where the actuator is."""


class Wheel(Model):
    """The wheel of a wheel link. Its mass is stated, and not part of a segment's structure."""

    model_config = MASS_OR_DENSITY

    radius: Number
    """Radius [m]."""
    width: Number
    """Width along the axis [m]."""
    axis: Axis
    """Axis of the wheel in the frame of the link, along that of its joint."""
    mass: Number | None = None
    """Mass [kg]. State either this or `density`."""
    density: Number | None = None
    """Mass over volume [kg/m3]. State either this or `mass`."""
    site: Name | None = None
    """Name of a site at its centre. The robot stands on a wheel with a site."""

    @model_validator(mode="after")
    def _one_of_mass_and_density(self) -> Self:
        check_mass_or_density("wheel", self.mass, self.density)
        return self


@dataclass(frozen=True, slots=True)
class WheelPart(End):
    """A wheel: its radius and width [m] and its unit axis."""

    key: ClassVar[str] = "wheel"
    of_segment: ClassVar[bool] = False

    radius: Value
    width: Value
    axis: Vector

    @classmethod
    def read(cls, written: Written[Wheel], link: str, r: Evaluator) -> WheelPart:
        """Evaluate the sizes, the axis and the mass."""
        radius = r.positive(written.number("radius"), f"wheel radius of {link}")
        width = r.positive(written.number("width"), f"wheel width of {link}")
        mass = stated_mass(written, "wheel", link, math.pi * radius * radius * width, r)
        axis = r.axis(written.triple("axis"), f"the wheel of {link}")
        return cls(mass, written.fields.site, radius, width, axis)

    def mirrored(self, signs: Vector) -> WheelPart:
        """Return its reflection: a cylinder about the reflected axis."""
        return replace(self, axis=g.reflect(self.axis, signs))

    @property
    def depth(self) -> Value:
        """Depth below the tip of an upright link [m]."""
        return self.radius

    def geom(self, tip: Vector, mass: Value) -> Geom:
        """Return the cylinder: a foot if it has a site, else structure."""
        kind = "foot" if self.site is not None else "structure"
        return Geom("_end", kind, "cylinder", tip, (self.radius, self.width), mass, self.axis)


class WheelLink(LinkBase):
    """A wheel of stated size and mass, which its joint turns. A member, if any, is structure."""

    type: Literal["wheel"]
    joint: WheelJoint | None = None  # pyright: ignore[reportIncompatibleVariableOverride]
    """Joint at its origin. Without one the wheel is fixed to its parent."""
    wheel: Wheel
    """The wheel."""
    end: ClassVar = WheelPart
