"""Types of the fields in the files: names, numbers or expressions, axes; and the base model.

All numbers are SI (m, kg, s, rad, N m). Where a `Number` is expected, a string is an expression
over parameters and actuator values (see `draft.spec.expressions`).

Tags of unions are in parentheses, `(basic)`: pydantic puts them into the location of an error, and
no key of a file has parentheses.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, ClassVar, Literal, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

NAME_PATTERN = r"^[A-Za-z_][A-Za-z0-9_]*$"

MAX_NAME = 64

Name = Annotated[str, StringConstraints(pattern=NAME_PATTERN, max_length=MAX_NAME)]
Prefix = Annotated[
    str, StringConstraints(pattern=r"^([A-Za-z_][A-Za-z0-9_]*)?$", max_length=MAX_NAME)
]
Sentence = Annotated[str, StringConstraints(min_length=1, max_length=400)]


def _number(value: object) -> float | str:
    if isinstance(value, str) and value.strip():
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise PydanticCustomError("number", "expected a number or an expression")
    return float(value)


def _plain_number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise PydanticCustomError("plain_number", "expected a plain number")
    return float(value)


Number = Annotated[
    float | str,
    BeforeValidator(_number),
    WithJsonSchema({"type": ["number", "string"], "description": "A number or an expression."}),
]
PlainNumber = Annotated[float, BeforeValidator(_plain_number), WithJsonSchema({"type": "number"})]


NumberVector = Annotated[list[Number], Field(min_length=3, max_length=3)]
NamedAxis = Literal["x", "y", "z", "-x", "-y", "-z"]


def _axis_kind(value: object) -> str:
    if isinstance(value, list):
        return "(vector)"
    return "(name)" if value in get_args(NamedAxis) else "(none)"


Axis = Annotated[
    Annotated[NamedAxis, Tag("(name)")] | Annotated[NumberVector, Tag("(vector)")],
    Discriminator(
        _axis_kind,
        custom_error_type="axis",
        custom_error_message="expected x, y, z, -x, -y, -z or a list of three components",
    ),
    Field(description="x, y, z, -x, -y, -z or three components; it is normalised."),
]


def broken_rule(cause: str, remedy: str) -> PydanticCustomError:
    """Error for a validator to raise about fields that are valid alone and invalid together."""
    return PydanticCustomError("broken_rule", "{cause}", {"cause": cause, "remedy": remedy})


def unknown_keys(
    data: Iterable[object], known: Sequence[str], absent: Mapping[str, str] | None = None
) -> PydanticCustomError:
    """Error for a validator to raise about keys of a mapping that are not known.

    Args:
        data: keys of the mapping.
        known: keys that may be there.
        absent: what to do about keys that others like it have, and it has not.
    """
    unknown = [key for key in data if key not in known]
    context = {"unknown": unknown, "known": [*known], "absent": absent or {}}
    return PydanticCustomError("unknown_keys", "", context)


class Model(BaseModel):
    """Base of all models here: unknown keys are errors, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)
    # What to do about keys that others like it have, and it has not.
    absent: ClassVar[Mapping[str, str]] = {}

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: object) -> object:
        """Report unknown keys first: a misspelt key would be reported as missing otherwise."""
        if isinstance(data, dict) and not data.keys() <= cls.model_fields.keys():
            raise unknown_keys(data, list(cls.model_fields), cls.absent)
        return data
