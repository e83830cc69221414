"""How much of their actuators' torque and speed the joints use, as counts over seeds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from draft.extras import need
from draft.learn.quadruped import CLASSES
from draft.learn.report.gather import Evaluation, Study
from draft.learn.utilisation import BINS, QUANTITIES, percentile
from draft.values import Array

BATTERIES = ("speed", "ascent", "descent", "push", "walk")
FILE = "utilisation.parquet"


@dataclass
class Use:
    """Utilisation of a design in one battery.

    Attributes:
        counts: samples by bin, by joint class and quantity, over all seeds.
        shares: 95th percentile by joint class and quantity.
        levels: at which it was measured, one per seed.
        limiting: joint class, by what, and in how many of how many seeds; None where not known.
    """

    counts: dict[tuple[str, str], Array] = field(default_factory=dict)
    shares: dict[tuple[str, str], float] = field(default_factory=dict)
    levels: list[float] = field(default_factory=list)
    limiting: tuple[str, str, int, int] | None = None


class Utilisation:
    """Utilisation of the designs of a study; every file is read once."""

    def __init__(self, study: Study) -> None:
        """Read what the nominal arm measured.

        Raises:
            DraftError: the extra that reads Parquet is not installed.
        """
        self.warnings: list[str] = []
        self._found: dict[tuple[str, str], Use] = {}
        for design in study.members:
            evaluations = [one for one in study.of(design, "nominal") if one.data["utilisation"]]
            tables = {one.folder: self._read(one) for one in evaluations}
            for battery in BATTERIES:
                of = [one for one in evaluations if battery in one.data["utilisation"]]
                if of:
                    self._found[design, battery] = _use(battery, of, tables)

    def of(self, design: str, battery: str) -> Use | None:
        """What a design used in a battery; None where it was not measured."""
        return self._found.get((design, battery))

    def _read(self, one: Evaluation) -> dict[str, Any] | None:
        """Columns of a file of counts; None where it cannot be read."""
        parquet = need("pyarrow.parquet")
        path = one.folder / FILE
        names = ["battery", "level", "joint", "quantity", "bin", "count"]
        try:
            table = parquet.read_table(path, columns=names)
        except (OSError, ValueError, KeyError) as error:  # pyarrow's own errors are of these
            words = " ".join(str(error).split())[:120]
            where = "/".join(path.parts[-4:])
            self.warnings.append(f"{where} cannot be read ({words}); its counts are left out")
            return None
        return {name: table.column(name).to_numpy(zero_copy_only=False) for name in names}


def _use(battery: str, evaluations: list[Evaluation], tables: dict[Any, Any]) -> Use:
    use = Use()
    for one in evaluations:
        level = _level(one, battery)
        if level is not None:
            use.levels.append(level)
            for key, counts in _counts(tables[one.folder], battery, level):
                use.counts[key] = use.counts.get(key, np.zeros(BINS)) + counts
    for joint in CLASSES:
        for quantity in QUANTITIES:
            counted = percentile(use.counts.get((joint, quantity), np.zeros(BINS)))
            if counted is not None:
                use.shares[joint, quantity] = counted
                continue
            values = [
                float(value)
                for one in evaluations
                if (value := one.data["utilisation"][battery].get(joint, {}).get(quantity))
                is not None
            ]
            if values:
                use.shares[joint, quantity] = float(np.median(values))
    use.limiting = _limiting(battery, evaluations)
    return use


def _level(one: Evaluation, battery: str) -> float | None:
    """Level that a battery's utilisation is of."""
    level = one.data["utilisation_level"].get(battery)
    if level is None and battery == "speed":
        level = one.data["scalars"].get("peak_command")
    return None if level is None else float(level)


def _counts(
    table: dict[str, Any] | None, battery: str, level: float
) -> Iterator[tuple[tuple[str, str], Array]]:
    if table is None:
        return
    at = (table["battery"] == battery) & (np.abs(table["level"] - level) < 1e-6)
    for joint in CLASSES:
        for quantity in QUANTITIES:
            rows = at & (table["joint"] == joint) & (table["quantity"] == quantity)
            if rows.any():
                bins = np.minimum(table["bin"][rows].astype(int), BINS - 1)
                weights = table["count"][rows].astype(float)
                yield (joint, quantity), np.bincount(bins, weights, minlength=BINS).astype(float)


def _limiting(battery: str, evaluations: list[Evaluation]) -> tuple[str, str, int, int] | None:
    """What most seeds are limited by; of two, the one that is nearer its limit."""
    found: Counter[tuple[str, str]] = Counter()
    nearest: dict[tuple[str, str], float] = {}
    for one in evaluations:
        told = one.data["limiting"].get(battery)
        if isinstance(told, dict) and told.get("joint") in CLASSES:
            key = str(told["joint"]), str(told.get("by", ""))
            found[key] += 1
            nearest[key] = max(nearest.get(key, 0.0), float(told.get("value") or 0.0))
    if not found:
        return None
    best = max(found, key=lambda key: (found[key], nearest[key], key))
    return *best, found[best], sum(found.values())
