"""The files of a robot as typed models: what a person may write, and in which words.

The types of the words are in `draft.spec.words`. JSON Schemas for editors are generated from these
models (`draft schema`).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

from pydantic import BeforeValidator, Discriminator, Field, Tag, WithJsonSchema
from pydantic_core import PydanticCustomError

from draft.spec.primitives import LINKS
from draft.spec.primitives.basic import LinkBase
from draft.spec.primitives.root import Trunk
from draft.spec.words import Model, Name, Number, NumberVector, PlainNumber, Prefix, Sentence

_JSON_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*\.json")
_TREND_SET = re.compile(f"draft|paper|{_JSON_FILE.pattern}")


def _trend_set(value: Any) -> str:
    if not isinstance(value, str) or not _TREND_SET.fullmatch(value):
        raise PydanticCustomError(
            "trend_set", "expected draft, paper or the name of a .json file in the robot's folder"
        )
    return value


def _structure_file(value: Any) -> str:
    if not isinstance(value, str) or not _JSON_FILE.fullmatch(value):
        raise PydanticCustomError(
            "structure_file", "expected the name of a .json file in the robot's folder"
        )
    return value


TrendSet = Annotated[
    str,
    BeforeValidator(_trend_set),
    WithJsonSchema({"type": "string", "pattern": f"^({_TREND_SET.pattern})$"}),
]
StructureFile = Annotated[
    str,
    BeforeValidator(_structure_file),
    WithJsonSchema({"type": "string", "pattern": f"^({_JSON_FILE.pattern})$"}),
]
Population = Literal["humanoid", "quadruped"]
Unit = Annotated[
    Literal[
        "1",
        "m",
        "kg",
        "s",
        "rad",
        "N",
        "N m",
        "W",
        "m/s",
        "rad/s",
        "kg/m",
        "kg/m3",
        "kg m2",
        "N m s",
    ],
    BeforeValidator(lambda value: "1" if value == 1 else value),
]


# --- parameters.yaml -----------------------------------------------------------------------


class Parameter(Model):
    """One number that the robot is made from."""

    value: Number
    """The default, or an expression for a derived parameter."""
    unit: Unit
    """Its unit; '1' for a pure number."""
    range: Annotated[list[PlainNumber], Field(min_length=2, max_length=2)] | None = None
    """Lowest and highest value that make sense. Required where `value` is a number."""
    doc: Sentence
    """What it is, in a sentence."""


class ActuatorClass(Model):
    """One kind of actuator.

    State any two of peak torque, no-load speed, reduction and peak power; trends fitted to real
    modules give the rest. What is stated wins.
    """

    doc: Sentence | None = None
    """What it is for."""
    like: str | None = None
    """A part of the catalogue to start from: its measured values hold, and the trends charge
    only the deviation from it."""
    peak_torque: Number | None = None
    """Peak torque at the output [N m]."""
    no_load_speed: Number | None = None
    """No-load speed at the output [rad/s]."""
    gear_ratio: Number | None = None
    """Reduction, motor turns per output turn."""
    peak_power: Number | None = None
    """Peak mechanical power [W]; the trend's is torque x speed / 4."""
    aspect_ratio: Number | None = None
    """Length over diameter of the module."""
    mass: Number | None = None
    """Mass of the whole module [kg]."""
    radius: Number | None = None
    """Radius of the module [m]."""
    length: Number | None = None
    """Length of the module along its axis [m]."""
    rotor_inertia: Number | None = None
    """Inertia of the rotor about its axis, on the motor side [kg m2]."""
    armature: Number | None = None
    """Rotor inertia seen at the output [kg m2]; else reduction squared x rotor inertia."""
    friction_loss: Number = 0.0
    """Dry friction at the output [N m]."""
    damping: Number = 0.0
    """Viscous friction at the output [N m s/rad]."""


QUANTITIES = tuple(name for name in ActuatorClass.model_fields if name not in ("doc", "like"))


