"""Actuator classes of a vendor's robot: one for each pair of torque and speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from draft.errors import Problem
from draft.fitting.structure.attribution import usable
from draft.fitting.structure.rows import read
from draft.imports.names import Unique
from draft.imports.reduce import Body
from draft.values import Array

SLOWEST, FASTEST = 0.01, 200.0
NEIGHBOURS = 15


@dataclass(frozen=True, slots=True)
class Motor:
    """One class: peak torque [N m], no-load speed [rad/s], and the joints that it drives."""

    name: str
    torque: float
    speed: float
    joints: tuple[str, ...]
    declared: bool


def motors(bodies: Sequence[Body], people: str, notes: list[Problem], taken: Unique) -> list[Motor]:
    """Group joints by their declared torque and speed, strongest first."""
    groups: dict[tuple[float, float, bool], list[Body]] = {}
    for body in bodies:
        if body.joint is None or body.slides:
            continue
        speed, declared = _speed(body, people, notes)
        torque = _round(body.effort)
        groups.setdefault((torque, speed, declared), []).append(body)
    found: list[Motor] = []
    for (torque, speed, declared), own in sorted(groups.items(), key=lambda item: -item[0][0]):
        roles = list(dict.fromkeys(body.role for body in own if body.role))
        names = tuple(body.joint.name for body in own if body.joint)
        word = "_".join(roles[:2]) if 0 < len(roles) < 3 else "large" if not found else "shared"
        found.append(Motor(taken(f"{word}_drive"), torque, speed, names, declared))
    return found


def _speed(body: Body, people: str, notes: list[Problem]) -> tuple[float, bool]:
    """Declared speed, else the median of the surveyed joints of nearest torque [rad/s]."""
    joint = body.joint
    speed = joint.velocity if joint is not None else None
    if speed is not None and SLOWEST <= speed <= FASTEST:
        return _round(speed), True
    if joint is not None and speed is not None:
        cause = f"joint '{joint.name}' declares a speed of {speed:g} rad/s: it is not used"
        notes.append(Problem(cause, joint.where, f"usable: {SLOWEST} to {FASTEST:g} rad/s"))
    efforts, speeds = _surveyed(people)
    near = np.argsort(np.abs(np.log(efforts / body.effort)), kind="stable")[:NEIGHBOURS]
    return _round(float(np.median(speeds[near]))), False


@lru_cache(maxsize=2)
def _surveyed(people: str) -> tuple[Array, Array]:
    """Torques and speeds that the surveyed robots of a population declare, one pair per robot."""
    pairs = {
        (row.robot, effort, speed)
        for row in read()
        if row.population == people
        for effort, speed in zip(row.efforts, row.velocities, strict=True)
        if usable(effort) and SLOWEST <= speed <= FASTEST
    }
    table = np.array([pair[1:] for pair in sorted(pairs)])
    return table[:, 0], table[:, 1]


def _round(value: float) -> float:
    return float(f"{value:.5g}")
