"""What several commands share: which robot, which design, which numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import tyro

from draft.cli.display.record import Clock
from draft.design import Design
from draft.errors import DraftError, Problem, ResolveError
from draft.spec import Spec, load

Robot = Annotated[
    tyro.conf.Positional[str],
    tyro.conf.arg(metavar="SPEC", help="A shipped robot's name, or a robot's folder."),
]
DesignName = Annotated[
    str | None,
    tyro.conf.arg(
        name="design",
        metavar="NAME|FILE",
        help="A named design, or a design file.",
        help_behavior_hint="(default: the values in parameters.yaml)",
    ),
]
Values = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        name="set",
        metavar="NAME=VALUE",
        help="Values that win: thigh_length=0.3 actuators.leg.peak_torque=90",
        help_behavior_hint="",
    ),
]

Population = Annotated[
    Literal["humanoid", "quadruped"] | None,
    tyro.conf.arg(
        help="Whose structure trends hold.", help_behavior_hint="(default: by its limbs)"
    ),
]
Torques = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        name="torque",
        metavar="VALUE|NAME=VALUE",
        help="Peak torques [N m]: 17 for the joints without a plausible one, hip=20 knee=30 for "
        "the joints of these names or roles.",
        help_behavior_hint="",
    ),
]
Speeds = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        name="speed",
        metavar="VALUE|NAME=VALUE",
        help="No-load speeds [rad/s], as for --torque.",
        help_behavior_hint="",
    ),
]
Strict = Annotated[
    bool,
    tyro.conf.arg(help="Refuse a file with an implausible torque, instead of replacing it."),
]
KneeDrive = Annotated[
    Literal["hip", "knee"] | None,
    tyro.conf.arg(
        name="knee-drive",
        help="Where the knees' motors of a quadruped sit.",
        help_behavior_hint="(default: by the shapes around the knee, else as surveyed)",
    ),
]
JsonOutput = Annotated[bool, tyro.conf.arg(help="Print one JSON object and nothing else.")]


def open_design(robot: str, design: str | None, values: Sequence[str]) -> tuple[Design, Clock]:
    """Load a robot and resolve what the command line asks for, timed.

    Raises:
        DraftError: no such robot or design, or values that do not work.
    """
    clock = Clock()
    spec = load(robot)
    clock.lap("load")
    resolved = resolve(spec, design, values)
    clock.lap("resolve")
    return resolved, clock


def resolve(spec: Spec, design: str | None, values: Sequence[str]) -> Design:
    """Resolve what the command line asks for.

    Raises:
        DraftError: no such design, a value that is not NAME=VALUE, or values that do not work.
    """
    chosen: str | Path | None = design
    if design is not None and design.endswith((".yaml", ".yml")):
        chosen = Path(design)
    return spec.resolve(chosen, parse_values(values))


def parse_values(values: Sequence[str]) -> dict[str, float | str | None]:
    """Read NAME=VALUE words: a number, an expression, a part's name, or null.

    Raises:
        ResolveError: a word without '=', or a name given twice.
    """
    table: dict[str, float | str | None] = {}
    for word in values:
        name, equals, text = word.partition("=")
        name, text = name.strip(), text.strip()
        if not equals or not name or not text:
            raise ResolveError(
                Problem(f"--set '{word}' is not NAME=VALUE", None, "such as thigh_length=0.3")
            )
        if name in table:
            raise ResolveError(Problem(f"--set gives '{name}' twice", None, "give it once"))
        table[name] = None if text == "null" else _number(text)
    return table


def check_folder(out: str | None) -> None:
    """Refuse an empty --out, which as a path would be the current folder.

    Raises:
        DraftError: it is empty.
    """
    if out is not None and not out.strip():
        raise DraftError(Problem("--out names no folder", None, "give one, or leave --out away"))


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
