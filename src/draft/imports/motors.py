"""Actuator classes of a vendor's robot: one for each pair of torque and speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from draft.imports.drives import GUESSED, Drive
from draft.imports.names import Unique
from draft.imports.reduce import Body
from draft.laws.actuators import laws
from draft.laws.catalogue import MODULE, SERVO, catalogue


@dataclass(frozen=True, slots=True)
class Motor:
    """One actuator class.

    Attributes:
        name: its name in the spec.
        torque, speed: peak torque [N m] and no-load speed [rad/s].
        joints: the vendor's names of the hinges that it drives.
        torque_from, speed_from: see `Drive`.
        kind: family of actuators, "module" or "servo".
    """

    name: str
    torque: float
    speed: float
    joints: tuple[str, ...]
    torque_from: str
    speed_from: str
    kind: str = MODULE

    @property
    def guessed(self) -> bool:
        """Whether its torque is that of surveyed joints."""
        return self.torque_from in GUESSED


def motors(bodies: Sequence[Body], drives: Mapping[str, Drive], taken: Unique) -> list[Motor]:
    """Group joints by torque, speed and where these are from, strongest first."""
    groups: dict[tuple[float, float, str, str], list[Body]] = {}
    for body in bodies:
        if body.joint is None or not body.driven:
            continue
        own = drives[body.joint.name]
        key = (own.torque, own.speed, own.torque_from, own.speed_from)
        groups.setdefault(key, []).append(body)
    found: list[Motor] = []
    for (torque, speed, *sources), own in sorted(groups.items(), key=lambda item: -item[0][0]):
        roles = list(dict.fromkeys(body.role for body in own if body.role))
        names = tuple(body.joint.name for body in own if body.joint)
        word = "_".join(roles[:2]) if 0 < len(roles) < 3 else "large" if not found else "shared"
        found.append(Motor(taken(f"{word}_drive"), torque, speed, names, *sources))
    return found


def with_kinds(motors: Sequence[Motor]) -> list[Motor]:
    """Motors of a machine on a fixed base with their families, by torque.

    A class below all modules is a servo; where every class has the torque of a servo, all are.
    """
    least, _ = laws().trends["mass"].ranges["peak_torque"]
    servo = all_servos(motors)
    return [
        replace(motor, kind=SERVO) if servo or motor.torque < least else motor for motor in motors
    ]


def all_servos(motors: Sequence[Motor]) -> bool:
    """Whether no motor is stronger than 95 % of the servos of the catalogue."""
    most = np.quantile([part.peak_torque for part in catalogue(SERVO).values()], 0.95)
    return all(motor.torque <= most for motor in motors)
