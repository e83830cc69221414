"""Actuators of an MJCF model: the joints that they drive, and their torque limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

from draft.description.mjcf_settings import ACTUATORS, Defaults
from draft.description.xmlfile import Element


@dataclass(frozen=True, slots=True)
class Drives:
    """Torque limits of actuators [N m or N] by joint, and by tendon; NaN without a limit."""

    by_joint: dict[str, float]
    by_tendon: dict[str, float]

    def drives(self, joint: str) -> bool:
        """Whether a joint may have an actuator; in a model without actuators every joint may."""
        return not (self.by_joint or self.by_tendon) or joint in self.by_joint

    @property
    def pulls(self) -> dict[str, float]:
        """Torque limits by tendon, infinite without a limit."""
        return {
            name: math.inf if math.isnan(force) else force for name, force in self.by_tendon.items()
        }

    def effort(self, joint: Element, name: str) -> float | None:
        """Effort limit of a joint [N m or N]; None without an actuator, infinite without a limit.

        The limit is `actuatorfrcrange` of the joint, else `forcerange` of its actuator, else the
        largest command: `ctrlrange` times gain and gear.
        """
        own = joint.some_numbers("actuatorfrcrange")
        if own and joint.attributes.get("actuatorfrclimited", "auto") != "false":
            return max(map(abs, own))
        limit = self.by_joint.get(name)
        return math.inf if limit is not None and math.isnan(limit) else limit


def drives_of(root: Element, defaults: Defaults) -> Drives:
    """Read the actuators of a model."""
    table: dict[str, float] = {}
    tendons: dict[str, float] = {}
    for section in root.all("actuator"):
        for plain in section.children:
            if plain.tag not in ACTUATORS:
                continue
            actuator = defaults.fill(plain, "main")
            given = actuator.attributes
            name = given.get("joint", given.get("jointinparent"))
            tendon = given.get("tendon")
            force = _force(actuator) * abs((actuator.some_numbers("gear") or (1.0,))[0])
            if name is not None:
                table[name] = force
            elif tendon is not None:
                tendons[tendon] = force
    return Drives(table, tendons)


def _force(actuator: Element) -> float:
    """Largest force before the gear [N m or N]; NaN without a limit."""
    given = actuator.attributes
    force = actuator.some_numbers("forcerange")
    if force and given.get("forcelimited", "auto") != "false":
        return max(map(abs, force))
    control = actuator.some_numbers("ctrlrange")
    if control and given.get("ctrllimited", "auto") != "false":
        if actuator.tag == "motor":
            return max(map(abs, control))
        if actuator.tag == "general" and given.get("biastype", "none") == "none":
            gain = (actuator.some_numbers("gainprm") or (1.0,))[0]
            return max(map(abs, control)) * abs(gain)
    return math.nan
