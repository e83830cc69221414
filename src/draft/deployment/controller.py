"""Controller of a policy on a robot, written by Draft: NumPy and `policy.npz` beside it.

README.md says what every number is. Arrays over joints have the order of `Controller.names`.
`controller.hpp` is the same in C++.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
_NOT_FINITE = "a measurement, the command or a target is not finite"
_LATE = "the controller is late, or its clock went back"


@dataclass
class Sensors:
    """What a robot measures.

    Attributes:
        time: when it was measured, by the clock of `Controller.step` [s].
        base_ang_vel: angular velocity of the trunk in its own frame [rad/s], shape (3,).
        projected_gravity: unit vector that points down, in the trunk's frame, shape (3,).
        joint_pos: angles of the joints [rad], shape (joints,).
        joint_vel: speeds of the joints [rad/s], shape (joints,).
        estimated_base_lin_vel: velocity of the trunk in its own frame [m/s], shape (3,), which no
            sensor gives: the robot must estimate it. Only for a policy that observes it.
    """

    time: float
    base_ang_vel: ArrayLike
    projected_gravity: ArrayLike
    joint_pos: ArrayLike
    joint_vel: ArrayLike
    estimated_base_lin_vel: ArrayLike = (np.nan, np.nan, np.nan)


@dataclass
class Command:
    """What a robot is asked to do.

    Attributes:
        time: when it was given, by the clock of `Controller.step` [s].
        velocity: vx, vy [m/s] and wz [rad/s] in the trunk's frame, shape (3,).
    """

    time: float
    velocity: ArrayLike


@dataclass
class Output:
    """What the drives get, each of shape (joints,): tau = kp (angle - q) + kd (speed - dq).

    Attributes:
        angle: target angle [rad].
        speed: target speed [rad/s]; zero for all but driven wheels.
        stiffness: gain kp [N m/rad].
        damping: gain kd [N m s/rad].
        torque_limit: largest torque [N m].
    """

    angle: Array
    speed: Array
    stiffness: Array
    damping: Array
    torque_limit: Array


class Controller:
    """The policy, its limits and its safe stop, which damps the joints until `start` is called.

    Attributes:
        names: names of the joints in the order of all arrays.
        numbers: numbers of the file by name.
        observation: last observation of the policy.
        action: last action of the policy.
        stop: why the joints are damped; "" while the policy acts.
    """

    def __init__(self, file: str | Path | None = None) -> None:
        """Read the numbers of the policy; None for the file beside this one."""
        file = Path(__file__).with_name("policy.npz") if file is None else file
        with np.load(file, allow_pickle=False) as opened:
            self.numbers = {name: opened[name] for name in opened.files}
        n = self.numbers
        self.names: list[str] = n["joint_names"].tolist()
        self.terms: list[str] = n["terms"].tolist()
        self._history: list[int] = n["history"].tolist()
        self._layers = [
            (n[f"weight_{i}"].astype(float), n[f"bias_{i}"].astype(float))
            for i in range(sum(name.startswith("weight_") for name in n))
        ]
        self.observation = np.zeros(len(n["mean"]), np.float32)
        self.start(0.0)

    def start(self, now: float) -> None:
        """Forget the last action and a stop; `step` must follow within the time-out."""
        self.action = np.zeros(len(self.names))
        self.stop, self._first = "", True
        self._trim = np.zeros(5)  # Added to command and gravity.
        self._last = now

    def step(self, sensors: Sensors, command: Command, now: float) -> Output:
        """Let the policy act, once in `control_period`; a stop holds until `start` is called.

        Args:
            sensors: measurements.
            command: a command that is too old, or ahead of the clock, counts as zero, one beyond
                that of the training as its end.
            now: time of a clock that never goes back [s].
        """
        n = self.numbers
        self.stop = self.stop or self._reason(sensors, command, now)
        self._last = now
        if not self.stop:
            asked = np.asarray(command.velocity, float)
            if not abs(now - command.time) <= n["command_timeout"]:
                asked = np.zeros(3)
            asked = np.clip(asked, -n["command"], n["command"])
            self.observation = self._observe(*self._trimmed(sensors, asked))
            self._first = False
            action = self.network(self.observation)
            if np.isfinite(action).all():
                self.action = action
            else:
                self.stop = "the action is not finite"
        return self.output()

    def _trimmed(self, sensors: Sensors, asked: Array) -> tuple[Sensors, Array]:
        """What the policy observes; the velocity that it misses by trims what it observes next."""
        n, now = self.numbers, self._trim
        if "trim_rate" not in n:
            return sensors, asked
        moving = np.append(sensors.estimated_base_lin_vel, sensors.base_ang_vel)[[0, 1, 5]]
        errors = np.append(asked - moving, moving[:2] - asked[:2])
        most, ends = n["trim_most"], np.maximum(n["trim_ends"], np.abs(asked))
        self._trim = np.clip(now + n["trim_rate"] * n["control_period"] * errors, -most, most)
        gravity = np.add(sensors.projected_gravity, np.append(now[3:], 0.0))
        return replace(sensors, projected_gravity=gravity), np.clip(asked + now[:3], -ends, ends)

    def output(self) -> Output:
        """Targets and gains of the last action, or those of a stop: damping alone."""
        n = self.numbers
        zero, limit = np.zeros(len(self.names)), n["peak_torque"]
        if self.stop:
            return Output(zero, zero, zero, n["stop_damping"], limit)
        offset = n["sign"] * n["action_scale"] * self.action
        speed = np.where(n["rolls"], offset, 0.0)
        return Output(n["home"] + offset, speed, n["stiffness"], n["damping"], limit)

    def hold(self, angle: ArrayLike, share: float) -> Output:
        """Targets on the way from some angles (share 0) to the home pose (share 1)."""
        n, zero = self.numbers, np.zeros(len(self.names))
        target = (1.0 - share) * np.asarray(angle, float) + share * n["home"]
        return Output(target, zero, n["stiffness"], n["damping"], n["peak_torque"])

    def torque(self, out: Output, angle: ArrayLike, speed: ArrayLike, now: float) -> Array:
        """Torques at the joints [N m] between two steps, within the lines of the motors.

        For drives without a controller of their own: call it at least every `timestep`. It stops
        if `step` was not called in time, or a target, an angle or a speed is not finite; the joint
        of that angle or speed gets none.
        """
        n = self.numbers
        q, dq = np.asarray(angle, float), np.asarray(speed, float)
        if not self.stop and not abs(now - self._last) <= n["timeout"]:
            self.stop = _LATE
        wanted = _drive(self.output() if self.stop else out, q, dq)
        if not np.isfinite(wanted).all():
            self.stop = self.stop or _NOT_FINITE
            wanted = _drive(self.output(), q, dq)
        finite = np.isfinite(wanted)
        dq = np.where(finite, dq, 0.0)
        # The torque of a motor falls with its speed; beyond the no-load speed it brakes.
        peak, stall = n["peak_torque"], n["stall_torque"]
        ends = 1.0 + peak / stall
        share = np.clip(dq / n["no_load_speed"], -ends, ends)
        least, most = stall * (-1.0 - share), stall * (1.0 - share)
        least, most = np.maximum(-peak, least), np.minimum(peak, most)
        return np.clip(np.where(finite, wanted, 0.0), least, most)

    def network(self, observation: NDArray[np.float32]) -> Array:
        """Action of an observation, in double precision."""
        n = self.numbers
        x = (observation.astype(float) - n["mean"]) / n["divisor"]
        for i, (weight, bias) in enumerate(self._layers):
            x = weight @ x + bias
            if i + 1 < len(self._layers):
                x = np.where(x > 0, x, np.expm1(np.minimum(x, 0.0)))
        return x

    def _observe(self, sensors: Sensors, command: Array) -> NDArray[np.float32]:
        n = self.numbers
        angles = n["sign"] * (np.asarray(sensors.joint_pos, float) - n["home"])
        parts = {
            "base_lin_vel": sensors.estimated_base_lin_vel,
            "base_ang_vel": sensors.base_ang_vel,
            "projected_gravity": sensors.projected_gravity,
            "joint_pos": angles[~n["rolls"]],
            "joint_vel": n["sign"] * np.asarray(sensors.joint_vel, float),
            "actions": self.action,
            "command": command,
            "design": n["design"],
        }
        found, at = [], 0
        for name, count in zip(self.terms, self._history, strict=True):
            now = np.asarray(parts[name], np.float32)
            end = at + count * len(now)
            # Past steps of a term come first, the oldest before; at the start there are none.
            past = self.observation[at + len(now) : end]
            found += [np.tile(now, count - 1) if self._first else past, now]
            at = end
        return np.concatenate(found)

    def _reason(self, sensors: Sensors, command: Command, now: float) -> str:
        """Why the robot must stop; "" if it need not."""
        n = self.numbers
        q, dq, down, turning, asked = (
            np.asarray(one, float)
            for one in (
                *(sensors.joint_pos, sensors.joint_vel, sensors.projected_gravity),
                *(sensors.base_ang_vel, command.velocity),
            )
        )
        measured = [q, dq, down, turning, asked, [sensors.time, command.time, now]]
        if "base_lin_vel" in self.terms:
            measured.append(sensors.estimated_base_lin_vel)
        if not all(np.isfinite(one).all() for one in measured):
            return _NOT_FINITE
        if abs(now - self._last) > n["timeout"]:
            return _LATE
        if abs(now - sensors.time) > n["timeout"]:
            return "the measurements are old, or ahead of the clock"
        length = float(np.linalg.norm(down))
        if abs(length - 1.0) > n["gravity_error"]:
            return "gravity is no unit vector"
        if -down[2] / length < np.cos(n["tilt"]):
            return "the trunk is tilted"
        beyond = (q < n["low"] - n["margin"]) | (q > n["high"] + n["margin"])
        if (beyond & ~n["rolls"]).any():
            return "a joint is out of its range"
        if (np.abs(dq) > n["speed_limit"]).any():
            return "a joint is too fast"
        return ""


def _drive(out: Output, angle: Array, speed: Array) -> Array:
    """Torques of targets and gains, not finite where one of them or a measurement is not."""
    with np.errstate(invalid="ignore", over="ignore"):
        return out.stiffness * (out.angle - angle) + out.damping * (out.speed - speed)


def gravity(quaternion: ArrayLike) -> Array:
    """Projected gravity of an orientation (w, x, y, z) of the trunk in the world, shape (3,)."""
    w, x, y, z = np.asarray(quaternion, float) / np.linalg.norm(quaternion)
    return np.array([2 * (w * y - x * z), -2 * (w * x + y * z), 2 * (x * x + y * y) - 1])
