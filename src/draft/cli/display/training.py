"""Terminal output of `draft train`: a table that is refreshed, elsewhere lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING

from rich.live import Live
from rich.table import Table

from draft.cli.display.verdict import console
from draft.learn.measuring.levels import ASCENT, PUSH, SPEED
from draft.learn.training.progress import LinePrinter, clock, number, share, terms

if TYPE_CHECKING:
    from draft.learn.measuring.rollout.review import Kind, Level
    from draft.learn.training.progress import Progress
    from draft.learn.training.run import Run

# A robot walks if it misses each command by at most this [m/s] or this share of it, and this share
# of the robots stays up.
MISS, MISSED_SHARE, UPRIGHT = 0.10, 0.15, 0.95


class Screen:
    """Progress of a training; `tell` is called after every iteration."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._console = console()
        self._live: Live | None = None
        self._lines = LinePrinter()

    def __enter__(self) -> Screen:
        if self._console.is_terminal:
            self._live = Live(console=self._console, transient=False, auto_refresh=False)
            self._live.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._live is not None:
            self._live.__exit__(kind, error, trace)

    def tell(self, progress: Progress) -> None:
        """Show an iteration."""
        if self._live is not None:
            self._live.update(_table(self._title, progress), refresh=True)
            return
        self._lines.report(progress)


def _table(title: str, progress: Progress) -> Table:
    row = progress.row
    table = Table(title=title, title_justify="left", show_header=False, box=None)
    table.add_column(style="dim")
    table.add_column(justify="right")
    facts = {
        "iteration": f"{progress.iteration} of {progress.total}",
        "steps per second": f"{progress.steps_per_second:,.0f}",
        "time left": clock(progress.left),
        "reward per second": f"{row['reward']:.3f}",
        "episode": f"{number(row['episode_s'])} s",
        "episodes that end in a fall": share(row["falls"]),
        "tracking error": f"{row['tracking_error']:.3f} m/s",
    }
    facts |= {f"  {name}": f"{value:.3f}" for name, value in terms(row).items()}
    shown = ("curriculum/", "stairs/", "bodies/")
    facts |= {name: f"{value:.3g}" for name, value in row.items() if name.startswith(shown)}
    for name, value in facts.items():
        table.add_row(name, value)
    return table


def conclude(run: Run, found: Sequence[Level], before: Sequence[Level] = ()) -> None:
    """Print what a policy can do, the time of training, and how to see it.

    Args:
        run: the run.
        found: levels of its review.
        before: the same levels with the policy that it started from; empty if there is none.
    """
    print(f"after {run.seconds() / 60:.1f} min of training, {_steps(run)} steps:")
    for i, one in enumerate(found):
        then = f" (before: {_stays(before[i])})" if before else ""
        print(f"  {_asked(one)}: {_stays(one)}{then}")
    print(verdict(found, run.done()))
    if before and run.plan.origin and (text := worse(found, before)):
        print(f"it does worse than {run.plan.origin.run}, which it started from: {text}")
    print(f"see it with: draft play {run.folder}")


def conclude_mixed(run: Run, found: Sequence[Kind]) -> None:
    """Print what a policy of several topologies can do with bodies of each, and how to see it.

    Args:
        run: the run.
        found: its review.
    """
    print(f"after {run.seconds() / 60:.1f} min of training, {_steps(run)} steps:")
    table = Table(box=None, pad_edge=False)
    table.add_column("robots")
    for heading in ("bodies", "asked [m/s]", "walks at [m/s]", "error [m/s]", "stay up"):
        table.add_column(heading, justify="right")
    for kind in found:
        for i, one in enumerate(kind.levels):
            table.add_row(
                *((kind.name, str(kind.bodies)) if i == 0 else ("", "")),
                f"{one.level:.2f}",
                *(f"{x:.2f}" if math.isfinite(x) else "-" for x in (one.speed, one.error)),
                f"{one.up} of {one.robots}",
            )
    console().print(table)
    print(f"see it with: draft play {run.folder}")


def worse(found: Sequence[Level], before: Sequence[Level]) -> str | None:
    """Return where a policy does worse than the one that its training started from, in words.

    It does worse where fewer robots stay up or commands are missed by more, each by more than
    `verdict` lets pass. None if that is nowhere.

    Args:
        found: levels of the review.
        before: the same levels with the policy that the run started from.
    """
    where = [
        _asked(now)
        for now, then in zip(found, before, strict=True)
        if then.up - now.up > (1 - UPRIGHT) * now.robots
        or (now.test == SPEED and now.error - then.error > max(MISS, MISSED_SHARE * now.level))
    ]
    return ", ".join(where) or None


def verdict(found: Sequence[Level], iterations: int) -> str:
    """Return whether a robot walks at the commands of a review, in words.

    Args:
        found: levels of the review.
        iterations: number of iterations so far.
    """
    asked = [one for one in found if one.test == SPEED]
    fell = sum(one.robots - one.up for one in asked)
    falls = f"{fell} of {sum(one.robots for one in asked)} fall" if fell else "none falls"
    missed = [
        one
        for one in asked
        if one.up < UPRIGHT * one.robots or not one.error <= max(MISS, MISSED_SHARE * one.level)
    ]
    if missed:
        speeds = ", ".join(f"{one.level:g}" for one in missed)
        more = f"to train it for longer, repeat the command with --iterations {2 * iterations}"
        return f"it does not walk as asked at {speeds} m/s yet, and {falls}; {more}"
    worst = max(one.error for one in asked)
    return f"it walks: commands are met within {worst:.2f} m/s, and {falls}"


def _asked(one: Level) -> str:
    if one.test == SPEED:
        return f"asked for {one.level:.2f} m/s"
    if one.test == PUSH:
        return f"kicked with up to {one.level:g} m/s"
    return f"steps of {one.level:g} m {'up' if one.test == ASCENT else 'down'}"


def _stays(one: Level) -> str:
    up = f"{one.up} of {one.robots} stay up"
    if one.test != SPEED:
        return up
    return f"walks at {one.speed:.2f} m/s, {up}" if math.isfinite(one.speed) else f"falls, {up}"


def _steps(run: Run) -> str:
    steps = run.done() * run.plan.environments * run.plan.config.learning.steps
    return f"{steps / 1e6:.1f} million"
