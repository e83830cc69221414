"""Trim of a policy: an integrator that shifts its command until the mean velocity is as asked.

A policy that has never seen a robot follows its commands with a constant error, such as a drift
ahead of a robot whose mass lies further ahead. Integral action removes constant errors (Astrom and
Murray, Feedback Systems, section 11.1). It is slow compared with a step, and bounded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trim:
    """An integrator of the error of vx, vy and wz.

    Attributes:
        rate: change of the shift per time and error, such as [1/s].
        most: largest shift of vx, vy and wz either way, such as [m/s, m/s, rad/s], shape (..., 3).
        ends: largest command that a shift leads to, in the same units, shape (..., 3).
    """

    rate: float
    most: Array
    ends: Array

    def numbers(self) -> list[float]:
        """Rate, largest shifts and ends in a row, of one robot, shape (7,)."""
        return [self.rate, *self.most.tolist(), *self.ends.tolist()]

    @staticmethod
    def of(numbers: Sequence[float]) -> Trim:
        """Trim of such a row.

        Raises:
            ValueError: it has another length, or numbers that no trim has.
        """
        values = np.array(numbers, float)
        if values.shape != (7,) or not np.isfinite(values).all() or (values < 0).any():
            raise ValueError(f"trim has {len(values)} numbers, not 7 that are 0 or more")
        return Trim(float(values[0]), values[1:4], values[4:])

    def shifted(self, command: ArrayLike, shift: Array) -> Array:
        """Command that a policy observes, shape (..., 3).

        Args:
            command: vx, vy and wz that are asked for, shape (..., 3).
            shift: the shift; zeros at the start, shape (..., 3).
        """
        asked = np.asarray(command, float)
        ends = np.maximum(self.ends, np.abs(asked))
        return np.clip(asked + shift, -ends, ends)

    def next(self, shift: Array, command: ArrayLike, velocity: ArrayLike, time: ArrayLike) -> Array:
        """Next shift, shape (..., 3).

        Args:
            shift: the shift, shape (..., 3).
            command: vx, vy and wz that are asked for, shape (..., 3).
            velocity: vx, vy and wz of the trunk in its own frame, shape (..., 3).
            time: time from this shift to the next, which broadcasts to shape (..., 3).
        """
        error = np.asarray(command, float) - np.asarray(velocity, float)
        return np.clip(shift + self.rate * np.asarray(time) * error, -self.most, self.most)


NONE = Trim(0.0, np.zeros(3), np.zeros(3))
