"""What an assistant can do below a folder: the records of commands as JSON, and pictures."""

from __future__ import annotations

import contextlib
import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import yaml
from pydantic import BeforeValidator, Field

from draft import files
from draft.assistant.folder import Folder, Values
from draft.assistant.tool import Record, tool
from draft.design.report import designs_of, summary
from draft.errors import DraftError, suggest
from draft.metrics.record import descriptions, measure, record
from draft.settings import Shown
from draft.spec.field_types import Sentence
from draft.variation.words import ranges

if TYPE_CHECKING:
    from draft.learn.training.progress import Progress


def _read(given: object) -> object:
    """A list or an object that an assistant has sent as a text of JSON, else what is given."""
    if isinstance(given, str) and given.startswith(("[", "{")):
        with contextlib.suppress(ValueError, RecursionError):
            given = json.loads(given)
    return tuple(given) if isinstance(given, list) else given


Texts = Annotated[
    tuple[str, ...],
    BeforeValidator(lambda given: (given,) if isinstance(given, str) else given),
    BeforeValidator(_read),
    Shown(expects="a list of texts"),
]
Reference = Annotated[
    str,
    Field(description="A design: a robot (quadruped, FOLDER), or ROBOT:DESIGN (quadruped:bear)."),
]
References = Annotated[Texts, Field(description="Designs, each ROBOT or ROBOT:DESIGN.")]
Set = Annotated[
    Values | None,
    Field(
        description="Values that override the design's, by name: a number, an expression ('*1.2' "
        "scales), or null. Names are parameters, actuators.CLASS.QUANTITY, and payload [kg], a "
        "block on the trunk."
    ),
    BeforeValidator(_read),
    Shown("", "none", expects="an object of numbers, texts and nulls by name"),
]
Metrics = Annotated[Texts, Field(description="Metrics; empty for all closed-form ones.")]
Numbers = Annotated[
    Texts,
    Field(description="Numbers: parameters and actuators.CLASS.QUANTITY; empty for none named."),
]
Conditions = Annotated[
    Texts, Field(description='Conditions, such as "mass <= 30" and "payload_hour >= 10".')
]
Ranges = Annotated[
    Texts, Field(description="Ranges: NAME=LOW:HIGH, NAME=LOW:HIGH:log or NAME=A,B,C.")
]
Seed = Annotated[int, Field(ge=0, lt=2**31, description="Seed of what is drawn.")]
NewDesign = Annotated[str, Field(description="Name of a new design of a robot of the folder.")]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Pixels = Annotated[int, Field(ge=64, le=2000)]


@tool({})
def list_robots(folder: Folder) -> Record:
    """List the shipped robots, the robots of the folder and their designs, by reference."""
    return designs_of(folder.robots())


@tool({"folder": str}, writes=True)
def new_robot(
    folder: Folder,
    name: Annotated[str, Field(description="Name of the robot, or path of its new folder.")],
    like: Annotated[str, Field(description="Shipped robot to copy.")] = "hopper",
) -> Record:
    """Copy a shipped robot to a new folder, as a robot of your own without named designs."""
    from draft.spec.new import new_robot

    return {"folder": str(new_robot(folder.path(name), like))}


@tool(
    {"name": str, "design": str, "mass_kg": float, "n_joints": int, "accepted": bool}
    | {"findings": list, "parameters": dict, "actuators": dict, "bodies": dict}
)
def check(
    folder: Folder,
    design: Reference,
    values: Set = None,
    simulate: Annotated[
        bool, Field(description="Let servos hold the home pose for two seconds too.")
    ] = False,
) -> Record:
    """Resolve a design, and check whether it can be built.

    Verdict, findings with remedies, masses [kg], parameters with unit and range, actuators (SI).
    """
    found = folder.design(design, values)
    if found.accepted:
        model = found.build()
        found = model.simulate() if simulate else found
    return summary(found)


@tool({"metrics": dict | list})
def metrics(folder: Folder, design: Reference = "", values: Set = None) -> Record:
    """Measure what a design can do without learning, and the torque margin of each joint.

    Without a design: unit, definition, formula, source and better direction of every metric.
    """
    if not design:
        return {"metrics": descriptions()}
    found = folder.design(design, values)
    return record(found, measure(found))


@tool(
    {"design": str, "metrics": dict, "numbers": dict},
    "name fewer metrics by `metrics`, or fewer numbers by `by`",
)
def sensitivity(
    folder: Folder,
    design: Reference,
    metrics: Metrics = (),
    by: Numbers = (),
    values: Set = None,
    seed: Seed = 0,
) -> Record:
    """Effect of each number of a design on its metrics.

    up and down are relative changes for 1 %; step_up and step_down changes for a designer's step,
    of which low and high are the 90 % band by the errors of the laws.
    """
    from draft.explore.sensitivity import sensitivity

    return sensitivity(folder.design(design, values), metrics, by, seed=seed).record()


@tool(
    {"met": bool, "change": float, "moved": list, "excluded_together": list, "misses": list}
    | {"designs_computed": int, "file": str | None},
    writes=True,
)
def solve(
    folder: Folder,
    design: Reference,
    conditions: Conditions,
    vary: Ranges = (),
    keep: Numbers = (),
    values: Set = None,
    seed: Seed = 0,
    save_as: NewDesign = "",
) -> Record:
    """Find the nearest accepted design that meets conditions, and why each number moved.

    Where none does, excluded_together is a smallest set of conditions that exclude each other.
    """
    from draft.explore.solve import solve

    path = folder.new_design(design, save_as) if save_as else None
    start = folder.design(design, values)
    found = solve(start, conditions, vary, keep, seed=seed)
    if not found.moved or found.conflict is not None:
        path = None
    if path is not None:
        files.write(path, found.design_file(start, conditions))
    return found.record() | {"file": None if path is None else str(path)}


