"""Numbers and choices as values of options: how tyro reads them, and what is said of others.

tyro's own rules for optional ones accept the word None, and report every attempt to read a word.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Annotated, Any, Literal, get_args, get_origin

from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

_WORDS = {int: "a whole number", float: "a number"}
registry = ConstructorRegistry()


@registry.primitive_rule
def _rule(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """Read a number, or one of a few words; None is only a default."""
    args = [one for one in get_args(info.type) if one is not type(None)]
    kind = args[0] if len(args) == 1 else info.type
    if kind in _WORDS:
        return PrimitiveConstructorSpec(
            nargs=1,
            metavar=kind.__name__.upper(),
            instance_from_str=_number(kind),
            is_instance=lambda value: value is None or isinstance(value, (int, float)),
            str_from_instance=lambda value: [str(value)],
        )
    if get_origin(kind) is tuple and (count := _numbers(get_args(kind))):
        return PrimitiveConstructorSpec(
            nargs=count,
            metavar=" ".join(["FLOAT"] * count),
            instance_from_str=lambda words: tuple(_number(float)([word]) for word in words),
            is_instance=lambda value: value is None or isinstance(value, tuple),
            str_from_instance=lambda value: [str(number) for number in value or [None] * count],
        )
    if get_origin(kind) is Literal:
        choices = tuple(map(str, get_args(kind)))
        return PrimitiveConstructorSpec(
            nargs=1,
            metavar=f"{{{','.join(choices)}}}",
            instance_from_str=lambda words: words[0],
            is_instance=lambda value: value is None or value in choices,
            str_from_instance=lambda value: [str(value)],
            choices=choices,
        )
    return None


def _numbers(parts: tuple[Any, ...]) -> int:
    """Count of numbers in a tuple of so many; 0 for any other one."""
    kinds = {get_args(one)[0] if get_origin(one) is Annotated else one for one in parts}
    return len(parts) if kinds == {float} else 0


def _number(kind: type) -> Callable[[list[str]], int | float]:
    def read(words: list[str]) -> int | float:
        with suppress(ValueError):
            return kind(words[0])
        with suppress(ValueError):
            number = float(words[0])
            if number.is_integer():  # such as 1e6
                return int(number)
        raise ValueError(f"expected {_WORDS[kind]}, not '{words[0]}'")

    return read
