"""Settings of a task as one frozen, checked record: for Python, the command line and files.

A field states its type, range, default and meaning (its docstring) in one place. A function that
`takes` the record has its fields as keyword arguments, the command line turns them into options,
and `Settings.of` reads what a file or a worker states.
"""

from __future__ import annotations

import ast
import functools
import inspect
import re
import textwrap
from collections.abc import Callable, Mapping
from typing import Any, Concatenate, Literal, NamedTuple, ParamSpec, Self, TypeVar, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from draft.errors import DraftError, Problem, suggest

P = ParamSpec("P")
Subject = TypeVar("Subject")
Result = TypeVar("Result")
_KINDS = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}


class Shown(NamedTuple):
    """Appearance of a field in the help of a command and in messages.

    Attributes:
        metavar: placeholder of the value; "" for that of the type.
        default: description of the default where it is None or empty.
        name: name of the option where it is not that of the field.
        expects: description of valid values where type and range do not say it.
        unit: unit of the value, for messages.
    """

    metavar: str = ""
    default: str = ""
    name: str = ""
    expects: str = ""
    unit: str = ""


class Settings(BaseModel):
    """Base of all settings: values are frozen, of the exact type, finite, and within their range.

    Whole numbers are numbers too, a list is a tuple, and numbers of NumPy are plain ones.
    """

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )

    @field_validator("*", mode="wrap")
    @classmethod
    def _explain(
        cls, value: object, check: ValidatorFunctionWrapHandler, info: ValidationInfo
    ) -> object:
        """Check a value, and say what is expected instead of an invalid one."""
        try:
            return check(_plain(value))
        except ValidationError as error:
            first = error.errors()[0]
            if first["type"] in ("literal_error", "broken_rule"):
                raise
            words = {"words": expected(cls.model_fields[info.field_name or ""])}
            raise PydanticCustomError("expected", "expected {words}", words) from None

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Self:
        """Check values by name.

        Args:
            values: the values; for the others the defaults hold.

        Raises:
            DraftError: a name is unknown, a value is missing, or one is invalid; all of them.
        """
        try:
            return cls.model_validate(dict(values))
        except ValidationError as error:
            problems = [cls._problem(dict(one)) for one in error.errors()]
            raise DraftError(list(dict.fromkeys(problems))) from None

    @classmethod
    def _problem(cls, error: Mapping[str, Any]) -> Problem:
        """Problem of an error of pydantic."""
        kind, context = error["type"], error.get("ctx", {})
        if not error["loc"]:
            return Problem(context.get("cause", error["msg"]), None, context.get("remedy", ""))
        name = str(error["loc"][0])
        if kind == "extra_forbidden":
            known = suggest(name, cls.model_fields, "settings")
            return Problem(f"there is no setting '{name}'", None, known)
        if kind == "missing":
            return Problem(f"`{name}` is missing", None, "state it")
        if kind == "broken_rule":
            return Problem(f"`{name}`: {context['cause']}", None, context["remedy"])
        field, given = cls.model_fields[name], _plain(error["input"])
        if kind == "literal_error":
            known = re.findall(r"'([^']*)'", context["expected"])
            remedy = suggest(str(given), known, "choose from")
            return Problem(f"`{name}` '{given}' is not known", None, remedy)
        otherwise = shown(field).default or _text(field.get_default())
        remedy = "" if field.is_required() else f"omit it for {otherwise}"
        words = repr(given) if isinstance(given, str) else _text(given)
        return Problem(f"`{name}` {words} is not {expected(field)}", None, remedy)


def shown(field: FieldInfo) -> Shown:
    """Appearance of a field."""
    return next((one for one in field.metadata if isinstance(one, Shown)), Shown())


def choices(kind: object) -> tuple[object, ...]:
    """Values of a Literal, alone or inside another type."""
    found = get_args(kind)
    if Literal[found] == kind:
        return found
    return next((inner for one in found if (inner := choices(one))), ())


