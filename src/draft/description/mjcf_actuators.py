"""The torque that an MJCF model grants each joint."""

from __future__ import annotations

from dataclasses import dataclass

from draft.description.mjcf_settings import Defaults
from draft.description.xmlfile import Element


@dataclass(frozen=True, slots=True)
class Limits:
    """Torque limit [N m] by the joint that an actuator drives."""

    by_joint: dict[str, float]

    def of(self, joint: Element, name: str) -> tuple[float | None, float | None]:
        """Effort and velocity limits of a joint; MJCF declares no velocity.

        `actuatorfrcrange` of the joint itself comes first, then its actuator's `forcerange`, then
        a motor's `ctrlrange` times its gear.
        """
        own = joint.some_numbers("actuatorfrcrange")
        if own and joint.attributes.get("actuatorfrclimited", "auto") != "false":
            return max(map(abs, own)), None
        return self.by_joint.get(name), None


def limits_of(root: Element, defaults: Defaults) -> Limits:
    """Read the actuators of a model."""
    table: dict[str, float] = {}
    for section in root.all("actuator"):
        for plain in section.children:
            if plain.tag not in ("motor", "position", "velocity", "general", "intvelocity"):
                continue
            actuator = defaults.fill(plain, "main")
            name = actuator.attributes.get("joint")
            gear = (actuator.some_numbers("gear") or (1.0,))[0]
            force = actuator.some_numbers("forcerange")
            if not force and actuator.tag == "motor":
                force = actuator.some_numbers("ctrlrange")
            if name is not None and force:
                table[name] = max(map(abs, force)) * abs(gear)
    return Limits(table)
