"""Typed models of the files of a robot.

`draft.spec.field_types` has the types of the fields. `draft schema` writes JSON Schemas of these
models for editors.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import pydantic
from pydantic import BeforeValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from draft.laws import quantities
from draft.laws.actuators import ACTUATOR_LAWS
from draft.laws.quantities import CORNER
from draft.laws.structure import STRUCTURE_LAWS
from draft.spec.field_types import (
    Model,
    Name,
    Number,
    NumberVector,
    PlainNumber,
    Prefix,
    Sentence,
    broken_rule,
)
from draft.spec.primitives import LINKS
from draft.spec.primitives.basic import LinkBase
from draft.spec.primitives.fixed import FixedBase
from draft.spec.primitives.root import Trunk
from draft.spec.primitives.shape import Shape

_JSON_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*\.json")
_CSV_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*\.csv")


@dataclass(frozen=True)
class _NamedLaws:
    """Type of the name of a set of laws, of a registry or a file of the robot."""

    registry: Mapping[str, object]
    kind: str

    def __get_pydantic_core_schema__(
        self, source: object, handler: pydantic.GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: pydantic.GetJsonSchemaHandler
    ) -> dict[str, str]:
        return {"type": "string", "pattern": f"^({'|'.join(self.registry)}|{_JSON_FILE.pattern})$"}

    def _read(self, value: object) -> str:
        if isinstance(value, str) and (value in self.registry or _JSON_FILE.fullmatch(value)):
            return value
        names = ", ".join(self.registry)
        message = f"expected {names} or the name of a .json file in the robot's folder"
        raise PydanticCustomError(self.kind, message)  # type: ignore[arg-type]


def _catalogue_file(value: object) -> str:
    if not isinstance(value, str) or not _CSV_FILE.fullmatch(value):
        raise PydanticCustomError(
            "catalogue_file", "expected the name of a .csv file in the robot's folder"
        )
    return value


TrendSet = Annotated[str, _NamedLaws(ACTUATOR_LAWS, "trend_set")]
StructureSet = Annotated[str, _NamedLaws(STRUCTURE_LAWS, "structure_set")]
CatalogueFile = Annotated[
    str,
    BeforeValidator(_catalogue_file),
    WithJsonSchema({"type": "string", "pattern": f"^({_CSV_FILE.pattern})$"}),
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
    """A number that the robot depends on."""

    value: Number
    """Default value, or an expression for a derived parameter."""
    unit: Unit
    """Unit; '1' for a dimensionless number."""
    range: Annotated[list[PlainNumber], Field(min_length=2, max_length=2)] | None = None
    """Lowest and highest valid value. Required if `value` is a number."""
    doc: Sentence
    """Description in a sentence."""


class _ActuatorClass(Model):
    """A class of actuators.

    State any two of peak torque, no-load speed, reduction and peak power; trends fitted to real
    modules predict the rest. A stated quantity overrides its trend.
    """

    doc: Sentence | None = None
    """Its purpose, in a sentence."""
    kind: Literal["module", "servo"] | None = None
    """Family whose laws and limits apply: `module`, motors with a small or strain-wave gear, from
    4 N m on; or `servo`, small motors with many gears and electronics in a box. Default: that of
    `like`, else `module`."""
    like: str | None = None
    """Part of the catalogue to start from: its measured values apply, and the trends predict only
    the effect of deviations from it."""
    shape: Shape | None = None
    """Part of your own in place of every actuator of the class."""

    @model_validator(mode="after")
    def _one_mass(self) -> Self:
        density = self.shape.density if self.shape else None
        if density is not None and getattr(self, "mass", None) is not None:
            remedy = "state one of them, 'mass: ...' [kg] or 'density: ...' [kg/m3]"
            raise broken_rule("a class with both a 'mass' and the 'density' of its shape", remedy)
        return self


if TYPE_CHECKING:
    ActuatorClass = _ActuatorClass
else:
    ActuatorClass = pydantic.create_model(
        "ActuatorClass",
        __base__=_ActuatorClass,
        __doc__=_ActuatorClass.__doc__,
        **{
            name: (
                (Number | None) if one.default is None else Number,
                Field(one.default, description=one.text),
            )
            for name, one in quantities.QUANTITIES.items()
            if one.stated
        },
    )
_OTHERS = ("doc", "kind", "like", "shape")
STATED = tuple(name for name in ActuatorClass.model_fields if name not in _OTHERS)
TREND = "trend"


def asks_for_trend(quantity: str, value: object) -> bool:
    """Whether a value of an actuator class is the word `trend`, of a quantity that takes it."""
    return quantity == CORNER and isinstance(value, str) and value.strip() == TREND


class Battery(Model):
    """The battery in the trunk. State its energy, its mass, or both."""

    energy: Number | None = None
    """Energy [Wh]. Default: its mass times the specific energy of surveyed batteries."""
    mass: Number | None = None
    """Mass [kg]. Default: its energy over the specific energy of surveyed batteries."""

    @model_validator(mode="after")
    def _stated(self) -> Self:
        if self.energy is None and self.mass is None:
            remedy = "state 'energy: ...' [Wh] or 'mass: ...' [kg], or omit 'battery'"
            raise broken_rule("a battery with neither 'energy' nor 'mass'", remedy)
        return self


class ParametersFile(Model):
    """parameters.yaml: the numbers and the actuators."""

    name: Name
    """Name of the robot and of its model."""
    doc: Sentence | None = None
    """Description of the robot in a sentence."""
    population: Population
    """Surveyed population whose structure trends apply."""
    trends: TrendSet = "draft"
    """Actuator laws: `draft`, Draft's own; `paper`, the published forms; or a file that
    `draft trends fit` wrote, in the folder of the robot."""
    catalogue: CatalogueFile | None = None
    """Modules of your own: a table with the columns of the shipped one, in the folder of the robot.
    `like` and the design filter know them besides the shipped ones."""
    structure: StructureSet = "calibrated"
    """Structure trends of the shipped survey: `calibrated`, with the density of the trunk by volume
    and leg length, for robots on two or four legs; `paper`, with the published density; or a file
    that `draft survey fit` wrote, in the folder of the robot."""
    parameters: dict[Name, Parameter]
    """Parameters by name."""
    actuators: dict[Name, ActuatorClass]
    """Actuator classes by name. Expressions read `class.radius`, `class.mass`, ..."""
    battery: Battery | None = None
    """Battery in the trunk. Default: the share of the mass that surveyed robots have. The trend of
    the trunk's mass includes such a battery; a stated one replaces it."""
    electronics_power: Number | None = None
    """Power of computers, sensors and idle drives [W]. Default: what robots of its mass draw that
    stand."""
    allow: list[str] = Field([])
    """Errors of the design filter to accept as warnings: `id` or `id:where`."""


