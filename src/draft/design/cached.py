"""What several metrics share of a design or model, worked out once for each."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import TypeVar

S = TypeVar("S")  # a Design or a Model
T = TypeVar("T")


def once(function: Callable[[S], T]) -> Callable[[S], T]:
    """Make a function remember its result for as long as what it is about lives.

    The result must not hold that itself, which then would live for ever. A design has no hash,
    since it may hold arrays, so its identity is the key.
    """
    kept: dict[int, tuple[weakref.ref[S], T]] = {}

    def of(subject: S) -> T:
        key = id(subject)
        found = kept.get(key)
        if found is not None and found[0]() is subject:
            return found[1]
        result = function(subject)
        kept[key] = (weakref.ref(subject, lambda _: kept.pop(key, None)), result)
        return result

    of.__doc__ = function.__doc__
    return of
