"""The walking robot of one tab: commands, real time, and what limits it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from draft.errors import DraftError
from draft.learn.policy.reduced import AnyPolicy
from draft.learn.policy.validity import fit
from draft.learn.policy.walk import Command, Walk, limiting, on_line, share_of_limit
from draft.model import Model
from draft.values import Array

SKILL = "push"  # The skill that is least disturbed, by pushes as well as by new bodies.
LONGEST = 0.1  # Longest time that one call simulates [s].
# Longest time that one call takes, so that a slow machine keeps quick sliders [s].
BUDGET = 0.01
STEP = (0.1, 0.1, 0.2)  # Change of the command by one key press [m/s, m/s, rad/s].
SIDEWAYS, TURN = 0.4, 1.0  # Largest commands sideways and about the vertical [m/s, rad/s].
_AVERAGED = 200  # Steps over which the speed is averaged.
# Forward command at the start: this share of the largest one, and at most this speed [m/s].
_GENTLE, _EASY = 0.8, 1.0


class Load(NamedTuple):
    """Torque and speed of a joint at the moment of its highest load.

    Attributes:
        joint: name of the joint.
        actuator: name of its actuator class.
        speed: magnitude of its speed [rad/s]; 0 where it brakes, see `walk.on_line`.
        torque: magnitude of its torque [N m]; 0 where it turns beyond the no-load speed.
        share: share of the largest torque at this speed, from 0 to 1.
    """

    joint: str
    actuator: str
    speed: float
    torque: float
    share: float


class Walker:
    """Drives the robot of a tab with the policy that fits it best, while switched on.

    Attributes:
        walk: the simulation; None while it is off or no policy drives the robot.
        message: why the robot does not walk; "" otherwise.
    """

    def __init__(
        self, policies: Sequence[AnyPolicy] = (), clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._policies, self._clock = policies, clock
        self.walk: Walk | None = None
        self.message = ""
        self._on = False
        self._model: Model | None = None
        self._command: Command = (0.0, 0.0, 0.0)
        self._owed = 0.0
        self._speeds: deque[float] = deque(maxlen=_AVERAGED)

    @property
    def on(self) -> bool:
        """Whether walking is switched on."""
        return self._on

    @property
    def command(self) -> Command:
        """Commanded vx, vy [m/s] and wz [rad/s]."""
        return self._command

    @property
    def most(self) -> Command:
        """Largest commands of the policy's training [m/s, m/s, rad/s]."""
        return (self.walk.fit.policy.forward if self.walk else 1.0, SIDEWAYS, TURN)

    @property
    def speed(self) -> float:
        """Mean forward speed of the last second [m/s]."""
        return float(np.mean(self._speeds)) if self._speeds else 0.0

    def start(self, model: Model) -> None:
        """Switch on with a robot, which walks straight ahead."""
        self._on, self._owed = True, 0.0
        self._speeds.clear()
        self._begin(model)
        if self.walk is not None:
            self.steer((min(_GENTLE * self.most[0], _EASY), 0.0, 0.0))

    def stop(self) -> None:
        """Switch off."""
        self._on, self.walk, self._model, self.message = False, None, None, ""

    def follow(self, model: Model) -> None:
        """Replace the body under the running policy where the robot is another one.

        A robot that no policy drives stands, until one is shown that a policy drives.
        """
        if not self._on or model is self._model:
            return
        if self.walk is None:
            self._begin(model)
            return
        self._model = model
        try:
            self.walk.swap(model, fit(model, SKILL, self._policies))
            self.steer(self._command)  # Another policy may have learnt slower commands.
        except DraftError as error:
            self.walk, self.message = None, str(error)

    def steer(self, command: Command) -> None:
        """Command a velocity, within the largest of the policy's training."""
        limited = np.clip(command, np.negative(self.most), self.most)
        vx, vy, wz = (round(float(x), 3) for x in limited)
        self._command = (vx, vy, wz)
        if self.walk is not None:
            self.walk.command = self._command

    def lean(self, forward: float, left: float, turn: float) -> None:
        """Command shares of the largest velocities, from -1 to 1, as a stick does."""
        vx, vy, wz = (
            share * most for share, most in zip((forward, left, turn), self.most, strict=True)
        )
        self.steer((vx, vy, wz))

    def nudge(self, forward: int = 0, left: int = 0, turn: int = 0) -> None:
        """Change the command by some steps, as a key does."""
        moves = (forward, left, turn)
        vx, vy, wz = (c + k * s for c, k, s in zip(self._command, moves, STEP, strict=True))
        self.steer((vx, vy, wz))

    def push(self, size: float, left: bool = True) -> None:
        """Push the robot from one side.

        Args:
            size: velocity that the trunk gains [m/s].
            left: whether to the left; otherwise to the right.
        """
        if self.walk is not None:
            self.walk.push(0.0, size if left else -size)

    def advance(self, seconds: float) -> None:
        """Simulate for the time since the last call [s], within `LONGEST` and `BUDGET`."""
        if self.walk is None:
            return
        self._owed = min(self._owed + seconds, LONGEST)
        timestep = self.walk.model.opt.timestep
        steps = int(self._owed / timestep)
        self._owed -= steps * timestep
        end = self._clock() + BUDGET
        for _ in range(steps):
            if self._clock() > end:
                break
            self.walk.step()
            self._speeds.append(float(self.walk.velocity[0]))

    def place(self) -> Array:
        """Position of the trunk on the floor, shape (3,): the last is 0 [m]."""
        if self.walk is None:
            return np.zeros(3)
        return np.array([*self.walk.data.qpos[:2], 0.0])

    def loads(self) -> list[Load]:
        """Load of every joint, at the moment of the last second in which it was highest."""
        if self.walk is None:
            return []
        torques, speeds = self.walk.loads()
        if not len(torques):
            return []
        shares = share_of_limit(self.walk.fit, torques, speeds)
        speeds, torques = on_line(self.walk.fit, torques, speeds)
        found = []
        joints = self._model.design.joints if self._model is not None else {}
        for j, name in enumerate(self.walk.fit.policy.joints):
            actuator = str(joints[name].actuator)
            at = int(shares[:, j].argmax())
            load = (float(values[at, j]) for values in (speeds, torques, shares))
            found.append(Load(name, actuator, *load))
        return found

    def verdict(self) -> str:
        """Sentence that names what limits the robot."""
        if self.walk is None:
            return ""
        if self.walk.down:
            return "It has fallen, and starts again."
        if not len(self.walk.loads()[0]):
            return "No loads of this motor yet."
        joint, what, share = limiting(self.walk)
        if not what:
            return f"No limit reached; {joint} comes closest, at {100 * share:.0f} %."
        cause = "peak torque" if what == "torque" else "no-load speed"
        return f"{joint} is at the limit of its {cause} for {100 * share:.0f} % of the time."

    def _begin(self, model: Model) -> None:
        self._model = model
        try:
            self.walk, self.message = (
                Walk(model, fit(model, SKILL, self._policies), self._command),
                "",
            )
        except DraftError as error:
            self.walk, self.message = None, str(error)