def expected(field: FieldInfo) -> str:
    """Description of the valid values of a field: "a whole number from 1 to 100"."""
    if words := shown(field).expects:
        return words
    kinds = get_args(field.annotation) or (field.annotation,)
    kind = next((_KINDS[one] for one in kinds if one in _KINDS), "a valid value")
    ends = {
        end: f"{getattr(one, end):.12g}"
        for one in field.metadata
        for end in ("ge", "gt", "le", "lt")
        if getattr(one, end, None) is not None
    }
    words = {"ge": "of at least", "gt": "above", "le": "of at most", "lt": "below"}
    limits = " and ".join(f"{words[end]} {limit}" for end, limit in ends.items())
    if {"ge", "le"} <= ends.keys():
        limits = f"from {ends['ge']} to {ends['le']}"
    return " ".join(filter(None, (kind, limits, shown(field).unit)))


def takes(
    record: Callable[P, Any],
) -> Callable[[Callable[[Subject, Any], Result]], Callable[Concatenate[Subject, P], Result]]:
    """Let a function of a subject and of settings be called with their fields by keyword.

    Args:
        record: class of the settings; see `by_keyword`.
    """
    return by_keyword(record)


def by_keyword(record: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Let a function be called with the fields of its settings by keyword.

    In its docstring the line of the settings under "Args:" becomes one for each field.

    Args:
        record: class of the settings, which one of the function's arguments is.
    """
    kind: Any = record

    def wrap(function: Callable[..., Any]) -> Callable[..., Any]:
        own = inspect.signature(function)
        (name,) = (p.name for p in own.parameters.values() if p.annotation == kind.__name__)
        fields = {
            field: one.replace(annotation=_type_as_written(kind, field))
            for field, one in inspect.signature(kind).parameters.items()
        }
        parameters = [p for p in own.parameters.values() if p.name != name] + [*fields.values()]
        signature = own.replace(parameters=parameters)

        @functools.wraps(function)
        def call(*args: Any, **values: Any) -> Any:
            try:
                given = signature.bind(*args, **values).arguments
            except TypeError as error:
                raise TypeError(f"{function.__name__}() {error}") from None
            settings = kind.of({one: given.pop(one) for one in fields.keys() & given.keys()})
            return function(**given, **{name: settings})

        del call.__dict__["__wrapped__"]  # Sphinx would look there for defaults of the fields.
        call.__dict__["__signature__"] = signature
        call.__annotations__ = {one.name: one.annotation for one in parameters} | {
            field: kind.model_fields[field].annotation for field in fields
        }
        call.__doc__ = _documented(function.__doc__ or "", name, kind)
        return call

    return wrap


def _type_as_written(kind: type[Settings], field: str) -> str:
    """Type of a field as its class states it: with the names of types."""
    stated = (inspect.get_annotations(one).get(field) for one in kind.__mro__)
    tree = ast.parse(str(next(filter(None, stated))), mode="eval").body
    if isinstance(tree, ast.Subscript) and isinstance(tree.slice, ast.Tuple):
        tree = tree.slice.elts[0] if ast.unparse(tree.value) == "Annotated" else tree
    return ast.unparse(tree)


def _documented(text: str, name: str, kind: type[Settings]) -> str:
    """Docstring with an entry for each field in the place of that of the settings."""
    lines = []
    for line in inspect.cleandoc(
        text
    ).splitlines():  # Python 3.13 strips the indent, others do not.
        if not line.startswith(f"    {name}: "):
            lines.append(line)
            continue
        for field, about in kind.model_fields.items():
            words = about.description or ""
            words = words[:1].lower() + words[1:] if words[1:2].islower() else words
            words = words.removesuffix(".")
            if values := choices(about.annotation):
                words += f"; one of {', '.join(map(str, values))}"
            words += f"; by default {default}." if (default := shown(about).default) else "."
            entry = textwrap.fill(f"{field}: {words}", 88, subsequent_indent="    ")
            lines.append(textwrap.indent(entry, " " * 4))
    return "\n".join(lines)


def _text(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_text, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _plain(value: Any) -> Any:
    """Numbers and arrays of NumPy as plain ones, and lists as tuples."""
    if isinstance(value, Mapping):
        return {name: _plain(one) if hasattr(one, "tolist") else one for name, one in value.items()}
    value = value.tolist() if hasattr(value, "tolist") else value
    return tuple(map(_plain, value)) if isinstance(value, list | tuple) else value
