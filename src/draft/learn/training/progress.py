"""Progress of a training: an iteration at a time, as printed lines, and in progress.csv."""

from __future__ import annotations

import csv
import io
import math
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from draft.errors import counted
from draft.learn.engine.rows import BODIES_ERROR, BODIES_WORST, Row

PROGRESS = "progress.csv"  # Name of its file.
STAIRS = "stairs/hardest_row"
FASTEST = "curriculum/fastest"
# Columns of a thinned curve, and its largest number of windows.
CURVE_COLUMNS = (
    *("reward", "episode_s", "falls", "tracking_error", STAIRS, FASTEST),
    *(BODIES_ERROR, BODIES_WORST),
)
WINDOWS = 50
_GAINED = 10  # Most iterations at either end that a gain is measured over.
LINE_SECONDS = 5.0  # Least time between two lines.


@dataclass(frozen=True)
class Progress:
    """Progress of a training after an iteration.

    Attributes:
        iteration: iterations done.
        total: iterations requested.
        steps_per_second: environment steps per second of all worlds together.
        left: seconds of training left at this speed.
        row: numbers of the iteration; see `draft.learn.training.ppo.log`.
    """

    iteration: int
    total: int
    steps_per_second: float
    left: float
    row: Row


# --- printed lines -------------------------------------------------------------------------


class LinePrinter:
    """Prints progress as lines, for a log or a terminal without cursor control.

    It prints at most every few seconds, and always for the last iteration.
    """

    def __init__(self) -> None:
        self._printed = -math.inf

    def report(self, progress: Progress) -> None:
        """Print the progress unless the last line is too recent."""
        now = time.monotonic()
        if now - self._printed >= LINE_SECONDS or progress.iteration == progress.total:
            self._printed = now
            print(_line(progress), flush=True)


def _line(progress: Progress) -> str:
    row = progress.row
    rewards = " ".join(f"{name} {value:.2f}" for name, value in terms(row).items())
    return (
        f"iteration {progress.iteration}/{progress.total}  {progress.steps_per_second:,.0f} steps/s"
        f"  reward {row['reward']:.2f}/s  episode {number(row['episode_s'])} s"
        f"  falls {share(row['falls'])}  error {row['tracking_error']:.2f} m/s{_bodies(row)}"
        f"  left {clock(progress.left)}\n  {rewards}"
    )


def _bodies(row: Row) -> str:
    """Tracking of a family's worst bodies as text; empty without redrawn bodies."""
    if BODIES_WORST not in row:
        return ""
    return f" ({row[BODIES_ERROR]:.0%} of the command, worst bodies {row[BODIES_WORST]:.0%})"


def terms(row: Row) -> Row:
    """Reward terms by name, weighted, per second."""
    return {n.removeprefix("reward/"): v for n, v in row.items() if n.startswith("reward/")}


def number(value: float) -> str:
    """A number as text, or a dash if it is not finite."""
    return f"{value:.1f}" if math.isfinite(value) else "-"


def share(value: float) -> str:
    """A share as a percentage, or a dash if it is not finite."""
    return f"{value:.0%}" if math.isfinite(value) else "-"


def clock(seconds: float) -> str:
    """Seconds as hours, minutes and seconds: 1:02:03."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"


# --- progress.csv --------------------------------------------------------------------------


def read(path: Path) -> list[Row]:
    """Read the rows of a progress.csv; a truncated row is skipped, a missing file has none."""
    try:
        lines = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))
    except OSError:
        return []
    rows = []
    for line in lines[1:]:
        try:
            rows.append({n: float(v) for n, v in zip(lines[0], line, strict=True)})
        except ValueError:
            continue
    return rows


def thin(rows: Sequence[Row]) -> list[Row]:
    """Thin the curve of a training to means over at most `WINDOWS` windows of its iterations.

    Args:
        rows: one row per iteration.

    Returns:
        One row per window: the iteration and the finite `CURVE_COLUMNS`, to six digits.
    """
    width = max(1, math.ceil(len(rows) / WINDOWS))
    windows = [rows[start : start + width] for start in range(0, len(rows), width)]
    return [_mean(window) for window in windows]


def _mean(window: Sequence[Row]) -> Row:
    means = {}
    for name in ("iteration", *CURVE_COLUMNS):
        values = [row[name] for row in window if math.isfinite(row.get(name, math.nan))]
        if values:
            means[name] = float(f"{statistics.fmean(values):.6g}")
    return means


def hardest_row(path: Path, iteration: int) -> float | None:
    """Hardest row of stairs that a robot was on up to an iteration; None if none is recorded."""
    return max(_column(path, STAIRS, iteration), default=None)


def fastest(path: Path, iteration: float = math.inf, column: str = FASTEST) -> float | None:
    """Largest |vx| that was commanded in an iteration [m/s]; None if none is recorded.

    Of a family, whose bodies are commanded as fast as they track, the mean over the worlds.
    """
    return next(reversed(_column(path, column, iteration)), None)


def gained(path: Path) -> str | None:
    """What a training that started from a policy gained, in words; None if it is too short.

    An exported policy acts unchanged in the first iterations, in which the critic learns alone.
    """
    rows = read(path)
    count = min(_GAINED, len(rows) // 2)
    if not count:
        return None
    first, last = (_mean(part) for part in (rows[:count], rows[-count:]))
    errors, falls = (
        [row.get(name, math.nan) for row in (first, last)] for name in ("tracking_error", "falls")
    )
    # Commands grow with what a robot can do: an error says little without their size.
    asked = [f" of up to {row[FASTEST]:.2f} m/s" if FASTEST in row else "" for row in (first, last)]
    text = (
        f"gained in training: commands{asked[1]} are missed by {errors[1]:.2f} m/s, at first"
        f"{asked[0] and f' those{asked[0]}'} by {errors[0]:.2f} m/s"
    )
    if not any(map(math.isnan, falls)):  # NaN where no episode ended.
        text += f", and {share(falls[1])} of episodes end in a fall, at first {share(falls[0])}"
    return f"{text} (means of {counted(count, 'iteration')})"


def _column(path: Path, name: str, iteration: float) -> list[float]:
    """Finite values of a column up to an iteration."""
    values = (row.get(name, math.nan) for row in read(path) if row["iteration"] <= iteration)
    return [value for value in values if math.isfinite(value)]
