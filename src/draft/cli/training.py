"""How training is shown: a table that renews itself, or lines where nobody looks."""

from __future__ import annotations

import math
import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING

from rich.live import Live
from rich.table import Table

from draft.cli.verdict import console

if TYPE_CHECKING:
    from draft.learn.lab.trainer import Progress

_LINE_SECONDS = 5.0


class Screen:
    """Shows progress; `tell` is called after every iteration."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._console = console()
        self._live: Live | None = None
        self._told = -math.inf

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
        """Show an iteration; lines come no more often than every few seconds, and for the last."""
        if self._live is not None:
            self._live.update(_table(self._title, progress), refresh=True)
            return
        now = time.monotonic()
        if now - self._told >= _LINE_SECONDS or progress.iteration == progress.total:
            self._told = now
            print(_line(progress))
            sys.stdout.flush()


def _line(progress: Progress) -> str:
    row = progress.row
    terms = " ".join(f"{name} {value:.2f}" for name, value in _terms(row).items())
    return (
        f"iteration {progress.iteration}/{progress.total}  {progress.steps_per_second:,.0f} steps/s"
        f"  reward {row['reward']:.2f}/s  episode {_number(row['episode_s'])} s"
        f"  falls {_share(row['falls'])}  error {row['tracking_error']:.2f} m/s"
        f"  left {_time(progress.left)}\n  {terms}"
    )


def _table(title: str, progress: Progress) -> Table:
    row = progress.row
    table = Table(title=title, title_justify="left", show_header=False, box=None)
    table.add_column(style="dim")
    table.add_column(justify="right")
    facts = {
        "iteration": f"{progress.iteration} of {progress.total}",
        "steps per second": f"{progress.steps_per_second:,.0f}",
        "time left": _time(progress.left),
        "reward per second": f"{row['reward']:.3f}",
        "episode": f"{_number(row['episode_s'])} s",
        "episodes that end in a fall": _share(row["falls"]),
        "tracking error": f"{row['tracking_error']:.3f} m/s",
    }
    facts |= {f"  {name}": f"{value:.3f}" for name, value in _terms(row).items()}
    facts |= {n: f"{v:.3g}" for n, v in row.items() if n.startswith(("curriculum/", "stairs/"))}
    for name, value in facts.items():
        table.add_row(name, value)
    return table


def _terms(row: dict[str, float]) -> dict[str, float]:
    """Reward terms by name, weighted, per second."""
    return {n.removeprefix("reward/"): v for n, v in row.items() if n.startswith("reward/")}


def _number(value: float) -> str:
    return f"{value:.1f}" if math.isfinite(value) else "-"


def _share(value: float) -> str:
    return f"{value:.0%}" if math.isfinite(value) else "-"


def _time(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
