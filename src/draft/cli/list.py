"""`draft list`: list the shipped robots and their designs."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from draft.cli.display.verdict import console
from draft.spec import load, shipped


def main() -> int:
    """List the shipped robots and their designs."""
    table = Table(box=None, pad_edge=False)
    for heading in ("robot", "design"):
        table.add_column(heading, style="bold" if heading == "robot" else "cyan", no_wrap=True)
    table.add_column("mass [kg]", justify="right")
    table.add_column("joints", justify="right")
    table.add_column("about")
    for name in shipped():
        spec = load(name)
        default = spec.resolve()
        table.add_row(
            name, "", f"{default.mass:.1f}", str(len(default.joints)), Text(spec.doc, style="dim")
        )
        for design in spec.designs.values():
            resolved = spec.resolve(design.name)
            table.add_row(
                "",
                design.name,
                f"{resolved.mass:.1f}",
                str(len(resolved.joints)),
                Text(design.doc, style="dim"),
            )
    console().print(table)
    return 0
