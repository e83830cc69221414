"""`draft survey`: read public robot descriptions and fit the structure trends."""

from __future__ import annotations

import collections
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.markup import escape
from rich.table import Table

from draft import files
from draft.cli.display.verdict import console
from draft.cli.options import JsonOutput
from draft.cli.spelling import spelt
from draft.errors import counted
from draft.fitting.printed import RELEASED, Figure
from draft.fitting.structure.parse import Survey, parse
from draft.fitting.structure.survey_published import figures

Rows = Annotated[
    Path | None,
    tyro.conf.arg(
        metavar="CSV",
        help="Table that 'draft survey parse' wrote.",
        help_behavior_hint="(default: the shipped table)",
    ),
]


def parse_command(
    source: Annotated[
        tyro.conf.Positional[Path],
        tyro.conf.arg(
            metavar="DIR|MANIFEST", help="Folder of descriptions, or a .csv that lists them."
        ),
    ],
    /,
    out: Annotated[Path, tyro.conf.arg(metavar="CSV", help="File of the segment table.")] = Path(
        "segments.csv"
    ),
    notes: Annotated[bool, tyro.conf.arg(help="Print every note on every robot.")] = False,
) -> int:
    """Read URDF and MJCF descriptions, without meshes, into the segment table."""
    from draft.laws import survey as rows

    survey = parse(source)
    if survey.rows:
        files.write(out, rows.write(survey.rows))
    _summary(survey, notes)
    if survey.rows:
        print(
            f"{out}: {counted(len(survey.rows), 'segment')} of {counted(len(survey.used), 'robot')}"
        )
    return 1 if survey.failed else 0


def fit(
    rows: Rows = None,
    out: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="JSON",
            help="File of the trends.",
            help_behavior_hint="(default: no file)",
        ),
    ] = None,
    structure: Annotated[
        Literal["calibrated", "paper"],
        tyro.conf.arg(
            help="Law of the trunk of robots with this file, as 'structure' in parameters.yaml."
        ),
    ] = "calibrated",
) -> int:
    """Fit the structure trends and score them on robots held out."""
    from draft.fitting.structure import survey_refit as refit
    from draft.fitting.structure import whole
    from draft.laws.law import Law
    from draft.laws.survey import FILE

    source = rows or FILE
    fitted = refit.structure_trends(source)
    if out is not None:
        refit.write(source, out, uses=structure)
    _show_scores(fitted)
    for name in ("humanoid", "quadruped"):
        law = Law.read("whole", fitted[name]["whole"])
        print(
            f"{name} structure: {law.coefficient:.4g} L^{law.exponent:.3f} kg, "
            f"L = {whole.SIZE} [m], n {law.n}"
        )
        print(f"{name} trunk, calibrated: {fitted[name]['calibrated']['formula']}, n {law.n}")
        _show_centres(name, fitted[name]["segments"])
    end = Law.read("end", fitted["quadruped"]["end"])
    print(f"ends: {end.coefficient:.4g} kg/m3, n {end.n}")
    if out is not None:
        print(out)
    return 0


def table(
    rows: Rows = None,
    json: JsonOutput = False,
) -> int:
    """Show published and reproduced figures side by side."""
    from draft.fitting.structure import survey_refit as refit

    found = figures(None if rows is None else refit.structure_trends(rows))
    if json:
        from json import dumps

        print(dumps([_record(one) for one in found]))
        return 0
    _show(found)
    return 0


def fetch(
    robots: Annotated[
        tyro.conf.Positional[tuple[str, ...]],
        tyro.conf.arg(
            metavar="[ROBOT ...]",
            help="Keys of the survey's table.",
            help_behavior_hint="(default: all)",
        ),
    ] = (),
    /,
    out: Annotated[Path, tyro.conf.arg(metavar="DIR", help="Folder for the descriptions.")] = Path(
        "descriptions"
    ),
) -> int:
    """Copy descriptions from the package robot_descriptions, which downloads them."""
    from draft.fitting.structure.fetch import choose
    from draft.fitting.structure.fetch import fetch as fetch_one

    for robot in choose(robots):
        print(fetch_one(robot, out))
    return 0


