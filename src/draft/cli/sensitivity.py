"""`draft sensitivity`: what a change of each number of a design does to its metrics."""

from __future__ import annotations

import json as jsons
import math
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from rich.table import Table
from rich.text import Text

from draft.cli import explore_options as x
from draft.cli.display.verdict import console, verdict
from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import DesignArgument, DesignName, JsonOutput, Payload, Values, open_design
from draft.cli.settings_options import with_options
from draft.errors import DraftError
from draft.explore.settings import EffectSettings
from draft.metrics import LEARNED, find
from draft.metrics.registry import USUAL, of_spec
from draft.values import brief, signed

if TYPE_CHECKING:
    from draft.design import Design
    from draft.explore.sensitivity import Sensitivity

_CHANCE = "~0"  # A change that chance may explain.
_NUMBER, _CELL = 44, 28  # Width of the first columns of a table, and of a metric.


@with_options(EffectSettings, without=("progress",))
def main(
    reference: DesignArgument,
    /,
    *,
    of: x.OfMetrics = (),
    by: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="NAME ...",
            help="Parameters, and quantities of actuators such as actuators.leg.peak_torque.",
            help_behavior_hint="(default: all that the design states as numbers)",
        ),
    ] = (),
    vary: x.VaryToo = (),
    screen: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="FILE.parquet",
            help="Take the ranges of --vary from a file of 'draft screen'.",
            help_behavior_hint="(default: those of --vary)",
        ),
    ] = None,
    n: Annotated[
        int,
        tyro.conf.arg(
            metavar="N", help="Samples of --vary: N (ranges + 2) designs, N a power of two."
        ),
    ] = 1024,
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    seed: Annotated[int, tyro.conf.arg(metavar="N", help="Seed of the samples.")] = 0,
    figure: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="FILE",
            help="Draw the effects of the steps as bars (extra figures): a .png, .pdf or .svg.",
            help_behavior_hint="(default: no figure)",
        ),
    ] = None,
    rolled: EffectSettings,
    json: JsonOutput = False,
) -> int:
    """Show what a change of each number of a design does to its metrics, and how sure that is.

    Learned metrics are measured by roll-outs of the design and of a step more and less of each
    number (the extra learn; about half a minute for ten numbers).

    With --vary it is over ranges: Sobol indices, the shares of the variance of each metric that a
    number explains alone, and that it has a part in (extra explore).
    """
    from draft.explore.sensitivity import sensitivity

    resolved, _ = open_design(reference, design, values, payload)
    if vary or screen is not None:
        if by:
            raise DraftError("--by names single numbers, and --vary ranges", "omit one of them")
        return _over_ranges(resolved, vary, screen, of, n, seed, figure, json)
    learned = any(name in LEARNED for name in of)
    if learned:
        x.print_policy(rolled.policy, resolved)
    elif rolled.policy is not None:
        raise DraftError("--policy is for learned metrics", "add --of learned.top_speed")
    with if_interrupted(NOTHING), x.bar("bodies") if learned else nullcontext() as progress:
        found = sensitivity(
            resolved,
            of or (() if json else tuple(of_spec(resolved.spec, USUAL))),
            by,
            seed=seed,
            replicas=rolled.replicas,
            policy=rolled.policy,
            progress=progress,
        )
    if figure is not None:
        from draft.explore.sensitivity_figure import save

        save(found, figure)
    if json:
        print(jsons.dumps(found.record(), indent=2, allow_nan=False))
        return 0
    _print(found)
    if figure is not None:
        print(figure)
    return 0


