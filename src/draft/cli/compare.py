"""`draft compare`: designs side by side, and why they differ."""

from __future__ import annotations

import json as jsons
import math
from typing import Annotated

import numpy as np
import tyro
from rich.table import Table

from draft.cli.display.verdict import console
from draft.cli.options import DESIGN_FORMS, JsonOutput
from draft.cli.sensitivity import USUAL, signed
from draft.design.references import open_designs
from draft.errors import DraftError
from draft.explore.comparison import DesignComparison, Part, compare
from draft.metrics import find
from draft.values import brief

_SMALL = 0.005  # Share of a difference below which a number is left out of the table.


def main(
    references: Annotated[
        tyro.conf.Positional[tuple[str, ...]],
        tyro.conf.arg(
            metavar="DESIGN DESIGN ...",
            help=f"Two designs or more; the others are compared with the first: {DESIGN_FORMS}.",
            help_behavior_hint="(required)",
        ),
    ] = (),
    /,
    *,
    of: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="METRIC ...",
            help="Metrics whose differences are divided, of those that need no model.",
            help_behavior_hint=f"(default: {', '.join(USUAL)})",
        ),
    ] = (),
    seed: Annotated[
        int, tyro.conf.arg(metavar="N", help="Seed of the samples of the laws' errors.")
    ] = 0,
    json: JsonOutput = False,
) -> int:
    """Show designs side by side, which changed number makes what difference, and how sure it is."""
    if len(references) < 2:
        raise DraftError("two designs or more are compared", "such as draft compare cheetah bear")
    found = compare(open_designs(references), of, seed=seed)
    if json:
        print(jsons.dumps(found.record(), indent=2, allow_nan=False))
        return 0
    _print(found, of or USUAL)
    return 0


def _print(found: DesignComparison, divided: tuple[str, ...]) -> None:
    out = console()
    out.print(_metrics(found))
    for design, part in zip(found.designs[1:], found.parts, strict=True):
        heading = f"from {found.designs[0].reference} to {design.reference}"
        if part is None:
            out.print(f"\n{heading}: another robot, so no number of one is one of the other")
            continue
        chosen = [found.metrics.index(name) for name in divided if name in found.metrics]
        out.print("", _parts(found, part, chosen, heading))
        if not part.exact:
            out.print("shares of many numbers, by samples of their orders", style="dim")
    for design, messages in zip(found.designs, found.findings, strict=True):
        for message in messages:
            out.print(f"{design.reference} alone: {message}", markup=False)


def _metrics(found: DesignComparison) -> Table:
    """All metrics, with the probability that each design is better than the first."""
    table = Table(box=None, pad_edge=False)
    table.add_column("metric", style="bold", no_wrap=True)
    table.add_column("", style="dim", no_wrap=True)
    for design in found.designs:
        table.add_column(design.reference.rpartition(":")[2], justify="right", no_wrap=True)
    for design, part in zip(found.designs[1:], found.parts, strict=True):
        if part is not None:
            name = design.reference.rpartition(":")[2]
            table.add_column(f"{name} better", justify="right", style="dim")
    for k, name in enumerate(found.metrics):
        metric = find(name)
        unit = "" if metric.unit == "1" else metric.unit
        values = (_value(x) for x in found.values[:, k])
        odds = (_odds(part.better[k]) for part in found.parts if part is not None)
        table.add_row(name, unit, *values, *odds)
    return table


def _parts(found: DesignComparison, part: Part, chosen: list[int], heading: str) -> Table:
    """What each number contributes to the differences of some metrics."""
    table = Table(box=None, pad_edge=False, title=heading, title_justify="left")
    table.add_column("number", style="bold", no_wrap=True)
    table.add_column("from", justify="right", no_wrap=True)
    table.add_column("to", justify="right", no_wrap=True)
    total = part.shares.sum(axis=0)
    for k in chosen:
        table.add_column(f"{found.metrics[k]}\n{signed(total[k])}", justify="right", no_wrap=True)
    small = []
    for i, name in enumerate(part.names):
        own = part.shares[i, chosen]
        larger = np.abs(part.shares[:, chosen]).max(axis=0)
        if not (np.abs(np.nan_to_num(own)) > _SMALL * np.nan_to_num(larger)).any():
            small.append(name)
            continue
        cells = ("" if not x else signed(x) for x in own)
        short = name.removeprefix("actuators.")
        table.add_row(short, part.before[i], part.after[i], *cells)
    if small:
        table.caption = f"without effect on these: {', '.join(small)}"
        table.caption_justify = "left"
    return table


def _value(x: float) -> str:
    if math.isnan(x):
        return "-"
    return "no limit" if math.isinf(x) else brief(x)


def _odds(share: float) -> str:
    if math.isnan(share):
        return ""
    if 0.005 <= share <= 0.995:
        return f"{100 * share:.0f} %"
    return "> 99 %" if share > 0.5 else "< 1 %"