def _summary(survey: Survey, notes: bool) -> None:
    """Print what was read, and what was omitted and why."""
    out = console()
    for robot, error in survey.failed:
        out.print(f"[bold red]refused[/] [bold]{escape(robot.key)}[/] {escape(spelt(str(error)))}")
    for one in survey.parsed:
        if not one.robot.used:
            why = escape(one.robot.reason)
            out.print(f"[yellow]omitted[/] [bold]{escape(one.robot.key)}[/] {why}")
            for problem in one.notes if notes else ():
                out.print(f"  {escape(spelt(str(problem)))}")
    for one in survey.used:
        if one.notes:
            out.print(f"[yellow]note[/] [bold]{one.robot.key}[/] {len(one.notes)} notes")
        for problem in one.notes if notes else one.notes[:3]:
            out.print(f"  {escape(spelt(str(problem)))}")
    left = len(survey.parsed) - len(survey.used)
    populations = collections.Counter(one.robot.population for one in survey.used)
    counts = ", ".join(f"{n} {name}s" for name, n in sorted(populations.items()))
    print(
        f"read {len(survey.parsed)}, used {len(survey.used)}"
        f"{f' ({counts})' if counts else ''}, omitted {left}, refused {len(survey.failed)}"
    )


def _show_scores(fitted: dict[str, Any]) -> None:
    """Print the errors of the methods on robots held out."""
    shown = Table(box=None, pad_edge=False)
    for heading in ("", "robots", "paper", "calibrated", "leg length", "median alone"):
        shown.add_column(heading, justify="left" if not heading else "right")
    methods = ("paper", "calibrated", "draft")
    for name in ("humanoid", "quadruped"):
        score = fitted[name]["held_out"]
        folds = (f"{score[key]:.3f}" for key in (*methods, "median_alone"))
        shown.add_row(f"{name}, one robot out", str(score["n"]), *folds)
        folds = (f"{score[f'{key}_maker_out']:.3f}" for key in methods)
        shown.add_row(f"{name}, one maker out", str(score["n"]), *folds, "")
    out = console()
    out.print("error of total mass on robots held out (geometric mean fold)")
    out.print(shown)


def _show_centres(population: str, laws: dict[str, Any]) -> None:
    """Print the centre of mass of structure, for the segment classes where it is known."""
    for kind, law in laws.items():
        if centre := law.get("centre"):
            print(
                f"{population} {kind} balances at {centre['value']:.3f} of its length, "
                f"n {centre['n']}, off by {centre['held_out']:.3f} held out "
                f"(the middle: {centre['held_out_middle']:.3f})"
            )


def _record(one: Figure) -> dict[str, object]:
    """Return a printed figure as plain data for JSON."""
    return {
        "population": one.population,
        "item": one.quantity,
        "name": one.name,
        "printed": one.printed,
        "source": one.source,
        "value": one.value,
        "why": one.note,
        "agrees": one.same,
    }


def _show(found: list[Figure]) -> None:
    out = console()
    shown = Table(box=None, pad_edge=False)
    for heading in ("", "", "figure", "printed", "source", "here", ""):
        shown.add_column(heading, justify="right" if heading in ("printed", "here") else "left")
    previous = ("", "")
    for one in found:
        place = (one.population, one.quantity)
        labels = ("", "") if place == previous else place
        previous = place
        here = "" if one.value is None else f"{one.value:.4g}"
        style = "green" if one.same else "yellow"
        mark = "same" if one.same else one.note or "differs"
        shown.add_row(
            *labels, one.name, one.printed, one.source, here, f"[{style}]{escape(mark)}[/]"
        )
    out.print(shown)
    fitted = [one for one in found if one.value is not None]
    same = sum(one.same for one in fitted)
    released = sum(one.source == RELEASED for one in fitted)
    print(
        f"{same} of {len(fitted)} published figures reproduce; {released} of them are from the "
        "released data, not from the paper's text"
    )


SUBCOMMANDS = {"parse": parse_command, "fit": fit, "table": table, "fetch": fetch}
