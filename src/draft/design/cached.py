"""Cache of results that several metrics share, one per design or model."""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable
from typing import Any, TypeVar

S = TypeVar("S")  # a Design or a Model
T = TypeVar("T")

# Results of every cached function, by the identity of their arguments.
_all: list[dict[int, Any]] = []


def once(function: Callable[[S], T]) -> Callable[[S], T]:
    """Cache the result of a function for as long as its argument lives.

    The result must not refer to the argument, which would then never be freed. A design has no
    hash, as it may hold arrays, so its identity is the key.
    """
    kept: dict[int, tuple[weakref.ref[S], T]] = {}
    _all.append(kept)

    def cached(subject: S) -> T:
        key = id(subject)
        found = kept.get(key)
        if found is not None and found[0]() is subject:
            return found[1]
        result = function(subject)
        kept[key] = (weakref.ref(subject, lambda _: kept.pop(key, None)), result)
        return result

    cached.__doc__ = function.__doc__
    return cached


def hand_on(old: object, new: object) -> None:
    """Let a copy of a subject that gives the same results have those that are known."""
    for kept in _all:
        found = kept.get(id(old))
        if found is not None and found[0]() is old:
            forget = functools.partial(_forget, kept, id(new))
            kept[id(new)] = (weakref.ref(new, forget), found[1])


def _forget(kept: dict[int, Any], key: int, _: object) -> None:
    kept.pop(key, None)
