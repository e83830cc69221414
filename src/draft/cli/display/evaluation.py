"""Terminal output of `draft evaluate`: a progress bar, and a table of results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import TracebackType

from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.table import Table

from draft.cli.display.lines import Lines
from draft.cli.display.verdict import console
from draft.learn.measuring.bands import mass_bands
from draft.learn.measuring.evaluation_options import Extras
from draft.learn.measuring.summary import Measured, Summary, Supply
from draft.learn.measuring.utilisation import NEAR, Limiting
from draft.metrics.capabilities import CAPABILITIES

Row = tuple[str, Measured]


class Bar:
    """Progress bar of an evaluation; without a terminal lines, every few seconds."""

    def __init__(self) -> None:
        out = console()
        columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
        self._progress = Progress(
            *columns, console=out, transient=True, disable=not out.is_terminal
        )
        self._tasks: dict[str, TaskID] = {}
        self._lines = None if out.is_terminal else Lines("evaluate")

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
        """Show a finished step."""
        if names not in self._tasks:
            self._tasks[names] = self._progress.add_task(names, total=steps)
            self._lines = self._lines and Lines(f"evaluate {names}: step")
        if self._lines is not None:
            self._lines.tell(step, steps)
        self._progress.update(self._tasks[names], completed=step)


def show(summaries: Sequence[Summary]) -> None:
    """Print a table for each stage with a row per run and design, then reasons and flags."""
    out = console()
    for stage in dict.fromkeys(summary.stage for summary in summaries):
        of = [summary for summary in summaries if summary.stage == stage]
        rows = [row for summary in of for row in _designs(summary)]
        out.print(_table(stage, rows))
        known = {name: None for _, one in rows for name, x in one.scalars.items() if x is not None}
        if bands := mass_bands(name for name in known if name in CAPABILITIES):
            out.print(bands, style="dim", markup=False)
        for heading, numbers in rows:
            for reason, names in _grouped(numbers.reasons).items():
                out.print(f"{heading}: no {', '.join(names)}: {reason}", markup=False)
            of_battery = any(_of_battery(name, value) for name, value in numbers.scalars.items())
            if of_battery and numbers.supply is not None:
                out.print(f"{heading}: {_supply(numbers.supply)}", markup=False)
        for summary in of:
            for flag in summary.flags:
                out.print(f"{_heading(summary)}: {flag}", style="yellow", markup=False)


def _table(stage: str, rows: Sequence[Row]) -> Table:
    names = [name for name in CAPABILITIES if any(name in numbers.scalars for _, numbers in rows)]
    table = Table(box=None, pad_edge=False, title=f"stage {stage}", title_justify="left")
    table.add_column("run", no_wrap=True)
    for name in names:
        table.add_column(escape(CAPABILITIES[name].title), justify="right")
    table.add_column("limited by")
    for heading, numbers in rows:
        values = (_written(numbers.scalars.get(name)) for name in names)
        table.add_row(heading, *values, _limits(numbers.limiting))
    return table


def _designs(summary: Summary) -> Iterator[Row]:
    """Yield heading and numbers of each design."""
    if not summary.by_member:
        yield _heading(summary), summary
        return
    for name, numbers in summary.by_member.items():
        yield _heading(summary, name), numbers


def _heading(summary: Summary, design: str | None = None) -> str:
    """Return design, seed, and settings that differ from the defaults."""
    name = (design or summary.design).rpartition(":")[2]
    words = (summary.arm, summary.errors, summary.protocol)
    unusual = [word for word in words if word not in ("nominal", None, "twins", "walking")]
    said = {"payload": "with {:g} kg", "regeneration": "regenerating {:g}"}
    for setting, value in summary.model_dump(include={*Extras.model_fields}).items():
        if value != Extras.model_fields[setting].default:
            words = said.get(setting, f"{setting.replace('_', ' ')} {{:g}}")
            unusual.append(words.format(value))
    return " ".join([name, f"seed {summary.seed}", *unusual])


def _of_battery(name: str, value: float | None) -> bool:
    """Whether a scalar depends on the battery, and has a value."""
    return name.endswith("range") and value is not None


def _supply(supply: Supply) -> str:
    """Return what range and endurance rest on."""
    energy, (low, high) = supply.energy_wh, supply.band_of_energy_wh
    band = f" (90 % band {low:.0f} .. {high:.0f})" if high > low else ""
    drawn = "the motors alone"
    if supply.electronics_w:
        drawn = f"the motors and of {supply.electronics_w:.0f} W of electronics, "
        drawn += supply.electronics_origin
    return (
        f"range and endurance are those of {drawn}, on a battery of {energy:.0f} Wh{band}, "
        f"{supply.origin}"
    )


def _written(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _limits(found: Mapping[str, Limiting | None]) -> str:
    """Return the limiting joint of each test, or that the nearest to its limit is not near."""
    return "\n".join(
        f"{test}: {'none; nearest ' * ((of['value'] or 0.0) < NEAR)}"
        f"{of['joint']}, {of['by']} {of['value'] or 0.0:.2f}"
        for test, of in found.items()
        if of is not None
    )


def _grouped(reasons: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the scalars without a value, by reason."""
    found: dict[str, list[str]] = {}
    for name, reason in reasons.items():
        found.setdefault(reason, []).append(name)
    return found