@tool({"file": str}, writes=True)
def save_design(
    folder: Folder,
    design: Reference,
    name: NewDesign,
    values: Set,
    about: Annotated[
        Sentence, Field(description="A sentence about it."), Shown(expects="a sentence")
    ],
) -> Record:
    """Save a design with values that override its own, as a named design of its robot."""
    path = folder.new_design(design, name)
    document = {"doc": about, "values": dict(folder.design(design, values).values)}
    files.write(path, yaml.safe_dump(document, sort_keys=False, allow_unicode=True))
    return {"file": str(path)}


@tool(
    {"designs": dict, "against_first": list, "findings_alone": dict},
    "compare fewer designs, or name fewer metrics by `metrics`",
)
def compare(folder: Folder, designs: References, metrics: Metrics = (), seed: Seed = 0) -> Record:
    """Compare designs with the first: metrics, and what each changed number contributes.

    better is the probability that a design is better in a metric, given the errors of the laws.
    """
    from draft.explore.comparison import compare

    return compare([folder.design(one) for one in designs], metrics, seed=seed).record()


@tool(
    {"out": str, "designs": int, "rows": int, "accepted": int, "dropped": int}
    | {"refused_by": dict, "computed": int, "seconds": float, "table": list},
    "lower `rows`, or name fewer `metrics` and a new file",
    writes=True,
)
def screen(
    folder: Folder,
    design: Reference,
    vary: Ranges,
    out: Annotated[str, Field(description="Parquet file to write, such as screen.parquet.")],
    n: Annotated[Count, Field(description="Designs to draw.")] = 10_000,
    where: Annotated[
        str | None, Field(description='Condition on what is kept: "accepted and mass < 40".')
    ] = None,
    metrics: Metrics = (),
    values: Set = None,
    seed: Seed = 0,
    order_by: Annotated[str, Field(description="Column to sort by; -COLUMN for falling.")] = "",
    rows: Annotated[int, Field(ge=0, le=100_000, description="Rows to answer with.")] = 10,
) -> Record:
    """Screen many designs by closed-form metrics into a file, and count and show what is kept.

    Repeat it with other `order_by` and `rows` to see more: a finished file is only read.
    """
    from draft.explore.screen import screen

    choice, file = folder.choice(design), folder.path(out)
    robot = choice.spec if choice.design is None else choice.resolve()
    chosen = {"metrics": metrics or None, "where": where, "values": values, "seed": seed}
    found = screen(robot, vary=ranges(vary), n=n, out=file, **chosen)
    table, column = found.table(), order_by.removeprefix("-")
    if column not in ("", *table.column_names):
        known = suggest(column, table.column_names, "columns")
        raise DraftError(f"`order_by` '{column}' is no column of the screen", known)
    if column:
        table = table.sort_by([(column, "descending" if order_by != column else "ascending")])
    shown = table.slice(0, rows).to_pylist()
    return asdict(found) | {"out": str(found.out), "table": [_finite(one) for one in shown]}


@tool(None, "give a smaller `width` and `height`")
def picture(
    folder: Folder,
    designs: References,
    width: Annotated[Pixels, Field(description="Width [pixels].")] = 720,
    height: Annotated[Pixels, Field(description="Height [pixels].")] = 400,
    azimuth: Annotated[float, Field(description="Turn of the robots [deg].")] = 43.0,
    elevation: Annotated[float, Field(ge=0, le=89, description="Camera above [deg].")] = 12.0,
) -> bytes:
    """Draw designs side by side in their home poses, as a picture."""
    from draft.model.model import preview
    from draft.model.picture import draw, png, row

    found = [folder.design(one) for one in designs]
    if not found:
        raise DraftError("there is no design to draw", "name one or more by `designs`")
    models = [one.build() if one.accepted else preview(one) for one in found]
    return png(draw(row(models, math.radians(azimuth)), (180, -elevation), (width, height)))


@tool({"run": str, "iterations": int, "of": int, "last": dict}, writes=True, trains=True)
def train(
    folder: Folder,
    design: Reference,
    out: Annotated[str, Field(description="Folder of the run, such as runs/mine.")],
    minutes: Annotated[float, Field(gt=0, le=60, description="Time limit [min].")] = 1.0,
    stage: Annotated[str, Field(description="base, or velocity, terrain, push after it.")] = "base",
    seed: Seed = 0,
) -> Record:
    """Train a legged robot's policy for some minutes; the same call goes on with the run."""
    from draft.learn.training.options import TrainOptions
    from draft.learn.training.train import train

    told: list[Progress] = []
    run = train(
        folder.design(design),
        folder.path(out),
        told.append,
        minutes=minutes,
        stage=stage,
        seed=seed,
    )
    total = TrainOptions().total(run.plan)
    last = _finite(dict(told[-1].row)) if told else {}
    return {"run": str(run.folder), "iterations": run.done(), "of": total, "last": last}


def _finite(row: Record) -> Record:
    """A row whose numbers that are not finite are None, for JSON."""
    return {k: None if isinstance(x, float) and not math.isfinite(x) else x for k, x in row.items()}
