"""`draft learn`: the numbers that the learning tasks stand on."""

from __future__ import annotations

import json as json_
from collections.abc import Iterable
from typing import Annotated, Any, Literal

import tyro
from rich.table import Table
from rich.text import Text
from tyro.extras import SubcommandApp

from draft.cli.options import JsonOutput, parse_values
from draft.cli.verdict import console
from draft.design.named import open_designs
from draft.learn.config import Config
from draft.learn.numbers import Row
from draft.learn.quadruped import quadruped

app = SubcommandApp()
MaybeDesign = Annotated[
    tyro.conf.Positional[str | None],
    tyro.conf.arg(
        metavar="DESIGN",
        help="Numbers at its scale: a shipped design, SPEC:DESIGN, a robot's or a model's folder.",
        help_behavior_hint="(default: none)",
    ),
]
# tyro reads the names of the stages from the type; `draft.learn.config.STAGES` are these.
Stage = Annotated[
    Literal["base", "velocity", "terrain", "push"] | None,
    tyro.conf.arg(
        help="Leave out what is of other stages only.", help_behavior_hint="(default: all stages)"
    ),
]
Numbers = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        name="set",
        metavar="NAME=VALUE",
        help="Numbers that win: rewards.upright_weight=2 ground.step=0.0,0.1",
        help_behavior_hint="",
    ),
]


@app.command
def show(
    design: MaybeDesign = None,
    /,
    stage: Stage = None,
    values: Numbers = (),
    json: JsonOutput = False,
) -> int:
    """Show every number of the learning tasks: value, unit, source, meaning."""
    config = Config().with_values(parse_values(values))
    name, scale = (None, 1.0) if design is None else _scale(design)
    groups = config.rows(scale, stage)
    if json:
        print(json_.dumps(_record(groups, name, scale, stage)))
        return 0
    out = console()
    for group, rows in groups.items():
        out.print(Text(f"{group}: {_about(config, group)}", style="bold"))
        out.print(_table(rows, name, scale))
        out.print()
    return 0


def _scale(word: str) -> tuple[str, float]:
    """Name and scale of a design."""
    (design,) = open_designs([word])
    found = quadruped(design)
    return found.name, found.scale


def _about(config: Config, group: str) -> str:
    """First line of a group's description."""
    return (getattr(config, group).__doc__ or "").splitlines()[0]


def _table(rows: Iterable[Row], design: str | None, scale: float) -> Table:
    table = Table(box=None, pad_edge=False)
    table.add_column("number", no_wrap=True)
    table.add_column("value" if design is None else "s = 1", justify="right")
    if design is not None:
        table.add_column(f"{design}, s = {scale:.3f}", justify="right")
    for heading in ("unit", "source", "meaning"):
        table.add_column(heading)
    for row in rows:
        values = [row.value] if design is None else [row.value, row.scaled]
        style = "green" if row.source == "paper" else ""
        words = Text(row.source, style)
        table.add_row(row.name, *map(_written, values), row.unit, words, row.doc)
    return table


def _written(value: Any) -> str:
    """A value in a few digits, as `--set` takes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, tuple):
        return f"{value:.4g}"
    inside = ", ".join(map(_written, value))
    return f"[{inside}]"


def _record(
    groups: dict[str, list[Row]], design: str | None, scale: float, stage: str | None
) -> dict[str, Any]:
    numbers = {row.name: _plain(row) for rows in groups.values() for row in rows}
    return {"design": design, "scale": scale, "stage": stage, "numbers": numbers}


def _plain(row: Row) -> dict[str, Any]:
    return {key: value for key, value in row._asdict().items() if key != "name"}
