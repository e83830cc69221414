"""`draft list`: list the shipped robots and their designs."""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table
from rich.text import Text

from draft.cli.display.verdict import console
from draft.errors import DraftError
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
        try:
            rows = [*_rows(name)]
        except DraftError as error:
            # One of an extension; the others are listed all the same.
            rows = [(name, "", "", "", Text(" ".join(str(error).split()), style="red"))]
        for row in rows:
            table.add_row(*row)
    console().print(table)
    return 0


def _rows(name: str) -> Iterator[tuple[str | Text, ...]]:
    """Rows of a robot: its default design, and its named ones."""
    spec = load(name)
    for label, text in (("", spec.doc), *((one.name, one.doc) for one in spec.designs.values())):
        design = spec.resolve(label or None)
        joints = str(len(design.joints))
        yield "" if label else name, label, f"{design.mass:.1f}", joints, Text(text, style="dim")