class ParametersFile(Model):
    """parameters.yaml: the numbers and the actuators."""

    name: Name
    """Name of the robot and of its model."""
    doc: Sentence | None = None
    """What the robot is, in a sentence."""
    population: Population
    """Which surveyed population's structure trends hold."""
    trends: TrendSet = "draft"
    """Which actuator laws hold: `draft`, Draft's own; `paper`, the published forms; or a file in
    the robot's folder that `draft trends fit --out` wrote."""
    structure: StructureFile | None = None
    """A file in the robot's folder that `draft survey fit --out` wrote: its structure trends hold
    instead of those of the shipped survey."""
    parameters: dict[Name, Parameter]
    """The parameters by name."""
    actuators: dict[Name, ActuatorClass]
    """The actuator classes by name; expressions read them as `class.radius`, `class.mass`, ..."""
    allow: list[str] = Field([])
    """Findings of the design filter to let pass as warnings: `id` or `id:where`."""


# --- tree.yaml -----------------------------------------------------------------------------


class JointChange(Model):
    """What one use of a chain changes of a joint."""

    range: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None
    """Lowest and highest angle of this copy [rad]; of a slide, place [m]."""
    home: Number | None = None
    """Angle [rad], or place of a slide [m], of this copy in the home pose."""
    reverse: bool = False
    """Whether its positive motion is the other way round than the chain's. Range and home are those
    of the axis so reversed."""


class ChainUse(Model):
    """A chain put in the tree, perhaps mirrored."""

    chain: Name
    """Which chain."""
    prefix: Prefix = ""
    """Put before every name in it."""
    at: NumberVector | None = None
    """Origin of its first link in the parent's frame [m], before mirroring; else the link's own."""
    rpy: NumberVector | None = None
    """Roll, pitch, yaw of its first link in the parent's frame [rad], before mirroring; else the
    link's own."""
    mirror: Literal["x", "y", "xy"] | None = None
    """Reflect it, with its attachment, through the plane x = 0, y = 0 or both of the parent's
    frame. Joint axes and ranges stay, so that one sign means the same motion on every copy."""
    joints: dict[Name, JointChange] = Field({})
    """What this use changes of the chain's joints, by their names in the chain: real robots often
    mirror ranges, or axes too."""


def _node_kind(value: Any) -> str:
    if isinstance(value, dict) and "chain" in value:
        return "(chain)"
    kind = value.get("type", "basic") if isinstance(value, dict) else "basic"
    return f"({kind})"


if TYPE_CHECKING:
    Node = ChainUse | LinkBase
else:
    *_first, _last = (link.type_name() for link in LINKS)
    Node = Annotated[
        Union[
            Annotated[ChainUse, Tag("(chain)")],
            *(Annotated[link, Tag(f"({link.type_name()})")] for link in LINKS),
        ],
        Discriminator(
            _node_kind,
            custom_error_type="link_type",
            custom_error_message=f"expected {', '.join(_first)} or {_last} "
            "(or 'chain' in place of 'type')",
        ),
    ]


class TreeFile(Model):
    """tree.yaml: which link hangs on which, by which joint."""

    chains: dict[Name, Annotated[list[Node], Field(min_length=1)]] = Field({})
    """Serial chains of links, each hanging on the one before it."""
    tree: Trunk
    """The trunk and all it carries."""


# --- designs/NAME.yaml ---------------------------------------------------------------------


class DesignFile(Model):
    """designs/NAME.yaml: a named design is a partial table of values."""

    doc: Sentence
    """What the design is, in a sentence."""
    values: dict[str, Number | None]
    """Parameter, or actuators.CLASS.QUANTITY, to value; null takes a stated quantity back."""
    resolved: dict[str, Any] | None = None
    """What the values came to, in files that Draft writes; not read."""


for _model in (*LINKS, Trunk, TreeFile):
    _model.model_rebuild(_types_namespace={"Node": Node})
