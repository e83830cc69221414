"""Options of screen, sweep and optimise, their robot, and their progress bar."""

from __future__ import annotations

import json as json_
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from draft.cli.interrupted import AGAIN, if_interrupted
from draft.cli.options import parse_values
from draft.cli.settings_options import Command, with_options
from draft.cli.spelling import spelt
from draft.design import Design
from draft.design.references import find_design
from draft.errors import counted
from draft.explore.settings import Progress, Sampled, Varied
from draft.metrics.registry import USUAL
from draft.spec import Spec
from draft.variation.axes import Range, ranges

if TYPE_CHECKING:
    from draft.explore.rows import Rows

_varied = partial(
    tyro.conf.arg,
    metavar="NAME=LOW:HIGH[:log] ...",
    help="Ranges, or NAME=A,B,C: thigh_length=0.2:0.7 actuators.leg.peak_torque=40:500:log.",
)
Vary = Annotated[tuple[str, ...], _varied(help_behavior_hint="(required)")]
VaryToo = Annotated[tuple[str, ...], _varied(help_behavior_hint="(default: none)")]
VaryAny = Annotated[tuple[str, ...], _varied(help_behavior_hint="(default: all that are stated)")]
OfMetrics = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        metavar="METRIC ...",
        help="Metrics, which 'draft metrics' lists.",
        help_behavior_hint=f"(default: {', '.join(USUAL)})",
    ),
]
PARTS_KEPT = f"the parts done so far are kept; {AGAIN}"


def options(kind: type[Varied]) -> Callable[[Command], Command]:
    """Give a command an option for each setting of a run over many designs."""
    return with_options(
        kind,
        without=("values", "progress"),
        read={"vary": _ranges},
        defaults={"vary": (), "workers": 2},
    )


def _ranges(words: Vary) -> Mapping[str, Range]:
    return ranges(words)


def given(
    settings: Varied, values: Sequence[str], payload: float | None, progress: Progress
) -> dict[str, Any]:
    """Return settings as keyword arguments, with the values and the progress of a command."""
    return dict(settings) | {"values": parse_values(values, payload), "progress": progress}


def robot(reference: str, design: str | None) -> Spec | Design:
    """Return the robot around which designs are drawn; a design's own values hold for all.

    Raises:
        DraftError: there is no such robot or design.
    """
    choice = find_design(reference, design)
    return choice.spec if choice.design is None else choice.resolve()


def print_policy(policy: str | Path | None, subject: Spec | Design) -> None:
    """Print the iteration of the policy of learned metrics on stderr; nothing for the shipped one.

    Raises:
        DraftError: it cannot be read, or does not observe its design.
    """
    if policy is not None:
        from draft.learn.measuring.policies import source_for

        design = subject.resolve() if isinstance(subject, Spec) else subject
        print(spelt(source_for(policy, design).line), file=sys.stderr, flush=True)


@contextmanager
def bar(what: str, asked: int | None = None, at_once: bool = False) -> Iterator[Progress]:
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
            if not started and asked is not None and asked != total:
                note = f"a grid of {counted(total, 'design', ',')} (asked for {asked:,})"
                shown.console.print(note, soft_wrap=True, highlight=False)
            started = True
            shown.update(task, completed=done, total=total)
            if not console.is_terminal:
                lines.tell(done, total)

        yield progress


def run_rows(
    run: Callable[..., Rows],
    robot: Spec | Design,
    settings: Sampled,
    out: str,
    values: Sequence[str],
    payload: float | None,
    json: bool,
) -> int:
    """Run a screen or a sweep, and print its counts, or the whole record as JSON.

    Args:
        run: `draft.screen` or `draft.sweep`.
        robot: the robot.
        settings: settings of the run.
        out: file or folder that it writes.
        values: words of --set.
        payload: mass on the trunk [kg].
        json: whether to print JSON.

    Returns:
        The exit code.
    """
    asked = None if json else settings.n
    with if_interrupted(PARTS_KEPT), bar(run.__name__, asked) as progress:
        rows = run(robot, **given(settings, values, payload, progress))
    if json:
        print(json_.dumps(asdict(rows) | {"out": out}, indent=1))
        return 0
    print(f"{counted(rows.designs, 'design', ',')}, {rows.rows:,} kept, {rows.dropped:,} dropped")
    refused = ", ".join(f"{kind} {count:,}" for kind, count in rows.refused_by.items())
    print(f"of those kept {rows.accepted:,} accepted" + f"; refused: {refused}" * bool(refused))
    if rows.computed:
        rate = rows.computed / rows.seconds
        print(f"written to {out} in {rows.seconds:.1f} s ({rate:,.0f} designs/s)")
    else:
        print(f"{out} was complete already")
    return 0
