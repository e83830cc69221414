"""`draft trends`: fit the actuator trends to the catalogue, and show how well they hold."""

from __future__ import annotations

import json as json_
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from rich.table import Table
from rich.text import Text

from draft.cli.display.verdict import console
from draft.cli.options import JsonOutput
from draft.errors import counted
from draft.fitting.printed import Figure
from draft.laws.catalogue import FILE as SHIPPED
from draft.laws.catalogue import Part, with_rows

if TYPE_CHECKING:
    from draft.fitting.actuators.check import Doubt

Catalogue = Annotated[
    tuple[Path, ...],
    tyro.conf.arg(
        metavar="CSV ...",
        help="Tables of further modules. Columns: name, vendor, family, peak_torque_nm, "
        "no_load_speed_rad_s, gear_ratio, mass_kg, diameter_mm, length_mm, source, and those of "
        "the shipped table (draft/laws/data/actuators.csv).",
        help_behavior_hint="(default: only the shipped modules)",
    ),
]


def fit(
    catalogue: Catalogue = (),
    out: Annotated[
        Path,
        tyro.conf.arg(
            metavar="FILE",
            help="File of the coefficients; 'trends: NAME.json' in parameters.yaml uses it.",
        ),
    ] = Path("trends.json"),
) -> int:
    """Fit every law to the catalogue and write the file of coefficients.

    Rows that 'draft trends check' doubts are printed and fitted.
    """
    from draft.fitting.actuators import catalogue_refit as refit
    from draft.laws import actuators

    parts = _read(catalogue)
    _print_doubts(_own_doubts(parts, catalogue))
    before = actuators.laws().trends
    made = refit.actuator_trends(parts)
    refit.write(out, made)
    table = _table("law", "n", "vendor held out", "shipped")
    for quantity, law in made[actuators.DEFAULT]["laws"].items():
        held_out = f"{law['held_out']['vendor']:.3f}"
        shipped = f"{before[quantity].held_out['vendor']:.3f}"
        table.add_row(law["formula"], str(law["n"]), held_out, shipped)
    console().print(table)
    print(f"written to {out}, from {counted(len(parts), 'module')}")
    return 0


def show(json: JsonOutput = False) -> int:
    """Print the published figures beside what these tables give."""
    from draft.fitting.actuators import catalogue_published as published

    figures = published.figures()
    if json:
        print(json_.dumps({"actuators": [_record(figure) for figure in figures]}, indent=2))
        return 0
    table = _table("quantity", "figure", "published", "source", "reproduced", "", "draft")
    last = ""
    for figure in figures:
        quantity = "" if figure.quantity == last else figure.quantity.replace("_", " ")
        last = figure.quantity
        word = Text("same", "green") if figure.same else Text("differs", "yellow")
        draft = "" if figure.draft is None else f"{figure.draft:.3f}"
        cells = (figure.printed or "", figure.source, figure.ours, word if figure.printed else "")
        table.add_row(quantity, figure.name, *cells, draft)
    console().print(table)
    for figure in figures:
        if figure.note:
            print(f"\n{figure.quantity.replace('_', ' ')}, {figure.name}: {figure.note}")
    return 0 if all(figure.same or figure.note for figure in figures) else 1


def check(catalogue: Catalogue = (), json: JsonOutput = False) -> int:
    """Look for unit slips, copies and implausible rows; exit 1 if there are any.

    Rows that a source contradicts are printed too; as they are marked, they do not count.
    """
    from draft.fitting.actuators.check import check as doubts_of

    parts = _read(catalogue)
    doubts = _own_doubts(parts, catalogue) if catalogue else doubts_of(parts)
    unmarked = any(doubt.kind != "contradicted" for doubt in doubts)
    if json:
        record = {"modules": len(parts), "doubts": [doubt.record() for doubt in doubts]}
        print(json_.dumps(record, indent=2))
        return 1 if unmarked else 0
    _print_doubts(doubts)
    print(f"{counted(len(parts), 'module')}, {counted(len(doubts), 'doubt')}")
    return 1 if unmarked else 0


def figures(
    out: Annotated[Path, tyro.conf.arg(metavar="DIR", help="Folder for the figures.")],
    catalogue: Catalogue = (),
) -> int:
    """Draw the laws over modules and segments, and their predictions of those held out."""
    from draft.fitting.actuators import catalogue_figures as actuators
    from draft.fitting.structure import survey_figures as structure

    parts = _read(catalogue)
    for path in (*actuators.draw(out, parts), *structure.draw(out, parts)):
        print(path)
    return 0


SUBCOMMANDS = {"fit": fit, "table": show, "check": check, "figures": figures}


def _record(figure: Figure) -> dict[str, object]:
    """Return a published figure as plain data for JSON."""
    return {
        "quantity": figure.quantity,
        "figure": figure.name,
        "published": figure.printed,
        "source": figure.source,
        "reproduced": figure.ours,
        "value": figure.value,
        "same": figure.same if figure.printed is not None else None,
        "draft": figure.draft,
        "note": figure.note,
    }


def _read(catalogue: Sequence[Path]) -> list[Part]:
    """Return the shipped modules and those of further tables; print skipped rows on stderr."""
    parts, skipped = with_rows(catalogue)
    for problem in skipped:
        print(f"warning: {problem}", file=sys.stderr)
    return list(parts.values())


def _own_doubts(parts: Sequence[Part], catalogue: Sequence[Path]) -> list[Doubt]:
    """What is doubted of the rows of further tables."""
    from draft.fitting.actuators.check import check as doubts_of

    found = doubts_of(parts) if catalogue else []
    return [doubt for doubt in found if doubt.where.file != str(SHIPPED)]


def _print_doubts(doubts: Sequence[Doubt]) -> None:
    for doubt in doubts:
        kind = doubt.kind.replace("_", " ")
        print(f"{doubt.where}: {kind}: {doubt.name}: {doubt.text}\n  {doubt.remedy}")


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in headings:
        words = heading in ("law", "quantity", "figure", "")
        table.add_column(heading, justify="left" if words else "right", no_wrap=True)
    return table
