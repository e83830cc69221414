"""Twins of many robots, each by structure trends that have not seen it, in parallel processes."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import partial
from pathlib import Path
from typing import Any

from draft import parallel
from draft.errors import DraftError
from draft.fitting.structure.parse import listed
from draft.fitting.structure.robots import Robot
from draft.laws.survey import read
from draft.twins.compare import compare_twin
from draft.twins.dynamics import POSES, SEED
from draft.twins.record import plain, residuals
from draft.values import scalar

SHARE = 0.9


@dataclass(frozen=True, slots=True)
class Row:
    """One robot's line of the table.

    Attributes:
        robot: its key, that of its file.
        population: whose structure trends hold.
        fitted: whether the survey's fits use it; then it was held out of them here.
        vendor_mass, twin_mass: total mass [kg]; the vendor's is nan where the file does not state
            all of it.
        low, high: ends of the twin's 90 % band [kg].
        inertia, gravity: median errors of M(q) and g(q) [%].
        joints: hinges compared.
        why: why the survey's fits leave it out.
        residuals: how far each group of links misses; see `draft.laws.residuals`.
    """

    robot: str
    population: str
    fitted: bool
    vendor_mass: float
    twin_mass: float
    low: float
    high: float
    inertia: float
    gravity: float
    joints: int
    why: str = ""
    residuals: Mapping[str, Any] = field(default_factory=dict)

    @property
    def ratio(self) -> float:
        """The twin's mass over the vendor's."""
        return self.twin_mass / self.vendor_mass

    @property
    def inside(self) -> bool:
        """Whether the band holds the vendor's mass."""
        return self.low <= self.vendor_mass <= self.high


@dataclass(frozen=True, slots=True)
class Failure:
    """A robot that no twin could be made of, and why."""

    robot: str
    fitted: bool
    cause: str


@dataclass(frozen=True, slots=True)
class Score:
    """Error of total mass over robots: n, geometric mean fold, mean ln ratio, share in the band."""

    n: int
    fold: float
    bias: float
    covered: float


Task = tuple[str, str, bool, str, tuple[str, ...]]


def tasks(source: Path) -> list[Task]:
    """Twins of a folder or manifest (.csv): key, file, and robots to hold out.

    Raises:
        DescriptionError: it cannot be read, or names no file.
    """
    surveyed = {row.robot for row in read()}
    return [_task(robot, path, surveyed) for robot, path in listed(source)]


def _task(robot: Robot, path: Path, surveyed: set[str]) -> Task:
    held = (robot.key,) if robot.key in surveyed else ()
    return robot.key, str(path), robot.used, robot.reason, held


def run(
    todo: Sequence[Task], workers: int | None = None, count: int = POSES, seed: int = SEED
) -> Iterator[Row | Failure]:
    """Make every twin; results come as they are ready.

    Args:
        todo: from `tasks`.
        workers: processes; default one per processor.
        count: poses that M(q) and g(q) are compared at.
        seed: of the poses.
    """
    processes = max(1, min(workers or os.cpu_count() or 1, len(todo)))
    left = {task[0]: task for task in todo}
    try:
        for task, row in parallel.run(todo, partial(one, count=count, seed=seed), processes):
            del left[task[0]]
            yield row
    except DraftError as error:  # workers keep dying: the results so far are kept
        for key, _, fitted, *_ in left.values():
            yield Failure(key, fitted, str(error))


def one(task: Task, count: int = POSES, seed: int = SEED) -> Row | Failure:
    """Make one twin; an error of one robot does not lose the results of the others."""
    key, file, fitted, why, held = task
    try:
        found = compare_twin(file, without=held, poses=count, seed=seed, key=key)
    except DraftError as error:
        return Failure(key, fitted, str(error))
    except Exception as error:
        reason = f"a fault of Draft: {type(error).__name__}: {str(error)[:200]}"
        return Failure(key, fitted, reason)
    return Row(
        robot=key,
        population=found.population,
        fitted=fitted,
        vendor_mass=found.vendor_mass,
        twin_mass=scalar(found.design.mass),
        low=found.expected.low,
        high=found.expected.high,
        inertia=found.inertia.median,
        gravity=found.gravity.median,
        joints=sum(name in found.files.drives for name in found.joints),
        why=why,
        residuals=residuals(found),
    )


def score(rows: Sequence[Row]) -> Score:
    """Sum up the errors of total mass, over the robots whose mass is known."""
    rows = [row for row in rows if not math.isnan(row.vendor_mass)]
    logs = [math.log(row.ratio) for row in rows]
    n = len(rows)
    fold = math.exp(sum(map(abs, logs)) / n) if n else math.nan
    bias = sum(logs) / n if n else math.nan
    return Score(n, fold, bias, sum(row.inside for row in rows) / n if n else math.nan)


def record(rows: Sequence[Row], failed: Sequence[Failure]) -> dict[str, Any]:
    """The table as plain data for JSON, with the scores of the robots that the fits use."""
    kinds = sorted({row.population for row in rows})
    fitted = {kind: [r for r in rows if r.population == kind and r.fitted] for kind in kinds}
    table = {
        "robots": [{**asdict(row), "ratio": row.ratio, "inside": row.inside} for row in rows],
        "refused": [asdict(one) for one in failed],
        "held_out": {kind: asdict(score(own)) for kind, own in fitted.items() if own},
    }
    return plain(table)


def table_csv(rows: Sequence[Row]) -> str:
    """The table as CSV text, numbers to six digits."""
    out = io.StringIO()
    names = [one.name for one in fields(Row) if one.name != "residuals"]
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*names, "ratio", "inside"])
    for row in rows:
        values = [*(getattr(row, name) for name in names), row.ratio, row.inside]
        writer.writerow(map(_cell, values))
    return out.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)
