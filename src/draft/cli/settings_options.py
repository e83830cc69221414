"""Options of a command from the fields of a `draft.settings.Settings`."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Collection, Mapping
from typing import Annotated, Any, get_type_hints

import tyro
from pydantic.fields import FieldInfo

from draft.settings import Settings, shown

Command = Callable[..., int]


def with_options(
    kind: type[Settings],
    without: Collection[str] = (),
    read: Mapping[str, Callable[[Any], object]] | None = None,
) -> Callable[[Command], Command]:
    """Give a command an option for each field of the settings that one of its arguments is.

    Type, default and help of an option are those of the field.

    Args:
        kind: class of the settings.
        without: fields that are no options.
        read: by field, the function that makes its value from the words of the command line; the
            type of its only argument is that of the option.
    """
    readers = read or {}

    def wrap(function: Command) -> Command:
        hints = get_type_hints(function, include_extras=True)
        own = dict(inspect.signature(function).parameters)
        name = next(name for name, hint in hints.items() if hint is kind)
        parameters = []
        for one in own.values():
            if one.name != name:
                parameters.append(one.replace(annotation=hints[one.name]))
                continue
            parameters += [
                _parameter(field, about, readers.get(field))
                for field, about in kind.model_fields.items()
                if field not in without
            ]

        @functools.wraps(function)
        def call(*args: Any, **values: Any) -> int:
            given = {field: values.pop(field) for field in kind.model_fields.keys() & values.keys()}
            for field, reader in readers.items():
                if given[field] is not None:
                    given[field] = reader(given[field])
            settings = kind.of(given, lambda field: option(kind, field))
            return function(*args, **values, **{name: settings})

        del call.__dict__["__wrapped__"]  # tyro would read the types of the function itself.
        call.__dict__["__signature__"] = inspect.Signature(parameters, return_annotation=int)
        call.__annotations__ = {one.name: one.annotation for one in parameters}
        return call

    return wrap


def option(kind: type[Settings], field: str) -> str:
    """Option of a field on the command line."""
    return f"--{(shown(kind.model_fields[field]).name or field).replace('_', '-')}"


def _parameter(
    name: str, field: FieldInfo, reader: Callable[[Any], object] | None
) -> inspect.Parameter:
    """Argument of a function from which tyro makes the option of a field."""
    about, kind, default = shown(field), field.annotation, field.get_default()
    if reader is not None:
        kind = next(iter(get_type_hints(reader).values()))
        kind = kind | None if default is None else kind
    marker = tyro.conf.arg(
        name=about.name or None,
        metavar=about.metavar or None,
        help=field.description,
        help_behavior_hint=f"(default: {about.default})" if about.default else None,
    )
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, marker]
    )
