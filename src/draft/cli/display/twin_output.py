"""Terminal output of `draft twin`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.markup import escape
from rich.table import Table

from draft.cli.display.verdict import console
from draft.cli.spelling import spelt
from draft.errors import counted
from draft.values import scalar

if TYPE_CHECKING:
    from draft.twins.compare import Comparison
    from draft.twins.every import Failure, Row


def print_one(found: Comparison) -> None:
    """Print one comparison: groups, total, errors of M(q) and g(q), hinges and stance."""
    out = console()
    reduced = found.files.reduced
    for note in reduced.notes:
        out.print(f"[yellow]warning[/] {escape(spelt(str(note)))}")
    if found.unmatched:
        out.print(f"[yellow]warning[/] the spec lacks {escape(', '.join(found.unmatched))}")
    if reduced.counts:
        print("omitted: " + ", ".join(f"{n} {what}" for what, n in reduced.counts.items()))
    out.print(_groups(found))
    mass = found.expected
    inside = bool(found.unstated) or mass.low <= found.vendor_mass <= mass.high
    outside = "" if inside else ", the maker's is outside"
    why = f"; wider than the trends' own: {', '.join(mass.wider)}" if mass.wider else ""
    print(f"90 % band of the twin's mass: {mass.low:.1f} to {mass.high:.1f} kg{outside}{why}")
    for name, errors in (("M(q)", found.inertia), ("g(q)", found.gravity)):
        if math.isnan(errors.median):
            print(f"{name}: nothing to compare")
            continue
        poses = counted(len(errors.values), "pose")
        print(
            f"{name}: median error {errors.median:.1f} % over {poses}, "
            f"variance {errors.variance:.1f}, p10 {errors.quantile(0.1):.1f}, "
            f"p90 {errors.quantile(0.9):.1f}"
        )
    _print_causes(found)
    anchor = max(pair.anchor_gap for pair in found.links) * 1000
    axis = math.degrees(max(pair.axis_gap for pair in found.links))
    print(f"hinges: at most {anchor:.2f} mm and {axis:.3f} degrees from the maker's")
    heights = ["unknown" if math.isnan(height) else f"{height:.3f} m" for height in found.stance]
    print(f"trunk above the ground at home: maker's {heights[0]}, twin's {heights[1]}")


def _print_causes(found: Comparison) -> None:
    """Print the location of the knee motors, if it matters, and the cause of a large error."""
    other = found.other_knees
    if other is not None:
        place, why = found.files.knees.place, found.files.knees.why
        print(
            f"knees driven at the {place} ({spelt(why)}); at the {other.place}, --knee-drive "
            f"{other.place}, M(q) moves by {other.change:.0f} %: then M(q) is off by "
            f"{other.inertia.median:.1f} %, g(q) by {other.gravity.median:.1f} %"
        )
    if found.causes:
        worst = found.causes[0]
        links = ", ".join(worst.links[:4]) + (" ..." if len(worst.links) > 4 else "")
        group = worst.group.replace("_", " ")
        print(
            f"M(q) is off by more than 40 %, mostly by the group '{group}' ({links}): "
            f"{worst.twin_mass:.2f} kg for the maker's {worst.vendor_mass:.2f}; its masses and "
            f"their places alone put M(q) off by {worst.inertia:.0f} %"
        )


def _groups(found: Comparison) -> Table:
    """Return the masses of the groups, and errors of the twin's gyration and centres of mass."""
    from draft.twins.record import residuals

    shown = _table(
        "", "maker [kg]", "twin [kg]", "ratio", "gyration", "fore", "outboard", "up [mm]"
    )
    missed = residuals(found)
    leg = 1.0 if found.design.leg_length is None else scalar(found.design.leg_length)
    for name, (a, b) in found.groups().items():
        extra = [""] * 4
        if name in missed:
            # The twin relative to the maker, like the ratio of masses.
            shift = [f"{-1000 * leg * x + 0.0:+.0f}" for x in missed[name]["com_shift"]]
            gyration = missed[name]["gyration"]
            extra = [f"{1 / gyration:.2f}" if gyration else "", *map(_unsigned, shift)]
        shown.add_row(name.replace("_", " "), *_masses(a, b), *extra)
    shown.add_row(
        "[bold]total[/]", *_masses(found.vendor_mass, scalar(found.design.mass)), *[""] * 4
    )
    return shown


def _masses(maker: float, twin: float, digits: int = 2) -> tuple[str, str, str]:
    """Return both masses and their ratio as text; without a ratio where the maker's is unknown."""
    theirs = "unknown" if math.isnan(maker) else f"{maker:.{digits}f}"
    return theirs, f"{twin:.{digits}f}", f"{twin / maker:.2f}" if maker > 0 else ""


def _unsigned(text: str) -> str:
    """Return a number as text, without the sign of a zero."""
    return "0" if text in ("+0", "-0") else text


def print_all(rows: Sequence[Row], failed: Sequence[Failure]) -> None:
    """Print one line for each robot, then the errors of each population."""
    from draft.twins.every import score

    out = console()
    shown = _table("", "", "maker [kg]", "twin [kg]", "ratio", "90 % band", "M(q) %", "g(q) %", "")
    for row in rows:
        outside = not row.inside and not math.isnan(row.vendor_mass)
        style = "yellow" if outside else ""
        shown.add_row(
            row.robot,
            row.population,
            *_masses(row.vendor_mass, row.twin_mass, 1),
            f"{row.low:.1f} to {row.high:.1f}{' (outside)' if outside else ''}",
            *("" if math.isnan(x) else f"{x:.1f}" for x in (row.inertia, row.gravity)),
            "" if row.fitted else f"[dim]not fitted: {escape(row.why)}[/]",
            style=style,
        )
    out.print(shown)
    for one in failed:
        out.print(f"[bold red]refused[/] [bold]{escape(one.robot)}[/] {escape(spelt(one.cause))}")
    for population in sorted({row.population for row in rows}):
        own = [row for row in rows if row.population == population and row.fitted]
        if own:
            total = score(own)
            print(
                f"{total.n} {population}s that the trends are fitted to, each held out: mass off "
                f"by a factor of {total.fold:.3f} (geometric mean), mean ln {total.bias:+.3f}, "
                f"{100 * total.covered:.0f} % inside their band"
            )
    print(f"{len(rows)} twins, {len(failed) or 'none'} refused")


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for i, heading in enumerate(headings):
        left = i == 0 or not heading
        table.add_column(
            escape(heading), justify="left" if left else "right", no_wrap=bool(heading)
        )
    return table
