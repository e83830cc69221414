"""Torques and speeds that a person states for an import: `17`, or `hip=20 knee=30`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from draft.errors import DraftError, suggest
from draft.laws import joint_roles as roles


@dataclass(frozen=True, slots=True)
class Stated:
    """Values for joints, by name.

    A name is that of a joint, a role such as "knee", or words that joints' names share, such as
    "hip_roll". The most specific name holds.

    Attributes:
        every: value of the joints whose file gives no usable one; None for none.
        named: value by name, whatever the file says.
    """

    every: float | None = None
    named: Mapping[str, float] = field(default_factory=dict)

    def key(self, joint: str, role: str = "") -> str | None:
        """Name that means a joint, None for none."""
        if joint in self.named:
            return joint
        words = roles.words(joint)
        found = [name for name in self.named if roles.words(name) and roles.words(name) <= words]
        if found:
            return max(found, key=lambda name: len(roles.words(name)))
        return role if role in self.named else None

    def value(self, joint: str, role: str = "") -> float | None:
        """Value stated for a joint by name."""
        key = self.key(joint, role)
        return None if key is None else self.named[key]

    def check(self, joints: Mapping[str, str], option: str) -> None:
        """Refuse names that mean no joint.

        Args:
            joints: role by the name of every driven joint.
            option: option that states them, for the message.

        Raises:
            DraftError: a name that no joint has.
        """
        used = {self.key(joint, role) for joint, role in joints.items()}
        for name in self.named:
            if name not in used:
                known = [*dict.fromkeys(role for role in joints.values() if role), *joints]
                cause = f"{option} {name}=... means no driven joint"
                remedy = suggest(name, known, "roles and joints")
                raise DraftError(cause, remedy)


def parse(values: Sequence[str] | Iterable[str], option: str, unit: str) -> Stated:
    """Read `17` or `NAME=VALUE` items.

    Raises:
        DraftError: an item that is neither, or a value that is not above 0.
    """
    every: float | None = None
    named: dict[str, float] = {}
    for item in values:
        name, _, text = item.rpartition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > 0) or (not name and "=" in item):
            cause = f"{option} '{item}' is neither a number above 0 nor NAME=NUMBER"
            remedy = f"such as {option} 17, or {option} NAME=20 of a role or a joint, in {unit}"
            raise DraftError(cause, remedy)
        if name:
            named[name] = value
        elif every is not None:
            cause = f"{option} has two numbers without a name, {every:g} and {value:g}"
            raise DraftError(cause, f"one of them, or {option} NAME=NUMBER")
        else:
            every = value
    return Stated(every, named)
