"""What screen, sweep and optimise share: what is varied, base values, a progress bar."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from draft.cli.options import parse_values
from draft.errors import DraftError, Problem
from draft.spec import Spec
from draft.spec.load import read_design

if TYPE_CHECKING:
    from draft.explore.screen import Watch

Vary = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        metavar="NAME=LOW:HIGH[:log]",
        help="Ranges, or NAME=A,B,C: thigh_length=0.2:0.7 actuators.leg.peak_torque=40:500:log",
        help_behavior_hint="",
    ),
]
Number = Annotated[str, tyro.conf.arg(metavar="N", help="How many designs; may be written 1e6.")]
Where = Annotated[
    str | None,
    tyro.conf.arg(
        metavar="CONDITION",
        help='Rows that are kept, such as "accepted and leg.mass < 1".',
        help_behavior_hint="(default: all)",
    ),
]
Metrics = Annotated[
    tuple[str, ...],
    tyro.conf.arg(metavar="NAME", help="Columns.", help_behavior_hint="(default: all it can)"),
]
Sampler = Annotated[
    Literal["sobol", "grid", "random"], tyro.conf.arg(help="How designs are drawn.")
]
Seed = Annotated[int, tyro.conf.arg(help="Seed of the sampler.")]
Workers = Annotated[int, tyro.conf.arg(help="Processes.")]


def base(spec: Spec, design: str | None, values: Sequence[str]) -> dict[str, float | str | None]:
    """Values that hold for all designs: those of a named design, then those of `--set`.

    Raises:
        DraftError: no such design, or a word that is not NAME=VALUE.
    """
    table: dict[str, float | str | None] = {}
    if design is not None:
        named = Path(design) if design.endswith((".yaml", ".yml")) else design
        table.update(read_design(spec, named).values)
    return table | parse_values(values)


def check_workers(workers: int) -> None:
    """Hold the number of processes to what a machine has.

    Raises:
        DraftError: it is below 1 or beyond all machines.
    """
    if not 1 <= workers <= 1024:
        raise DraftError(Problem(f"--workers {workers} is not from 1 to 1024", None, "such as 2"))


@contextmanager
def bar(what: str, total: int) -> Iterator[Watch]:
    """A progress bar on stderr, on terminals only."""
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn

    console = Console(stderr=True, emoji=False)
    columns = (*Progress.get_default_columns(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as progress:
        task = progress.add_task(what, total=total)
        yield lambda done: progress.update(task, completed=done)


def rounded_words(asked: str, n: int) -> str:
    """Say what a grid made of the number of designs that was asked for; "" where it is kept."""
    return "" if float(asked) == n else f"a grid of {n:,} designs (asked for {asked})"


def check_file(out: Path) -> None:
    """Refuse an --out that is a folder, or nothing.

    Raises:
        DraftError: it is.
    """
    if not out.name or out.is_dir():
        cause = f"--out '{out}' is a folder"
        raise DraftError(Problem(cause, None, "name a file, such as screen.parquet"))


def print_summary(summary: dict[str, Any], out: str) -> None:
    """Print what came of a run."""
    computed, seconds = summary["computed"], summary["seconds"]
    print(
        f"{summary['designs']:,} designs, {summary['rows']:,} kept, {summary['dropped']:,} dropped"
    )
    refused = ", ".join(f"{kind} {count:,}" for kind, count in summary["refused_by"].items())
    print(
        f"of those kept {summary['accepted']:,} accepted"
        + (f"; refused: {refused}" * bool(refused))
    )
    if computed:
        print(f"written to {out} in {seconds:.1f} s ({computed / seconds:,.0f} designs/s)")
    else:
        print(f"{out} was complete already")
