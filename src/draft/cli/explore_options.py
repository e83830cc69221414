"""Options of screen, sweep and optimise, their robot, and their progress bar."""

from __future__ import annotations

import json as json_
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.interrupted import AGAIN
from draft.cli.spelling import spelt
from draft.design import Design
from draft.design.references import find_design
from draft.errors import counted
from draft.spec import Spec

if TYPE_CHECKING:
    from draft.explore.runs import Progress, Rows

Vary = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        metavar="NAME=LOW:HIGH[:log] ...",
        help="Ranges, or NAME=A,B,C: thigh_length=0.2:0.7 actuators.leg.peak_torque=40:500:log.",
        help_behavior_hint="(required)",
    ),
]
Number = Annotated[str, tyro.conf.arg(metavar="N", help="Number of designs, such as 1e6.")]
Where = Annotated[
    str | None,
    tyro.conf.arg(
        metavar="CONDITION",
        help='Condition on the rows to keep, such as "accepted and leg.mass < 1".',
        help_behavior_hint="(default: all)",
    ),
]
Metrics = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        metavar="NAME ...",
        help="Metrics to compute, one column each.",
        help_behavior_hint="(default: all that apply)",
    ),
]
Sampler = Annotated[
    Literal["sobol", "grid", "random"], tyro.conf.arg(help="Method by which designs are drawn.")
]
Seed = Annotated[int, tyro.conf.arg(metavar="N", help="Seed of the sampler.")]
Outside = Annotated[
    bool,
    tyro.conf.arg(
        help="Measure learned metrics outside the policy's region of validity too, as of imports."
    ),
]
PARTS_KEPT = f"the parts done so far are kept; {AGAIN}"
Workers = Annotated[int, tyro.conf.arg(metavar="N", help="Number of processes.")]


def robot(reference: str, design: str | None) -> Spec | Design:
    """Return the robot around which designs are drawn; a design's own values hold for all.

    Raises:
        DraftError: there is no such robot or design.
    """
    choice = find_design(reference, design)
    return choice.spec if choice.design is None else choice.resolve()


def print_policy(policy: str | None) -> None:
    """Print the iteration of the policy of learned metrics on stderr; nothing for the shipped one.

    Raises:
        DraftError: it cannot be read, or does not observe its design.
    """
    if policy is not None:
        from draft.learn.measuring.policies import open_source

        print(spelt(open_source(policy).line), file=sys.stderr, flush=True)


@contextmanager
def bar(what: str, asked: str | None = None, at_once: bool = False) -> Iterator[Progress]:
    """Show a progress bar on stderr; without a terminal lines, every few seconds.

    Args:
        what: label of the bar.
        asked: number of designs on the command line, to print what a grid rounds it to.
        at_once: whether to print a line for 0 too.
    """
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    from draft.cli.display.lines import Lines

    console = Console(stderr=True, emoji=False)
    columns = (*Bar.get_default_columns(), MofNCompleteColumn(), TimeElapsedColumn())
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as shown:
        task = shown.add_task(what, total=None)
        lines = Lines(what, at_once)
        started = False

        def progress(done: int, total: int) -> None:
            nonlocal started
            if not started and asked is not None and float(asked) != total:
                note = f"a grid of {counted(total, 'design', ',')} (asked for {asked})"
                shown.console.print(note, soft_wrap=True, highlight=False)
            started = True
            shown.update(task, completed=done, total=total)
            if not console.is_terminal:
                lines.tell(done, total)

        yield progress


def print_rows(rows: Rows, out: str, json: bool) -> None:
    """Print the counts of a run, or the whole record as JSON."""
    if json:
        print(json_.dumps(asdict(rows) | {"out": out}, indent=1))
        return
    print(f"{counted(rows.designs, 'design', ',')}, {rows.rows:,} kept, {rows.dropped:,} dropped")
    refused = ", ".join(f"{kind} {count:,}" for kind, count in rows.refused_by.items())
    print(f"of those kept {rows.accepted:,} accepted" + f"; refused: {refused}" * bool(refused))
    if rows.computed:
        rate = rows.computed / rows.seconds
        print(f"written to {out} in {rows.seconds:.1f} s ({rate:,.0f} designs/s)")
    else:
        print(f"{out} was complete already")
