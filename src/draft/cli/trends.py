"""`draft trends`: the actuator catalogue, what is fitted to it, and how far to trust that."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.table import Table
from rich.text import Text

from draft.cli.display.verdict import console
from draft.errors import DraftError, Problem
from draft.fitting.printed import Figure
from draft.laws.catalogue import FILE as SHIPPED
from draft.laws.catalogue import Part, with_rows

Catalogue = Annotated[
    tuple[Path, ...],
    tyro.conf.arg(
        metavar="CSV", help="Tables of further modules; columns as in the shipped one (see docs)."
    ),
]
Json = Annotated[bool, tyro.conf.arg(help="Print one JSON object and nothing else.")]


@dataclass(frozen=True)
class Fit:
    """Fit every law to the catalogue and write the coefficients file."""

    catalogue: Catalogue = ()
    out: Annotated[
        Path | None,
        tyro.conf.arg(metavar="FILE", help="Where to; the package's own file by default."),
    ] = None

    def run(self) -> int:
        """Fit, write, and say what changed against the shipped coefficients."""
        from draft.fitting.actuators import refit
        from draft.laws import actuators

        if self.catalogue and self.out is None:
            remedy = (
                "name one, and put 'trends: NAME.json' into a robot's parameters.yaml to use it"
            )
            raise DraftError(Problem("--catalogue needs --out FILE", None, remedy))
        parts = _read(self.catalogue)
        before = actuators.laws().trends
        made = refit.actuator_trends(parts)
        path = self.out or actuators.FILE
        refit.write(path, made)
        table = _table("law", "n", "vendor held out", "shipped")
        for quantity, law in made[actuators.DEFAULT]["laws"].items():
            held_out = f"{law['held_out']['vendor']:.3f}"
            shipped = f"{before[quantity].held_out['vendor']:.3f}"
            table.add_row(law["formula"], str(law["n"]), held_out, shipped)
        console().print(table)
        print(f"written to {path}, from {len(parts)} modules")
        return 0


@dataclass(frozen=True)
class Show:
    """Show the published figures beside what these tables give."""

    json: Json = False

    def run(self) -> int:
        """Print the published figures, ours of the same forms, and those of the better forms."""
        from draft.fitting.actuators import published

        figures = published.figures()
        if self.json:
            print(json.dumps({"actuators": [_record(figure) for figure in figures]}, indent=2))
            return 0
        table = _table("quantity", "figure", "published", "reproduced", "", "draft")
        last = ""
        for figure in figures:
            quantity = "" if figure.quantity == last else figure.quantity.replace("_", " ")
            last = figure.quantity
            word = Text("same", "green") if figure.same else Text("differs", "bold red")
            draft = "" if figure.draft is None else f"{figure.draft:.3f}"
            cells = (figure.printed, figure.ours, word) if figure.printed else ("", figure.ours)
            table.add_row(quantity, figure.name, *cells, *("",) * (3 - len(cells)), draft)
        console().print(table)
        for figure in figures:
            if figure.note:
                print(f"\n{figure.quantity.replace('_', ' ')}, {figure.name}: {figure.note}")
        return 0 if all(figure.same for figure in figures) else 1


@dataclass(frozen=True)
class Check:
    """Look for unit slips, copies and implausible rows; exit 1 if there are any."""

    catalogue: Catalogue = ()
    json: Json = False

    def run(self) -> int:
        """Check the shipped rows, or those of the tables given."""
        from draft.fitting.actuators.check import check

        parts = _read(self.catalogue)
        doubts = check(parts)
        if self.catalogue:
            doubts = [doubt for doubt in doubts if doubt.where.file != str(SHIPPED)]
        if self.json:
            record = {"modules": len(parts), "doubts": [doubt.record() for doubt in doubts]}
            print(json.dumps(record, indent=2))
            return 1 if doubts else 0
        for doubt in doubts:
            kind = doubt.kind.replace("_", " ")
            print(f"{doubt.where}: {kind}: {doubt.name}: {doubt.text}\n  {doubt.remedy}")
        print(f"{len(parts)} modules, {len(doubts) or 'no'} doubt{'s' * (len(doubts) != 1)}")
        return 1 if doubts else 0


@dataclass(frozen=True)
class Figures:
    """Draw the laws over modules and segments, and what they predict of those held out."""

    out: Annotated[Path, tyro.conf.arg(metavar="DIR", help="Folder to write to.")]
    catalogue: Catalogue = ()

    def run(self) -> int:
        """Write every figure as PNG and PDF."""
        from draft.fitting.actuators import figures as actuators
        from draft.fitting.structure import figures as structure

        parts = _read(self.catalogue)
        for path in (*actuators.draw(self.out, parts), *structure.draw(self.out, parts)):
            print(path)
        return 0


def main(
    command: tyro.conf.OmitSubcommandPrefixes[
        Annotated[Fit, tyro.conf.subcommand("fit")]
        | Annotated[Show, tyro.conf.subcommand("table")]
        | Annotated[Check, tyro.conf.subcommand("check")]
        | Annotated[Figures, tyro.conf.subcommand("figures")]
    ],
) -> int:
    """Fit, show, check and draw the actuator trends."""
    return command.run()


def _record(figure: Figure) -> dict[str, object]:
    """A published figure as plain data for JSON."""
    return {
        "quantity": figure.quantity,
        "figure": figure.name,
        "published": figure.printed,
        "reproduced": figure.ours,
        "value": figure.value,
        "same": figure.same if figure.printed is not None else None,
        "draft": figure.draft,
        "note": figure.note,
    }


def _read(catalogue: Sequence[Path]) -> list[Part]:
    """The shipped modules and those of further tables; what is skipped is said on stderr."""
    parts, skipped = with_rows(catalogue)
    for problem in skipped:
        print(f"warning: {problem}", file=sys.stderr)
    return list(parts.values())


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in headings:
        words = heading in ("law", "quantity", "figure", "")
        table.add_column(heading, justify="left" if words else "right", no_wrap=True)
    return table
