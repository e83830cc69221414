"""`draft compare`: designs side by side, why they differ, and what limits each."""

from __future__ import annotations

import json as jsons
from typing import Annotated

import tyro
from rich.table import Table

from draft.cli.display.verdict import console
from draft.cli.explore_options import OfMetrics
from draft.cli.options import DESIGN_FORMS, JsonOutput
from draft.design.references import open_designs
from draft.errors import DraftError
from draft.explore.comparison import compare
from draft.explore.comparison_tables import TextTable, section


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
    of: OfMetrics = (),
    seed: Annotated[
        int, tyro.conf.arg(metavar="N", help="Seed of the samples of the laws' errors.")
    ] = 0,
    json: JsonOutput = False,
) -> int:
    """Show designs side by side, which number makes what difference, and what limits.

    Metrics are those that need no model, each with the probability that a design is better than the
    first.
    """
    if len(references) < 2:
        raise DraftError("two designs or more are compared", "such as draft compare cheetah bear")
    found = compare(open_designs(references), of, seed=seed)
    if json:
        print(jsons.dumps(found.record(), indent=2, allow_nan=False))
        return 0
    out, shown = console(), section(found, of)
    out.print(_table(shown.metrics, left=2))
    for one in shown.shares:
        out.print()
        out.print(one if isinstance(one, str) else _table(one), markup=False)
    if shown.limits.rows:
        out.print("", _table(shown.limits, left=5))
    for line in shown.alone:
        out.print(line, markup=False)
    return 0


def _table(of: TextTable, left: int = 1) -> Table:
    """Table of a terminal.

    Args:
        of: its text.
        left: columns that are aligned to the left; the others are numbers.
    """
    table = Table(box=None, pad_edge=False, title=of.title or None, title_justify="left")
    for k, head in enumerate(of.head):
        words = k < left
        table.add_column(
            head,
            style="bold" if k == 0 else ("dim" if not head else None),
            justify="left" if words else "right",
            no_wrap=left < len(of.head),
        )
    for row in of.rows:
        table.add_row(*row)
    table.caption = of.note or None
    table.caption_justify = "left"
    return table
