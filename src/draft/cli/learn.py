"""`draft learn`: the numbers that the learning tasks stand on, and what trains with them."""

from __future__ import annotations

import json as json_
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import tyro
from rich.table import Table
from rich.text import Text
from tyro.extras import SubcommandApp

from draft.cli.display.verdict import console
from draft.cli.options import JsonOutput, parse_values
from draft.design.references import open_designs
from draft.learn.config import STAGES, Config
from draft.learn.constants import Row
from draft.learn.machine import KINDS, REMEDY, Machine, minutes, replicas, this_machine
from draft.learn.quadruped import quadruped
from draft.learn.recipes import RECIPES, Recipe, default

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
# As for the stages: `draft.learn.recipes.RECIPES` are these.
RecipeName = Annotated[
    Literal["paper", "laptop"] | None,
    tyro.conf.arg(
        help="Which numbers: published, or for a hundredth of the steps.",
        help_behavior_hint="(default: laptop on a CPU, paper on a GPU)",
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


@dataclass(frozen=True)
class _Training:
    """What `draft train` would do with a stage.

    Attributes:
        iterations: of the stage.
        environments: worlds at once.
        ground: "flat" or "uneven".
        minutes: expected on a CPU [min]; None where nothing is known.
    """

    iterations: int
    environments: int
    ground: str
    minutes: float | None


@app.command
def show(
    design: MaybeDesign = None,
    /,
    stage: Stage = None,
    recipe: RecipeName = None,
    values: Numbers = (),
    json: JsonOutput = False,
) -> int:
    """Show what would train here, and every number: value, unit, source, meaning."""
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
        told = {"design": name, "scale": scale, "stage": stage}
        told |= _setting(config, here) | _stages(chosen, plans)
        print(json_.dumps(told | {"numbers": _numbers(groups, whys)}))
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


def _sourced(row: Row, recipe: Recipe, given: Mapping[str, Any]) -> Row:
    """A number with the source that it has in a recipe, unless it was given otherwise."""
    source = None if row.name in given else recipe.source(row.name)
    return row if source is None else row._replace(source=source)


def _processes(config: Config, here: Machine) -> int | None:
    """Processes that would share a run; None where there is no engine."""
    if here.engine is None:
        return None
    return replicas(None, config.learning.environments, here.engine, here.devices)


def _training(stage: str, config: Config, recipe: Recipe, here: Machine) -> _Training:
    """What would be trained in a stage."""
    learning, ground = config.learning, recipe.ground(stage)
    count, took = learning.iterations(stage), None
    processes = _processes(config, here)
    if here.on_cpu and here.engine is not None and processes is not None:
        steps = count * learning.environments * learning.steps
        took = minutes(steps, here.engine, processes, ground)
    return _Training(count, learning.environments, ground, took)


def _engine_line(config: Config, here: Machine) -> str:
    """What would step the worlds, and why, in a line."""
    cores = f"{here.cores} core{'s' * (here.cores != 1)}"
    if here.engine is None:
        return f"engine: none yet, {here.missing} is not installed ({REMEDY}); {cores}"
    words = f"engine: {KINDS[here.engine.name]} ({here.engine.why})"
    if not here.on_cpu:
        return f"{words}, {', '.join(here.devices)}"
    count = _processes(config, here)
    return f"{words}, {cores}, {count} process{'es' * (count != 1)}"


def _recipe_lines(recipe: Recipe, plans: Mapping[str, _Training]) -> list[str]:
    """What would be trained, a line for each stage."""
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


def _scale(word: str) -> tuple[str, float]:
    """Name and scale of a design."""
    (design,) = open_designs([word])
    found = quadruped(design)
    return found.name, found.scale


def _about(config: Config, group: str) -> str:
    """First line of a group's description."""
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
    """A value in a few digits, as `--set` takes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, tuple):
        return f"{value:.4g}"
    inside = ", ".join(map(_written, value))
    return f"[{inside}]"


def _setting(config: Config, here: Machine) -> dict[str, Any]:
    """What would train, as plain data."""
    engine = here.engine
    return {
        "devices": here.devices,
        "engine": engine and engine.name,
        "why": engine and engine.why,
        "missing": here.missing,
        "cores": here.cores,
        "processes": _processes(config, here),
    }


def _stages(recipe: Recipe, plans: Mapping[str, _Training]) -> dict[str, Any]:
    """What would be trained, as plain data."""
    return {
        "recipe": recipe.name,
        "ground": {stage: plan.ground for stage, plan in plans.items()},
        "minutes": {stage: plan.minutes for stage, plan in plans.items()},
    }


def _numbers(groups: Mapping[str, list[Row]], whys: Mapping[str, str]) -> dict[str, Any]:
    """Numbers as plain data, each with the recipe's reason where it has one."""
    return {
        row.name: {key: value for key, value in row._asdict().items() if key != "name"}
        | {"why": whys.get(row.name)}
        for rows in groups.values()
        for row in rows
    }
