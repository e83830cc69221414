"""Trim of a policy: integrators that act on what it observes until the velocity is as asked.

A policy that has never seen a robot follows its commands with a constant error, such as a drift
ahead of a robot whose mass lies further ahead. Integral action removes constant errors (Astrom and
Murray, Feedback Systems, 2nd edition, section 11.1). One kind shifts the command. The other lets
the policy see a trunk that leans further to where the robot drifts, so that it leans back, and its
command stays as asked. Both are slow compared with a step, and bounded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
_COMMAND, _LEAN, _NUMBERS = 3, 2, 13


@dataclass(frozen=True)
class Trim:
    """Integrators of the errors of vx, vy and wz.

    Their state is what is added to the command, vx, vy and wz, and to projected gravity, ahead and
    to the left: shape (..., 5), zeros at the start.

    Attributes:
        rate: change of each state per time and error, such as [1/s, 1/s, 1/s, 1/m, 1/m], shape
            (..., 5).
        most: largest state either way, such as [m/s, m/s, rad/s, 1, 1], shape (..., 5).
        ends: largest command that is observed for a smaller one, such as [m/s, m/s, rad/s], shape
            (..., 3).
    """

    rate: Array
    most: Array
    ends: Array

    def __bool__(self) -> bool:
        return bool(np.any(self.rate))

    def numbers(self) -> list[float]:
        """Rates, largest states and ends in a row, of one robot, shape (13,)."""
        return [*self.rate.tolist(), *self.most.tolist(), *self.ends.tolist()]

    @staticmethod
    def of(numbers: Sequence[float]) -> Trim:
        """Trim of such a row.

        Raises:
            ValueError: it has another length, or numbers that no trim has.
        """
        values = np.array(numbers, float)
        if values.shape != (_NUMBERS,) or not np.isfinite(values).all() or (values < 0).any():
            raise ValueError(f"trim has {len(values)} numbers, not {_NUMBERS} that are 0 or more")
        size = _COMMAND + _LEAN
        return Trim(values[:size], values[size : 2 * size], values[2 * size :])

    def command(self, asked: ArrayLike, state: Array) -> Array:
        """Command that the policy observes, shape (..., 3).

        Args:
            asked: vx, vy and wz that are asked for, shape (..., 3).
            state: the state, shape (..., 5).
        """
        asked = np.asarray(asked, float)
        ends = np.maximum(self.ends, np.abs(asked))
        return np.clip(asked + state[..., :_COMMAND], -ends, ends)

    def gravity(self, gravity: ArrayLike, state: Array) -> Array:
        """Projected gravity that the policy observes, shape (..., 3).

        Args:
            gravity: unit vector that points down, in the trunk's frame, shape (..., 3).
            state: the state, shape (..., 5).
        """
        seen = np.array(gravity, float)
        seen[..., :_LEAN] += state[..., _COMMAND:]
        return seen

    def next(self, state: Array, asked: ArrayLike, velocity: ArrayLike, time: ArrayLike) -> Array:
        """Next state, shape (..., 5).

        Args:
            state: the state, shape (..., 5).
            asked: vx, vy and wz that are asked for, shape (..., 3).
            velocity: vx, vy and wz of the trunk in its own frame, shape (..., 3).
            time: time from this state to the next, which broadcasts to shape (..., 5).
        """
        missing = np.asarray(asked, float) - np.asarray(velocity, float)
        errors = np.concatenate([missing, -missing[..., :_LEAN]], axis=-1)
        return np.clip(state + self.rate * np.asarray(time) * errors, -self.most, self.most)


NONE = Trim(np.zeros(5), np.zeros(5), np.zeros(3))
START = np.zeros(5)
