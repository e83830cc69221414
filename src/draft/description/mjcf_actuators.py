"""Drives of an MJCF model: which joints have one, and the torque that it grants each."""

from __future__ import annotations

import math
from dataclasses import dataclass

from draft.description.mjcf_settings import ACTUATORS, Defaults
from draft.description.xmlfile import Element


@dataclass(frozen=True, slots=True)
class Drives:
    """Torque limit [N m or N] by the joint that an actuator drives; NaN where none is given."""

    by_joint: dict[str, float]

    def drives(self, joint: str) -> bool:
        """Whether an actuator may drive a joint: in a model without any, one may drive each."""
        return not self.by_joint or joint in self.by_joint

    def effort(self, joint: Element, name: str) -> float | None:
        """Effort limit of a joint [N m or N]; None without a drive, infinite without a limit.

        `actuatorfrcrange` of the joint itself comes first, then its actuator's `forcerange`, then
        what its controls can ask for: `ctrlrange` times gain and gear.
        """
        own = joint.some_numbers("actuatorfrcrange")
        if own and joint.attributes.get("actuatorfrclimited", "auto") != "false":
            return max(map(abs, own))
        limit = self.by_joint.get(name)
        return math.inf if limit is not None and math.isnan(limit) else limit


def drives_of(root: Element, defaults: Defaults) -> Drives:
    """Read the actuators of a model."""
    table: dict[str, float] = {}
    for section in root.all("actuator"):
        for plain in section.children:
            if plain.tag not in ACTUATORS:
                continue
            actuator = defaults.fill(plain, "main")
            given = actuator.attributes
            name = given.get("joint", given.get("jointinparent"))
            if name is not None:
                table[name] = _force(actuator) * abs((actuator.some_numbers("gear") or (1.0,))[0])
    return Drives(table)


def _force(actuator: Element) -> float:
    """Largest force before the gear; NaN where the model does not limit it."""
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
