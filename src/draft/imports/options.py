"""Options of an import."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Literal

from draft.imports.stated import Stated

KneeDrive = Literal["hip", "knee"]


@dataclass(frozen=True, slots=True)
class Options:
    """Decisions that overrule what an import finds by itself.

    Attributes:
        torque: peak torques of joints [N m].
        speed: no-load speeds of joints [rad/s].
        strict: whether an implausible torque refuses the file, instead of being replaced.
        knee_drive: where the knees' drives of a quadruped sit; None to judge by geometry.
        without: keys of surveyed robots that no guess may rest on.
        root: link or body that is the base of what is imported; "" for the file's own.
    """

    torque: Stated = field(default_factory=Stated)
    speed: Stated = field(default_factory=Stated)
    strict: bool = False
    knee_drive: KneeDrive | None = None
    without: Collection[str] = ()
    root: str = ""
