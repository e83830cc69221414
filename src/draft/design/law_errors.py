"""Errors of the laws that the numbers of a design follow: what if they err by these factors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from draft.values import Array, Value


@dataclass(frozen=True)
class LawErrors:
    """ln(true / predicted) of laws: numbers, or arrays of shape (N,) for N designs.

    Attributes:
        actuators: of each actuator class, by law.
        segments: of the structural mass, by segment class.
        trunk: of the density of the trunk.
    """

    actuators: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)
    segments: Mapping[str, Value] = field(default_factory=dict)
    trunk: Value = 0.0

    @property
    def count(self) -> int | None:
        """N; None for numbers."""
        of_actuators = (x for laws in self.actuators.values() for x in laws.values())
        for value in (*of_actuators, *self.segments.values(), self.trunk):
            if isinstance(value, np.ndarray):
                return len(value)
        return None

    def repeated(self, times: int) -> LawErrors:
        """The errors `times` times, one after another, of N designs each."""
        return self._each(lambda x: np.tile(x, times))

    def of(self, rows: NDArray[np.intp]) -> LawErrors:
        """The errors of some of N designs, or of one several times."""
        return self._each(lambda x: x[rows])

    def after(self, count: int) -> LawErrors:
        """The errors after those of `count` designs whose laws do not err."""
        return self._each(lambda x: np.concatenate([np.zeros(count), x]))

    def _each(self, change: Callable[[Array], Array]) -> LawErrors:
        """The errors of N designs, changed."""

        def changed(value: Value) -> Value:
            return change(value) if isinstance(value, np.ndarray) else value

        of_actuators = {
            name: {law: changed(x) for law, x in of.items()} for name, of in self.actuators.items()
        }
        segments = {name: changed(x) for name, x in self.segments.items()}
        return LawErrors(of_actuators, segments, changed(self.trunk))
