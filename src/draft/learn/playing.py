"""What is said of a policy that is watched, and what a camera asks of whoever plays it."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.learn.quadruped import Quadruped

Command = tuple[float, float, float]
SETTLING = 1.0  # What a robot does first, put down at rest, says little of how it walks [s].


@dataclass(frozen=True)
class Outcome:
    """What happened while a policy was played.

    Attributes:
        seconds: for how long.
        robots: how many.
        command: what was asked for: vx, vy [m/s], wz [rad/s].
        speed: mean forward speed, after the first second [m/s].
        error: mean of |v_xy - command|, after the first second [m/s].
        falls: number of falls; who falls starts anew.
    """

    seconds: float
    robots: int
    command: Command
    speed: float
    error: float
    falls: int


class Player(Protocol):
    """A policy at work that can be filmed."""

    @property
    def member(self) -> Quadruped:
        """The design."""
        ...

    @property
    def period(self) -> float:
        """Time between two actions [s]."""
        ...

    @property
    def command(self) -> Command:
        """What is asked for: vx, vy [m/s], wz [rad/s]."""
        ...

    def scene(self) -> tuple[mujoco.MjModel, str]:
        """The model, dressed by `draft.learn.scenery`, and what stands before the robot's names."""
        ...

    def poses(self) -> NDArray[np.float64]:
        """Positions `qpos` of each robot at this moment, shape (robots, nq)."""
        ...

    def steps(self, seconds: float) -> int:
        """Actions in a time."""
        ...

    def play(self, seconds: float, tell: Callable[[int], None]) -> Outcome:
        """Let the policy act, and call `tell` with the number of actions done, from 0 on."""
        ...
