"""`draft list`: list the shipped robots and their designs."""

from __future__ import annotations

import json as jsons

from rich.table import Table
from rich.text import Text

from draft.cli.display.verdict import console
from draft.cli.options import JsonOutput
from draft.design.report import designs_of
from draft.spec import shipped


def main(json: JsonOutput = False) -> int:
    """List the shipped robots and their designs."""
    found = designs_of(shipped())
    if json:
        print(jsons.dumps(found, indent=2))
        return 0
    table = Table(box=None, pad_edge=False)
    for heading in ("robot", "design"):
        table.add_column(heading, style="bold" if heading == "robot" else "cyan", no_wrap=True)
    table.add_column(Text("mass [kg]"), justify="right")
    table.add_column("joints", justify="right")
    table.add_column("about")
    for reference, row in found.items():
        robot, _, design = reference.partition(":")
        if "problem" in row:  # Of an extension.
            problem = Text(" ".join(row["problem"].split()), style="red")
            table.add_row(robot, "", "", "", problem)
            continue
        mass, joints = f"{row['mass_kg']:.1f}", str(row["n_joints"])
        table.add_row("" if design else robot, design, mass, joints, Text(row["doc"], style="dim"))
    console().print(table)
    return 0
