"""Errors of the laws that the numbers of a design follow: what if they err by these factors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from draft.values import Value


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
        """The errors of N designs for `times` designs each, in blocks of N."""

        def tiled(value: Value) -> Value:
            return np.tile(value, times) if isinstance(value, np.ndarray) else value

        return LawErrors(
            {name: {law: tiled(x) for law, x in of.items()} for name, of in self.actuators.items()},
            {name: tiled(x) for name, x in self.segments.items()},
            tiled(self.trunk),
        )
