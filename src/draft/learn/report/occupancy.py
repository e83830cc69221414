"""How much of their actuators' torque and speed the joints use, as counts over seeds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from draft.extras import need
from draft.learn.evaluation import OCCUPANCY, UTILISATION
from draft.learn.quadruped import CLASSES
from draft.learn.report.gather import Evaluation, Study
from draft.learn.utilisation import BINS, CELLS, QUANTITIES, percentile
from draft.values import Array

BATTERIES = ("speed", "ascent", "descent", "push", "walk")
COLUMNS = {
    UTILISATION: ("battery", "level", "joint", "quantity", "bin", "count"),
    OCCUPANCY: ("battery", "level", "joint", "torque", "speed", "count"),
}
WORDS = ("battery", "joint", "quantity")
Columns = dict[str, Any]


class Limit(NamedTuple):
    """What limits most seeds.

    Attributes:
        joint: joint class.
        by: torque, speed or sum.
        seeds, of: in how many of how many seeds.
        value: share of the limit, the largest of these seeds.
    """

    joint: str
    by: str
    seeds: int
    of: int
    value: float


@dataclass
class Use:
    """Utilisation of a design in one battery.

    Attributes:
        counts: samples by bin, by joint class and quantity, over all seeds.
        plane: samples by cells of torque and speed, by joint class, over all seeds.
        shares: 95th percentile by joint class and quantity.
        levels: at which it was measured, one per seed.
        limiting: None where not known.
    """

    counts: dict[tuple[str, str], Array] = field(default_factory=dict)
    plane: dict[str, Array] = field(default_factory=dict)
    shares: dict[tuple[str, str], float] = field(default_factory=dict)
    levels: list[float] = field(default_factory=list)
    limiting: Limit | None = None


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
            tables = {(one.folder, n): self._read(one, n) for one in evaluations for n in COLUMNS}
            for battery in BATTERIES:
                of = [one for one in evaluations if battery in one.data["utilisation"]]
                if of:
                    self._found[design, battery] = _use(battery, of, tables)

    def of(self, design: str, battery: str) -> Use | None:
        """What a design used in a battery; None where it was not measured."""
        return self._found.get((design, battery))

    def _read(self, one: Evaluation, name: str) -> Columns | None:
        """Columns of a file of counts; None where it cannot be read."""
        parquet = need("pyarrow.parquet")
        path = one.folder / name
        try:
            table = parquet.read_table(path, columns=list(COLUMNS[name]))
            columns = {n: _column(n, table.column(n)) for n in COLUMNS[name]}
        except (OSError, ValueError, KeyError) as error:  # pyarrow's own errors are of these
            words = " ".join(str(error).split())[:120]
            where = "/".join(path.parts[-4:])
            self.warnings.append(f"{where} cannot be read ({words}); its counts are left out")
            return None
        return columns


def _column(name: str, column: Any) -> Any:
    """Values of a column as numbers or words.

    Raises:
        ValueError: they are not what the column holds.
    """
    if column.null_count:
        raise ValueError(f"column {name} has gaps")
    kind = "string" if name in WORDS else "double" if name == "level" else "int64"
    return column.cast(kind).to_numpy(zero_copy_only=False)


def _use(battery: str, evaluations: list[Evaluation], tables: dict[Any, Any]) -> Use:
    use = Use()
    for one in evaluations:
        level = _level(one, battery)
        if level is not None:
            use.levels.append(level)
            for key, counts in _counts(tables[one.folder, UTILISATION], battery, level):
                use.counts[key] = use.counts.get(key, np.zeros(BINS)) + counts
            for joint, cells in _cells(tables[one.folder, OCCUPANCY], battery, level):
                use.plane[joint] = use.plane.get(joint, np.zeros((CELLS, CELLS))) + cells
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
    use.limiting = limiting(battery, [one.data for one in evaluations])
    return use


def _level(one: Evaluation, battery: str) -> float | None:
    """Level that a battery's utilisation is of."""
    level = one.data["utilisation_level"].get(battery)
    if level is None and battery == "speed":
        level = one.data["scalars"].get("peak_command")
    return None if level is None else float(level)


def _counts(
    table: Columns | None, battery: str, level: float
) -> Iterator[tuple[tuple[str, str], Array]]:
    """Samples by bin of each joint class and quantity."""
    if table is None:
        return
    at = _at(table, battery, level)
    for joint in CLASSES:
        for quantity in QUANTITIES:
            rows = at & (table["joint"] == joint) & (table["quantity"] == quantity)
            if rows.any():
                bins = _place(table["bin"][rows], BINS)
                yield (joint, quantity), np.bincount(bins, table["count"][rows], BINS).astype(float)


def _cells(table: Columns | None, battery: str, level: float) -> Iterator[tuple[str, Array]]:
    """Samples by torque and speed of each joint class, shape (cells, cells)."""
    if table is None:
        return
    at = _at(table, battery, level)
    for joint in CLASSES:
        rows = at & (table["joint"] == joint)
        if rows.any():
            torque, speed = (_place(table[name][rows], CELLS) for name in ("torque", "speed"))
            cells = np.bincount(torque * CELLS + speed, table["count"][rows], CELLS * CELLS)
            yield joint, cells.reshape(CELLS, CELLS).astype(float)


def _at(table: Columns, battery: str, level: float) -> Array:
    """Rows of a battery's level."""
    return (table["battery"] == battery) & (np.abs(table["level"] - level) < 1e-6)


def _place(bins: Array, count: int) -> Array:
    """Bins that are none are counted in the last."""
    return np.clip(bins.astype(int), 0, count - 1)


def limiting(battery: str, summaries: Iterable[Mapping[str, Any]]) -> Limit | None:
    """What most seeds are limited by; of two, the one that is nearer its limit."""
    found: Counter[tuple[str, str]] = Counter()
    nearest: dict[tuple[str, str], float] = {}
    for summary in summaries:
        told = summary["limiting"].get(battery)
        if isinstance(told, dict) and told.get("joint") in CLASSES:
            key = str(told["joint"]), str(told.get("by", ""))
            found[key] += 1
            nearest[key] = max(nearest.get(key, 0.0), float(told.get("value") or 0.0))
    if not found:
        return None
    best = max(found, key=lambda key: (found[key], nearest[key], key))
    return Limit(*best, found[best], sum(found.values()), nearest[best])