# --- tree.yaml -----------------------------------------------------------------------------


class JointChange(Model):
    """Changes of a joint in one use of a chain."""

    range: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None
    """Lowest and highest angle of this copy [rad]; for a slide, position [m]."""
    home: Number | None = None
    """Angle [rad], or position of a slide [m], of this copy in the home pose."""
    reverse: bool = False
    """Whether its axis is reversed with respect to the chain. Range and home refer to the reversed
    axis."""


class ChainUse(Model):
    """A use of a chain in the tree, which may be mirrored."""

    chain: Name
    """Name of the chain."""
    prefix: Prefix = ""
    """Prefix of every name in it."""
    at: NumberVector | None = None
    """Origin of its first link in the frame of the parent [m], before mirroring. Default: that of
    the link."""
    rpy: NumberVector | None = None
    """Roll, pitch, yaw of its first link in the frame of the parent [rad], before mirroring.
    Default: those of the link."""
    mirror: Literal["x", "y", "xy"] | None = None
    """Mirror plane x = 0, y = 0 or both, in the frame of the parent. The attachment is mirrored
    too; joint axes and ranges are kept, so that one sign means the same motion on every copy."""
    joints: dict[Name, JointChange] = Field({})
    """Changes of joints in this use, by their names in the chain. Real robots often mirror ranges
    or axes."""


def _node_kind(value: object) -> str:
    if isinstance(value, dict) and "chain" in value:
        return "(chain)"
    kind = value.get("type", "basic") if isinstance(value, dict) else "basic"
    return f"({kind})"


class _AnyNode:
    """Core schema of a link or a use of a chain: the links are those of the present primitives."""

    def __get_pydantic_core_schema__(
        self, source: object, handler: pydantic.GetCoreSchemaHandler
    ) -> CoreSchema:
        *first, last = LINKS
        message = f"expected {', '.join(first)} or {last} (or 'chain' in place of 'type')"
        kinds = {"chain": ChainUse, **LINKS}
        return core_schema.tagged_union_schema(
            {f"({name})": handler.generate_schema(model) for name, model in kinds.items()},
            _node_kind,
            custom_error_type="link_type",
            custom_error_message=message,
        )


if TYPE_CHECKING:
    Node = ChainUse | LinkBase
else:
    Node = Annotated[Any, _AnyNode()]


# Bases that a tree grows from, by their `type`.
ROOTS = {"root": Trunk, "fixed": FixedBase}


def _root_kind(value: object) -> str:
    return f"({value.get('type', 'root') if isinstance(value, dict) else 'root'})"


class TreeFile(Model):
    """tree.yaml: the tree of links and joints."""

    # By `tree_file`: extensions are not loaded while Draft is.
    model_config = pydantic.ConfigDict(defer_build=True)

    chains: dict[Name, Annotated[list[Node], Field(min_length=1)]] = Field({})
    """Serial chains of links: each link is attached to the previous one."""
    tree: Annotated[
        Annotated[Trunk, Tag("(root)")] | Annotated[FixedBase, Tag("(fixed)")],
        Discriminator(
            _root_kind,
            custom_error_type="root_type",
            custom_error_message=f"expected {' or '.join(ROOTS)}",
        ),
    ]
    """The trunk, or a base that is bolted to the world, with all links attached to it."""


# --- designs/NAME.yaml ---------------------------------------------------------------------


class DesignFile(Model):
    """designs/NAME.yaml: a named design is a partial table of values."""

    doc: Sentence
    """Description of the design in a sentence."""
    values: dict[str, Number | None]
    """Values by parameter or actuators.CLASS.QUANTITY; null removes a stated quantity. An
    expression may read the number that it replaces, `1.2*thigh_length`, or short `"*1.2"`."""
    resolved: dict[str, Any] | None = None
    """All resulting numbers, in files that Draft writes. It is not read."""


def tree_file() -> type[TreeFile]:
    """Model of tree.yaml, with the links of extensions."""
    _complete(tuple(LINKS.values()))
    return TreeFile


@lru_cache(maxsize=1)
def _complete(links: tuple[type[LinkBase], ...]) -> None:
    """Build the models that have links, again where a script has added a primitive."""
    models = (*links, *ROOTS.values(), TreeFile)
    for model in models:
        # Each would build on what another one was before.
        if "__pydantic_core_schema__" in model.__dict__:
            del model.__pydantic_core_schema__
    for model in models:
        model.model_rebuild(force=True, _types_namespace={"Node": Node})
