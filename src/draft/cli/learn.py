"""`draft learn`: print the numbers of the learning tasks, and what trains with them here."""

from __future__ import annotations

import json as json_
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

import tyro
from rich.table import Table
from rich.text import Text

from draft.cli.display.verdict import console
from draft.cli.options import DESIGN_FORMS, JsonOutput, parse_values
from draft.cli.stage_choice import StageChoice
from draft.design.references import open_designs
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.engine.machine import this_machine
from draft.learn.task.config import Config
from draft.learn.task.constants import JOINTS, Row
from draft.learn.task.recipes import RECIPES, Recipe, RecipeName, default
from draft.learn.task.stages import STAGES
from draft.learn.training.estimate import outlook

OptionalDesign = Annotated[
    tyro.conf.Positional[str | None],
    tyro.conf.arg(
        metavar="[DESIGN]",
        help=f"Design at whose scale, and for whose joints, numbers are printed: {DESIGN_FORMS}.",
        help_behavior_hint="(default: none)",
    ),
]
StageOption = Annotated[
    StageChoice | None,
    tyro.conf.arg(
        metavar=f"{{{','.join(STAGES)}}}",
        help="Omit numbers that only other stages use.",
        help_behavior_hint="(default: all stages)",
    ),
]
RecipeOption = Annotated[
    RecipeName | None,
    tyro.conf.arg(
        metavar="{paper,laptop,tune,machine}",
        help="Numbers of the tasks: as published, for a hundredth of the steps, to tune a policy "
        "that can run, or for a real robot.",
        help_behavior_hint="(default: laptop on a CPU, paper on a GPU)",
    ),
]
Numbers = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        name="set",
        metavar="NAME=VALUE ...",
        help="Numbers that override the recipe's: rewards.upright_weight=2 ground.step=0.0,0.1.",
        help_behavior_hint="(default: none)",
    ),
]


def show(
    design: OptionalDesign = None,
    /,
    stage: StageOption = None,
    recipe: RecipeOption = None,
    values: Numbers = (),
    json: JsonOutput = False,
) -> int:
    """Show what would train here, and every number with its unit, source and meaning."""
    here = this_machine()
    chosen = RECIPES[recipe] if recipe else default(here.devices)
    given = parse_values(values)
    robot = None if design is None else _robot(design)
    name, scale = (None, 1.0) if robot is None else (robot.name, robot.scale)
    joints = JOINTS if robot is None else len(robot.joints)
    chosen = chosen.for_joints(joints)
    config = chosen.config.with_values(given)
    groups = {
        group: [_sourced(row, chosen, given) for row in rows]
        for group, rows in config.rows(scale, stage).items()
    }
    training = outlook(here, chosen, config, [stage] if stage else (), joints)
    whys = {n: c.why for n, c in chosen.changes.items() if n not in given}
    if json:
        record = {"design": name, "scale": scale, "stage": stage}
        numbers = {"numbers": _numbers(groups, whys)}
        print(json_.dumps(record | training.record() | numbers))
        return 0
    out = console()
    out.print(Text(f"engine: {training.engine_line()}"))
    head = f"recipe {chosen.name}: "
    for line in training.stage_lines():
        out.print(Text(head + line))
        head = " " * len(head)
    out.print()
    for group, rows in groups.items():
        out.print(Text(f"{group}: {_about(config, group)}", style="bold"))
        out.print(_table(rows, name, scale, whys))
        out.print()
    return 0


def _sourced(row: Row, recipe: Recipe, given: Mapping[str, object]) -> Row:
    """Return a number with its source in a recipe, unless the command line gives it."""
    source = None if row.name in given else recipe.source(row.name)
    return row if source is None else row._replace(source=source)


def _robot(reference: str) -> LeggedRobot:
    (design,) = open_designs([reference])
    return legged_robot(design)


def _about(config: Config, group: str) -> str:
    """Return the first line of a group's description."""
    return (config.groups()[group].__doc__ or "").splitlines()[0]


def _table(rows: Iterable[Row], design: str | None, scale: float, whys: Mapping[str, str]) -> Table:
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
        meaning = Text("; ".join((row.doc, *filter(None, [whys.get(row.name)]))))
        table.add_row(row.name, *map(_written, values), row.unit, words, meaning)
    return table


def _written(value: Any) -> str:
    """Return a value in a few digits, as `--set` takes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, tuple):
        return f"{value:.4g}"
    inside = ", ".join(map(_written, value))
    return f"[{inside}]"


def _numbers(groups: Mapping[str, list[Row]], whys: Mapping[str, str]) -> dict[str, object]:
    """Return numbers as plain data, with the recipe's reasons."""
    return {
        row.name: {key: value for key, value in row._asdict().items() if key != "name"}
        | {"why": whys.get(row.name)}
        for rows in groups.values()
        for row in rows
    }


SUBCOMMANDS = {"show": show}
