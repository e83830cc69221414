"""Catalogue as columns of logarithms, for fits and hold-outs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from draft.laws.actuators import HIGH_RATIO, HIGH_RATIO_RATED
from draft.laws.catalogue import Part
from draft.laws.quantities import QUANTITIES
from draft.values import Array

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Rows:
    """Modules as columns, each of shape (n,).

    Attributes:
        log: natural logarithm of each quantity that vendors publish, in SI units; NaN where the
            vendor gives none. The rotor inertia of small inrunners behind a large reduction is NaN
            too, since it does not depend on the radius of the module. `rated_torque` is that of
            modules with reductions below `HIGH_RATIO`, `rated_torque_high_ratio` that of the
            others.
        name: name of each module.
        vendor: vendor of each module.
        family: family of each module.
        every: whether rows without a published reduction are fitted and scored too.
    """

    log: dict[str, Array]
    name: list[str]
    vendor: list[str]
    family: list[str]
    every: bool = False

    @property
    def geared(self) -> Mask:
        """Mask of rows that are fitted and scored: those with a published reduction, shape (n,)."""
        return ~np.isnan(self.log["gear_ratio"]) | self.every

    def has(self, *quantities: str) -> Mask:
        """Mask of rows with all of these quantities, shape (n,)."""
        known = np.ones(len(self.name), dtype=bool)
        for quantity in quantities:
            known &= ~np.isnan(self.log[quantity])
        return known

    def inputs(self, quantities: Iterable[str]) -> Array:
        """Logarithms of k quantities, shape (n, k)."""
        return np.column_stack([self.log[quantity] for quantity in quantities])


def rows_of(parts: Iterable[Part], every: bool = False) -> Rows:
    """Columns of a catalogue, in its order.

    Args:
        parts: the modules.
        every: as in `Rows`.
    """
    parts = list(parts)

    def known(quantity: str) -> bool:
        return quantity == HIGH_RATIO_RATED or hasattr(Part, quantity)

    def column(quantity: str) -> Array:
        if quantity.startswith("rated_torque"):
            high = quantity == HIGH_RATIO_RATED
            values = [
                p.rated_torque if p.gear_ratio and (p.gear_ratio >= HIGH_RATIO) == high else None
                for p in parts
            ]
            return np.log(np.array(values, dtype=np.float64))
        values = [getattr(part, quantity) for part in parts]
        if quantity == "rotor_inertia":
            pairs = zip(parts, values, strict=True)
            values = [None if part.small_geared_inrunner else value for part, value in pairs]
        return np.log(np.array(values, dtype=np.float64))

    return Rows(
        {name: column(name) for name in (*QUANTITIES, HIGH_RATIO_RATED) if known(name)},
        [part.name for part in parts],
        [part.vendor for part in parts],
        [part.family for part in parts],
        every,
    )
