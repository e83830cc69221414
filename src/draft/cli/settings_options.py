"""Options of a command from the fields of a `draft.settings.Settings`."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import tyro
from pydantic.fields import FieldInfo

from draft.settings import Settings, shown

Command = Callable[..., int]


def with_options(
    kind: type[Settings],
    without: Collection[str] = (),
    read: Mapping[str, Callable[[Any], object]] | None = None,
    defaults: Mapping[str, object] | None = None,
) -> Callable[[Command], Command]:
    """Give a command an option for each field of the settings that one of its arguments is.

    Type, default and help of an option are those of the field; a sequence is an option of several
    words.

    Args:
        kind: class of the settings.
        without: fields that are no options.
        read: by field, the function that makes its value from the words of the command line; the
            type of its only argument is that of the option, with its help if it is annotated.
        defaults: by field, the default of its option where it is not that of the field.
    """
    readers = read or {}
    fields = {field: about for field, about in kind.model_fields.items() if field not in without}

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
                _parameter(field, about, readers.get(field), (defaults or {}).get(field))
                for field, about in fields.items()
            ]

        @functools.wraps(function)
        def call(*args: Any, **values: Any) -> int:
            given = {field: values.pop(field) for field in fields}
            for field, about in fields.items():
                if given[field] == () and not about.is_required():  # no words
                    given[field] = about.get_default()
                elif field in readers and given[field] is not None:
                    given[field] = readers[field](given[field])
            settings = kind.of(given)
            return function(*args, **values, **{name: settings})

        del call.__dict__["__wrapped__"]  # tyro would read the types of the function itself.
        call.__dict__["__signature__"] = inspect.Signature(parameters, return_annotation=int)
        call.__annotations__ = {one.name: one.annotation for one in parameters}
        return call

    return wrap


def _parameter(
    name: str, field: FieldInfo, reader: Callable[[Any], object] | None, default: object
) -> inspect.Parameter:
    """Argument of a function from which tyro makes the option of a field."""
    about, kind = shown(field), field.annotation
    if default is None:
        default = inspect.Parameter.empty if field.is_required() else field.get_default()
    if reader is not None:
        kind = next(iter(get_type_hints(reader, include_extras=True).values()))
        if get_origin(kind) is tuple:
            default = default or ()
        elif default is None:
            kind = kind | None
    sequence = next((one for one in (kind, *get_args(kind)) if get_origin(one) is Sequence), None)
    if sequence is not None:
        kind, default = tuple[(*get_args(sequence), ...)], default or ()
    marker = tyro.conf.arg(
        name=about.name or None,
        metavar=about.metavar or None,
        help=" ".join((field.description or "").split()),
        help_behavior_hint=f"(default: {about.default})" if about.default else None,
    )
    if get_origin(kind) is not Annotated:
        kind = Annotated[kind, marker]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
