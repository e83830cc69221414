"""How evaluations are shown: how far one is, and a table of what they found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import TracebackType
from typing import Any

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from draft.cli.verdict import console

# Scalars: unit, and how they are written.
_SHOWN = {
    "walk_speed": "m/s",
    "walk_survival": "share",
    "top_speed": "m/s",
    "top_speed_normalised": "v / sqrt(g L)",
    "peak_command": "m/s",
    "eta": "1",
    "step": "m",
    "step_ascent": "m",
    "step_descent": "m",
    "step_normalised": "h / L",
    "kick": "m/s",
    "kick_normalised": "v / sqrt(g L)",
}


class Bar:
    """Shows how far an evaluation is, where somebody looks."""

    def __init__(self) -> None:
        out = console()
        columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
        self._progress = Progress(
            *columns, console=out, transient=True, disable=not out.is_terminal
        )
        self._tasks: dict[str, Any] = {}

    def __enter__(self) -> Bar:
        self._progress.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._progress.__exit__(kind, error, trace)

    def tell(self, names: str, step: int, steps: int) -> None:
        """Show that a step is done."""
        if names not in self._tasks:
            self._tasks[names] = self._progress.add_task(names, total=steps)
        self._progress.update(self._tasks[names], completed=step)


def show(summaries: Sequence[Mapping[str, Any]]) -> None:
    """Print a table with a column per design and run, then what to know of them."""
    out = console()
    columns = [(name, of) for summary in summaries for name, of in _designs(summary)]
    names = [name for name in _SHOWN if any(name in of["scalars"] for _, of in columns)]
    table = Table(box=None, pad_edge=False)
    table.add_column("scalar", no_wrap=True)
    for heading, _ in columns:
        table.add_column(heading, justify="right")
    table.add_column("unit", style="dim")
    for name in names:
        table.add_row(name, *(_written(of["scalars"].get(name)) for _, of in columns), _SHOWN[name])
    if any(of["limiting"] for _, of in columns):
        table.add_row("limited by", *(_limits(of["limiting"]) for _, of in columns), "")
    out.print(table)
    for heading, of in columns:
        for reason, which in _grouped(of["reasons"]).items():
            out.print(f"{heading}: no {', '.join(which)}: {reason}", markup=False)
    for summary in summaries:
        for flag in summary["flags"]:
            out.print(f"{_heading(summary)}: {flag}", style="yellow", markup=False)


def _designs(summary: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Heading and numbers of each design."""
    members = summary.get("by_member")
    if not members:
        yield _heading(summary), summary
        return
    for name, numbers in members.items():
        yield f"{name} {summary['stage']} {summary['seed']}", numbers


def _heading(summary: Mapping[str, Any]) -> str:
    other = [summary[key] for key in ("arm", "protocol")]
    words = [word for word in other if word not in ("nominal", "walking")]
    return " ".join([summary["design"], summary["stage"], str(summary["seed"]), *words])


def _written(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _limits(found: Mapping[str, Mapping[str, Any]]) -> str:
    """Limiting joint of each battery."""
    return "\n".join(
        f"{battery}: {of['joint']}, {of['by']} {of['value']:.2f}" for battery, of in found.items()
    )


def _grouped(reasons: Mapping[str, str]) -> dict[str, list[str]]:
    """Scalars without a value, by reason."""
    found: dict[str, list[str]] = {}
    for name, reason in reasons.items():
        found.setdefault(reason, []).append(name)
    return found
