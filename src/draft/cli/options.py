"""Arguments and options that several commands share, and how their values are read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import tyro

from draft.cli.display.record import Clock
from draft.design import Design
from draft.design.references import find_design
from draft.errors import DraftError, ResolveError
from draft.spec.payload import MASS

DESIGN_FORMS = (
    "a shipped robot or design (quadruped, bear), SPEC:DESIGN, SPEC:FILE.yaml, the folder of a "
    "robot, or of a built model"
)
DesignArgument = Annotated[
    tyro.conf.Positional[str],
    tyro.conf.arg(metavar="DESIGN", help=f"The robot: {DESIGN_FORMS}."),
]
DesignArguments = Annotated[
    tyro.conf.Positional[tuple[str, ...]],
    tyro.conf.arg(
        metavar="DESIGN ...", help=f"Designs, each {DESIGN_FORMS}.", help_behavior_hint="(required)"
    ),
]
DesignName = Annotated[
    str | None,
    tyro.conf.arg(
        name="design",
        metavar="NAME|FILE",
        help="Named design or design file, if DESIGN names only a robot.",
        help_behavior_hint="(default: the values in parameters.yaml)",
    ),
]
Values = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        name="set",
        metavar="NAME=VALUE ...",
        help="Values that override the design's: thigh_length=0.3 actuators.leg.peak_torque=90, or "
        "scale them: 'thigh_length=*1.2'.",
        help_behavior_hint="(default: none)",
    ),
]
Payload = Annotated[
    float | None,
    tyro.conf.arg(
        metavar="KG",
        help="Mass of a block on the trunk; its density is 500 kg/m3, or --set "
        "payload_density=VALUE.",
        help_behavior_hint="(default: none)",
    ),
]
Population = Annotated[
    Literal["humanoid", "quadruped"] | None,
    tyro.conf.arg(
        metavar="{humanoid,quadruped}",
        help="Population whose structure trends apply.",
        help_behavior_hint="(default: by its limbs)",
    ),
]
Torques = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        name="torque",
        metavar="VALUE|NAME=VALUE ...",
        help="Peak torques [N m]: 17 for the joints without a plausible one, hip=20 knee=30 for "
        "the joints of these names or roles.",
        help_behavior_hint="(default: as stated, else as surveyed)",
    ),
]
Speeds = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        name="speed",
        metavar="VALUE|NAME=VALUE ...",
        help="No-load speeds [rad/s], as for --torque.",
        help_behavior_hint="(default: as stated, else as surveyed)",
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
        metavar="{hip,knee}",
        help="Location of the knee motors of a quadruped.",
        help_behavior_hint="(default: by the shapes around the knee, else as surveyed)",
    ),
]
Root = Annotated[
    str,
    tyro.conf.arg(
        metavar="LINK",
        help="Link or body from which down the file is read, such as one of several robots.",
        help_behavior_hint="(default: all of it)",
    ),
]
JsonOutput = Annotated[bool, tyro.conf.arg(help="Print one JSON object and nothing else.")]
OwnPolicies = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        metavar="FILE.onnx ...",
        help="Policies to walk with before those that ship, from 'draft play RUN --onnx'.",
        help_behavior_hint="(default: none)",
    ),
]
ShippedSkill = Annotated[
    Literal["walk", "run", "climb", "push", "machine"] | None,
    tyro.conf.arg(
        metavar="{walk,run,climb,push,machine}",
        help="Which of the policies that ship; that for a machine observes what sensors give.",
        help_behavior_hint="(default: walk)",
    ),
]
HostOption = Annotated[
    str,
    tyro.conf.arg(metavar="ADDRESS", help="Address of the page; a public one needs --token."),
]
PortOption = Annotated[
    int, tyro.conf.arg(metavar="N", help="Port of the page; 0 for any free one.")
]
TokenOption = Annotated[
    str | None,
    tyro.conf.arg(
        metavar="SECRET",
        help="Secret that visitors need: 16 or more letters, digits, - and _.",
        help_behavior_hint="(default: none, on this machine only)",
    ),
]


def open_design(
    reference: str, design: str | None, values: Sequence[str], payload: float | None = None
) -> tuple[Design, Clock]:
    """Load a robot and resolve the design that the command line names, timed.

    Raises:
        DraftError: there is no such robot or design, or the values give no design.
    """
    clock = Clock()
    choice = find_design(reference, design)
    clock.lap("load")
    resolved = choice.resolve(parse_values(values, payload))
    clock.lap("resolve")
    return resolved, clock


def parse_values(
    values: Sequence[str], payload: float | None = None
) -> dict[str, float | str | None]:
    """Read NAME=VALUE words: a number, an expression, a part's name, or null.

    Args:
        values: the words.
        payload: mass on the trunk [kg], as another word would give it.

    Raises:
        ResolveError: a word lacks '=', or a name is given twice.
    """
    table: dict[str, float | str | None] = {}
    if payload is not None:
        values = (f"{MASS}={payload!r}", *values)
    for word in values:
        name, equals, text = word.partition("=")
        name, text = name.strip(), text.strip()
        if not equals or not name or not text:
            raise ResolveError(f"--set '{word}' is not NAME=VALUE", "such as thigh_length=0.3")
        if name in table:
            raise ResolveError(f"--set gives '{name}' twice", "give it once")
        table[name] = None if text == "null" else _number(text)
    return table


def check_folder(out: str | None, name: str = "out") -> None:
    """Refuse an empty path, which would be the current folder.

    Raises:
        DraftError: it is empty.
    """
    if out is not None and not out.strip():
        cause = f"--{name} names no folder"
        raise DraftError(cause, f"give one, or omit --{name}")


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
