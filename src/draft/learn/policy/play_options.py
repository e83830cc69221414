"""Options of showing what a policy can do, for Python and the command."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from draft.settings import Settings, Shown

FASTEST, TALLEST = 100.0, 0.6  # Largest command or kick [m/s]; height of steps [m].
_Speed = Annotated[float, Field(ge=-FASTEST, le=FASTEST)]
Command = tuple[_Speed, _Speed, _Speed]


class Course(Settings):
    """What a robot is asked to do; None for what suits the skill."""

    command: Annotated[
        Command | None,
        Shown(
            "VX VY WZ",
            "straight ahead, as fast as suits the policy",
            expects=f"three numbers from {-FASTEST:g} to {FASTEST:g}",
        ),
    ] = None
    """Commanded velocity [m/s, m/s, rad/s]."""
    step: Annotated[
        float | None,
        Field(ge=0, le=TALLEST),
        Shown("M", "0.1 for climb, else no steps", unit="m"),
    ] = None
    """Height of the steps ahead [m]; for designs."""
    kick: Annotated[
        float | None,
        Field(ge=0, le=FASTEST),
        Shown("M/S", "2 for push, else no kicks", unit="m/s"),
    ] = None
    """Largest kick along x and y, every few seconds [m/s]; for designs."""


class PlaySettings(Course):
    """Settings of a playback."""

    seconds: Annotated[float, Field(gt=0, le=600), Shown("S", unit="s")] = 8.0
    """Duration [s]."""
    seed: Annotated[int, Field(ge=0), Shown("N")] = 0
    """Seed of kicks and of joint offsets at the start."""
