"""`draft learn`: print the numbers of the learning tasks, and what trains with them here."""

from __future__ import annotations

import json as json_
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import tyro
from rich.table import Table
from rich.text import Text

from draft.cli.display.verdict import console
from draft.cli.options import DESIGN_FORMS, JsonOutput, parse_values
from draft.design.references import open_designs
from draft.extras import remedy
from draft.learn.config import STAGES, Config
from draft.learn.constants import Row
from draft.learn.legged import legged_robot
from draft.learn.machine import KINDS, Machine, minutes, replicas, this_machine
from draft.learn.recipes import RECIPES, Recipe, default

OptionalDesign = Annotated[
    tyro.conf.Positional[str | None],
    tyro.conf.arg(
        metavar="[DESIGN]",
        help=f"Design at whose scale numbers are printed too: {DESIGN_FORMS}.",
        help_behavior_hint="(default: none)",
    ),
]
# tyro reads the names of the stages from the type; `draft.learn.config.STAGES` are these.
Stage = Annotated[
    Literal["base", "velocity", "terrain", "push"] | None,
    tyro.conf.arg(
        metavar="{base,velocity,terrain,push}",
        help="Omit numbers that only other stages use.",
        help_behavior_hint="(default: all stages)",
    ),
]
# As for the stages: `draft.learn.recipes.RECIPES` are these.
RecipeName = Annotated[
    Literal["paper", "laptop"] | None,
    tyro.conf.arg(
        metavar="{paper,laptop}",
        help="Numbers of the tasks: as published, or for a hundredth of the steps.",
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


@dataclass(frozen=True)
class _Training:
    """Training of a stage as `draft train` would run it here.

    Attributes:
        iterations: iterations of the stage.
        environments: number of worlds.
        ground: "flat" or "uneven".
        minutes: expected time on a CPU [min]; None if unknown.
    """

    iterations: int
    environments: int
    ground: str
    minutes: float | None


def show(
    design: OptionalDesign = None,
    /,
    stage: Stage = None,
    recipe: RecipeName = None,
    values: Numbers = (),
    json: JsonOutput = False,
) -> int:
    """Show what would train here, and every number with its unit, source and meaning."""
    here = this_machine()
    chosen = RECIPES[recipe] if recipe else default(here.devices)
    given = parse_values(values)
    config = chosen.config.with_values(given)
    name, scale = (None, 1.0) if design is None else _scale(design)
    groups = {
        group: [_sourced(row, chosen, given) for row in rows]
        for group, rows in config.rows(scale, stage).items()
    }
    plans = {one: _training(one, config, chosen, here) for one in ([stage] if stage else STAGES)}
    whys = {n: c.why for n, c in chosen.changes.items() if n not in given}
    if json:
        record = {"design": name, "scale": scale, "stage": stage}
        record |= _setting(config, here) | _stages(chosen, plans)
        print(json_.dumps(record | {"numbers": _numbers(groups, whys)}))
        return 0
    out = console()
    for line in (_engine_line(config, here), *_recipe_lines(chosen, plans)):
        out.print(Text(line))
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


def _processes(config: Config, here: Machine) -> int | None:
    """Return the number of processes that would share a run; None without an engine."""
    if here.engine is None:
        return None
    return replicas(None, config.learning.environments, here.engine, here.devices)


def _training(stage: str, config: Config, recipe: Recipe, here: Machine) -> _Training:
    """Return the training of a stage."""
    learning, ground = config.learning, recipe.ground(stage)
    count, took = learning.iterations(stage), None
    processes = _processes(config, here)
    if here.on_cpu and here.engine is not None and processes is not None:
        steps = count * learning.environments * learning.steps
        took = minutes(steps, here.engine, processes, ground)
    return _Training(count, learning.environments, ground, took)


def _engine_line(config: Config, here: Machine) -> str:
    """Return the engine and the reason for it, in a line."""
    cores = f"{here.cores} core{'s' * (here.cores != 1)}"
    if here.engine is None:
        return f"engine: none yet, {here.missing} is not installed ({remedy('learn')}); {cores}"
    words = f"engine: {KINDS[here.engine.name]} ({here.engine.why})"
    if not here.on_cpu:
        return f"{words}, {', '.join(here.devices)}"
    count = _processes(config, here)
    return f"{words}, {cores}, {count} process{'es' * (count != 1)}"


def _recipe_lines(recipe: Recipe, plans: Mapping[str, _Training]) -> list[str]:
    """Return the trainings, a line for each stage."""
    lines, head = [], f"recipe {recipe.name}: "
    for stage, plan in plans.items():
        words = f"{stage} {plan.iterations} iterations of {plan.environments} worlds "
        words += f"on {plan.ground} ground"
        if plan.minutes is not None:
            about = f"about {plan.minutes:,.0f}" if plan.minutes >= 1 else "less than 1"
            words += f", {about} min"
        lines.append(head + words)
        head = " " * len(head)
    return lines


def _scale(reference: str) -> tuple[str, float]:
    """Return name and scale of a design."""
    (design,) = open_designs([reference])
    found = legged_robot(design)
    return found.name, found.scale


def _about(config: Config, group: str) -> str:
    """Return the first line of a group's description."""
    return (getattr(config, group).__doc__ or "").splitlines()[0]


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


def _setting(config: Config, here: Machine) -> dict[str, object]:
    """Return devices, engine and processes as plain data."""
    engine = here.engine
    return {
        "devices": here.devices,
        "engine": engine and engine.name,
        "why": engine and engine.why,
        "missing": here.missing,
        "cores": here.cores,
        "processes": _processes(config, here),
    }


def _stages(recipe: Recipe, plans: Mapping[str, _Training]) -> dict[str, object]:
    """Return the trainings as plain data."""
    return {
        "recipe": recipe.name,
        "ground": {stage: plan.ground for stage, plan in plans.items()},
        "minutes": {stage: plan.minutes for stage, plan in plans.items()},
    }


def _numbers(groups: Mapping[str, list[Row]], whys: Mapping[str, str]) -> dict[str, object]:
    """Return numbers as plain data, with the recipe's reasons."""
    return {
        row.name: {key: value for key, value in row._asdict().items() if key != "name"}
        | {"why": whys.get(row.name)}
        for rows in groups.values()
        for row in rows
    }


SUBCOMMANDS = {"show": show}
