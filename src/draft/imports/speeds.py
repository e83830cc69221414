"""Speeds of surveyed joints, for drives that declare none."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from draft.laws.survey import read, usable
from draft.values import Array

# Speeds that a hinge can have [rad/s].
SLOWEST, FASTEST = 0.01, 200.0
NEIGHBOURS = 15


def surveyed_speed(torque: float, population: str) -> float:
    """Median speed of the surveyed joints of nearest torque [rad/s]."""
    efforts, speeds = _surveyed(population)
    near = np.argsort(np.abs(np.log(efforts / torque)), kind="stable")[:NEIGHBOURS]
    return float(np.median(speeds[near]))


@lru_cache(maxsize=2)
def _surveyed(population: str) -> tuple[Array, Array]:
    """Torques and speeds that the surveyed robots of a population declare, one pair per robot."""
    pairs = {
        (row.robot, effort, speed)
        for row in read()
        if row.population == population
        for effort, speed in zip(row.efforts, row.velocities, strict=True)
        if usable(effort) and SLOWEST <= speed <= FASTEST
    }
    table = np.array([pair[1:] for pair in sorted(pairs)])
    return table[:, 0], table[:, 1]
