"""`draft metrics`: print what a design can do without learning."""

from __future__ import annotations

import json as jsons
import math
from pathlib import Path
from typing import Annotated

import tyro
from rich.table import Table
from rich.text import Text

from draft.cli.display.sustained import own_weight
from draft.cli.display.verdict import console, verdict
from draft.cli.explore_options import print_policy
from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import (
    DESIGN_FORMS,
    DesignName,
    JsonOutput,
    Payload,
    Values,
    open_design,
)
from draft.cli.settings_options import with_options
from draft.design import Design
from draft.errors import DraftError
from draft.learn.measuring.bands import mass_bands
from draft.learn.measuring.evaluation_options import SeeingPolicy
from draft.metrics import LEARNED, METRICS, find
from draft.metrics.learned import PREFIX
from draft.metrics.record import descriptions, measure, record
from draft.metrics.statics import joint_margins
from draft.values import scalar

OptionalDesign = Annotated[
    tyro.conf.Positional[str | None],
    tyro.conf.arg(
        metavar="[DESIGN]",
        help=f"The robot: {DESIGN_FORMS}.",
        help_behavior_hint="(default: list every metric)",
    ),
]
ARROWS = {"more": "more is better", "less": "less is better", "": ""}


@with_options(SeeingPolicy)
def main(
    reference: OptionalDesign = None,
    /,
    *,
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    learned: Annotated[
        bool,
        tyro.conf.arg(help="Also measure what it does with a policy (the extra learn; seconds)."),
    ] = False,
    chosen: SeeingPolicy,
    json: JsonOutput = False,
) -> int:
    """Show what a design can do without learning; without a design, list every metric."""
    policy = chosen.policy
    if policy is not None and not learned:
        raise DraftError("--policy is for learned metrics", "add --learned")
    if reference is None:
        if design is not None or values or payload is not None or learned:
            remedy = "name one: draft metrics quadruped --design bear"
            cause = "--design, --set, --payload and --learned need a robot"
            raise DraftError(cause, remedy)
        print(jsons.dumps(descriptions(), indent=2)) if json else console().print(_list())
        return 0
    resolved, _ = open_design(reference, design, values, payload)
    found = measure(resolved)
    if learned:
        from draft.learn.measuring.policy_metrics import of_policy

        print_policy(policy, resolved)
        with if_interrupted(NOTHING):
            measured = of_policy(resolved, policy=policy, outside=True)
        found |= {name: scalar(x) for name, x in measured.items()}
    margins = {name: scalar(x) for name, x in joint_margins(resolved).items()}
    if json:
        print(jsons.dumps(record(resolved, found), indent=2, allow_nan=False))
    else:
        _print(resolved, found, margins, _outside(resolved, policy) if learned else "")
    return 0 if resolved.accepted else 1


def _list() -> Table:
    """Return every metric with its unit, description, formula and source."""
    table = Table(box=None, pad_edge=False)
    table.add_column("metric", style="bold", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    table.add_column("description")
    for metric in (*METRICS.values(), *LEARNED.values()):
        words = Text.assemble(
            f"{metric.doc} {ARROWS[metric.better]}".rstrip(),
            (f"\n{metric.formula}\n{metric.source}", "dim"),
        )
        table.add_row(metric.name, "" if metric.unit == "1" else metric.unit, words)
    return table


def _outside(design: Design, policy: str | Path | None) -> str:
    """What of a design lies outside the region of validity of a policy; "" for nothing."""
    from draft.learn.bodies.legged import legged_robot
    from draft.learn.measuring.policies import source_for

    if not design.accepted:
        return ""
    return source_for(policy, design).warning(legged_robot(design))


def _print(
    design: Design, found: dict[str, float], margins: dict[str, float], outside: str
) -> None:
    out = console()
    out.print(Text(verdict(design), style="bold green" if design.accepted else "bold red"))
    table = Table(box=None, pad_edge=False)
    table.add_column("metric", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("description", style="dim")
    for name, value in found.items():
        metric = find(name)
        unit = "" if metric.unit in ("1", "bool") else metric.unit
        shown = _shown(value) if metric.unit != "bool" else ("yes" if value else "no")
        if name == "accepted" and value and not design.judged:
            shown = "not judged"
        if metric.unit == "s" and math.isinf(value):
            shown = "no limit"
        table.add_row(Text(name, style="bold"), shown, unit, metric.doc)
    out.print("", table, "")
    if words := own_weight(design):
        out.print(words, "", markup=False)
    if not design.accepted:
        out.print("[dim]metrics that need a compiled model are omitted: the design is refused[/]\n")
    if any(name in LEARNED and math.isnan(x) for name, x in found.items()):
        out.print(
            "[dim]learned metrics have no value where the robot falls, and of designs that are "
            "refused or cannot walk[/]\n"
        )
    known = [name.removeprefix(PREFIX) for name in found if name in LEARNED]
    if bands := mass_bands(known):
        out.print(f"{bands}\n", style="dim", markup=False)
    if outside:
        words = f"the learned metrics are of a design {outside}; sweeps and searches need --outside"
        out.print(Text(f"{words}\n", style="yellow"))
    if margins:
        joints = Table(
            title="torque margin by joint", title_justify="left", box=None, pad_edge=False
        )
        joints.add_column("joint", no_wrap=True)
        joints.add_column("peak / standing", justify="right")
        for name, margin in margins.items():
            joints.add_row(name, _shown(margin))
        out.print(joints)


def _shown(value: float) -> str:
    if math.isnan(value):
        return "-"
    return "no load" if math.isinf(value) else f"{value:.4g}"
