"""`draft solve`: the nearest design that meets conditions."""

from __future__ import annotations

import json as jsons
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
from draft.explore.settings import TargetSettings
from draft.metrics.learned import PREFIX
from draft.values import told_apart

if TYPE_CHECKING:
    from draft.design import Design
    from draft.explore.nearest import Solution

NOT_MET = 1


@with_options(TargetSettings, without=("progress",))
def main(
    reference: DesignArgument,
    conditions: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="CONDITION ...",
            help='Conditions on metrics: "top_speed >= 3" "mass <= 30" "learned.top_speed >= 4".',
            help_behavior_hint="(required)",
        ),
    ] = (),
    /,
    *,
    vary: x.VaryAny = (),
    keep: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="NAME ...",
            help="Numbers that stay as they are.",
            help_behavior_hint="(default: none)",
        ),
    ] = (),
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    seed: Annotated[
        int, tyro.conf.arg(metavar="N", help="Seed of the designs that are drawn.")
    ] = 0,
    out: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="FILE.yaml",
            help="Design file of the solution.",
            help_behavior_hint="(default: out/DESIGN-solved.yaml)",
        ),
    ] = None,
    rolled: TargetSettings,
    json: JsonOutput = False,
) -> int:
    """Find the nearest accepted design that meets conditions, and say why each number moved.

    The change is the root mean square of those of the numbers, each as a share of its range.
    Without --vary every stated number may be halved to doubled, within the range of its parameter.
    Learned conditions need roll-outs (the extra learn): of about 120 designs in batches, the
    nearest that the predictions from the former ones find; about a minute.
    """
    from draft import files
    from draft.explore.nearest import MARK
    from draft.explore.solve import solve

    resolved, _ = open_design(reference, design, values, payload)
    name = out or f"out/{resolved.reference.replace(':', '-')}-solved.yaml"
    file = files.check_output(name, ".yaml", mark=MARK)
    learned = any(PREFIX in text for text in conditions)
    if learned:
        x.print_policy(rolled.policy, resolved)
    elif rolled.policy is not None:
        raise DraftError("--policy is for learned metrics", "name one, or omit it")
    with if_interrupted(NOTHING), x.bar("bodies") if learned else nullcontext() as progress:
        found = solve(
            resolved,
            conditions,
            vary,
            keep,
            seed=seed,
            replicas=rolled.replicas,
            policy=rolled.policy,
            progress=progress,
        )
    path = file if found.conflict is None and found.moved else None
    if path is not None:
        files.write(path, found.design_file(resolved, conditions))
    if json:
        record = found.record() | {"file": None if path is None else str(path)}
        print(jsons.dumps(record, indent=2, allow_nan=False))
    else:
        _print(resolved, found, path)
    return 0 if found.conflict is None else NOT_MET


def _print(start: Design, found: Solution, path: Path | None) -> None:
    out = console()
    if not found.moved and found.conflict is None:
        out.print(f"{start.reference} meets all conditions; nothing was changed")
        return
    if found.conflict is not None:
        together = len(found.conflict.conditions) > 1
        words = "exclude each other" if together else "cannot be met"
        out.print(f"no design of these ranges: {words}", style="bold red")
        for text in found.conflict.conditions:
            out.print(f"  {text}", markup=False)
        out.print("the design that misses least misses")
        for text in found.conflict.misses:
            out.print(f"  {text}", markup=False)
    else:
        out.print(Text(verdict(found.design), style="bold green"))
    table = Table(box=None, pad_edge=False)
    table.add_column("number", style="bold", no_wrap=True)
    table.add_column("from", justify="right", no_wrap=True)
    table.add_column("to", justify="right", no_wrap=True)
    table.add_column("" if found.conflict else "without this change", style="dim")
    for one in found.moved:
        row = one.name, *told_apart(one.before, one.after), "\n".join(one.why)
        table.add_row(*(Text(cell) for cell in row))
    out.print("", table, "")
    rolled = f", {found.rollouts:,} roll-outs" if found.rollouts else ""
    computed = f"{found.tried:,} designs computed{rolled}"
    out.print(f"change {100 * found.change:.3g} % of the ranges, {computed}")
    for note in found.notes:
        out.print(note, style="yellow", markup=False)
    if path is not None:
        out.print(str(path), markup=False)