def _over_ranges(
    design: Design,
    vary: tuple[str, ...],
    screen: Path | None,
    of: tuple[str, ...],
    n: int,
    seed: int,
    figure: Path | None,
    json: bool,
) -> int:
    """Print Sobol indices."""
    from draft.explore.indices import ranges_of_screen, sobol_indices

    if vary and screen is not None:
        raise DraftError("both --vary and --screen give ranges", "omit one of them")
    chosen = vary if screen is None else ranges_of_screen(screen)
    usual = () if json else tuple(of_spec(design.spec, USUAL))
    found = sobol_indices(design, chosen, of or usual, n=n, seed=seed)
    if figure is not None:
        from draft.explore.sensitivity_figure import save_indices

        save_indices(found, figure)
    if json:
        print(jsons.dumps(found.record(), indent=2, allow_nan=False))
        return 0
    out = console()
    title = f"shares of the variance, alone / with others, over {found.designs:,} designs"
    table = Table(box=None, pad_edge=False, title=title, title_justify="left", title_style="dim")
    table.add_column("number", style="bold", no_wrap=True)
    table.add_column("range", no_wrap=True)
    for k, name in enumerate(found.metrics):
        metric = find(name)
        unit = "" if metric.unit == "1" else f" {metric.unit}"
        ends = f"{brief(found.mean[k])} ± {brief(found.deviation[k])}{unit}"
        table.add_column(f"{name}\n{ends}", justify="right")
    for i, name in enumerate(found.names):
        cells = (
            "-"
            if math.isnan(found.first[i, k])
            else f"{found.first[i, k]:.2f} / {found.total[i, k]:.2f} ±{found.total_width[i, k]:.2f}"
            for k in range(len(found.metrics))
        )
        table.add_row(_short(name), found.ranges[i], *cells)
    out.print(table)
    for text in found.warnings():
        out.print(text, style="yellow", markup=False)
    if figure is not None:
        print(figure)
    return 0


def _print(found: Sensitivity) -> None:
    out = console()
    out.print(Text(verdict(found.design), style="bold"))
    shown = [i for i, still in enumerate(found.still) if not still]
    if found.learned.any():  # The largest effects first.
        first = int(found.learned.argmax())
        shown.sort(key=lambda i: -found.sizes[i, first])
    wide = max(1, (out.width - _NUMBER) // _CELL)
    for start in range(0, len(found.metrics), wide):
        chosen = range(start, min(start + wide, len(found.metrics)))
        out.print("", _table(found, shown, chosen))
    if still := [name for name, one in zip(found.names, found.still, strict=True) if one]:
        words = "without effect" if not found.learned.any() else "no effect beyond chance"
        out.print(f"\n{words}: {', '.join(still)}", markup=False)
    for i in shown:
        for step, text in ((0, "less"), (2, "more")):
            if found.accepted[i, step] != found.accepted[i, 1]:
                word = "accepts" if found.accepted[i, step] else "refuses"
                size = f"{brief(found.steps[i])} {found.units[i]}".rstrip()
                out.print(f"{found.names[i]}: {size} {text}, and the filter {word} it")
    for note in found.notes:
        out.print(note, style="dim", markup=False)


def _table(found: Sensitivity, shown: list[int], chosen: range) -> Table:
    """One row per number: its step, and of each metric the change and the change of 1 %."""
    title = "change for a step (90 % band of it by the laws' errors), and for 1 % more"
    if found.learned.any():
        title += "; of learned metrics for a step (95 % interval over roll-outs)"
    table = Table(box=None, pad_edge=False, title=title, title_justify="left", title_style="dim")
    table.add_column("number", style="bold", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("step", justify="right", no_wrap=True)
    for k in chosen:
        metric = find(found.metrics[k])
        unit = "" if metric.unit == "1" else f" {metric.unit}"
        table.add_column(f"{metric.name}\n{brief(found.base[k])}{unit}", justify="right")
    for i in shown:
        size = f"+{brief(found.steps[i])} {found.units[i]}".rstrip()
        cells = (_cell(found, i, k) for k in chosen)
        table.add_row(_short(found.names[i]), brief(found.values[i]), size, *cells)
    return table


def _cell(found: Sensitivity, i: int, k: int) -> str:
    change = found.step_up[i, k]
    other = -found.step_down[i, k]
    if math.isnan(change) and math.isnan(other):
        return "-"
    if change == other == 0 or not found.sizes[i, k]:
        return ""
    if found.learned[k]:
        more = _side(change, found.low[i, k], found.high[i, k])
        less = _side(other, -found.down_high[i, k], -found.down_low[i, k])
        return more if more != _CHANCE and not found.kinked[i, k] else f"{more} | {less}"
    text = signed(change)
    if found.kinked[i, k]:
        text += f" | {signed(other)}"
    low, high = found.low[i, k], found.high[i, k]
    if not math.isnan(low) and signed(low) != signed(high):
        text += f" ({signed(low)}..{signed(high)})"
    percent = found.up[i, k]
    return f"{text}\n{100 * percent:+.2g} %" if percent and not math.isnan(percent) else text


def _side(change: float, low: float, high: float) -> str:
    """A change by roll-outs with its interval, if that excludes zero."""
    if math.isnan(change):
        return "-"
    return f"{signed(change)} ({signed(low)}..{signed(high)})" if low > 0 or high < 0 else _CHANCE


def _short(name: str) -> str:
    return name.removeprefix("actuators.")
