"""What several metrics share of a design, worked out once for each design."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import TypeVar

from draft.design import Design

T = TypeVar("T")


def once(function: Callable[[Design], T]) -> Callable[[Design], T]:
    """Make a function remember its result for as long as the design lives.

    The result must not hold the design itself, which then would live for ever. A design has no
    hash, since it may hold arrays, so its identity is the key.
    """
    kept: dict[int, tuple[weakref.ref[Design], T]] = {}

    def of(design: Design) -> T:
        key = id(design)
        found = kept.get(key)
        if found is not None and found[0]() is design:
            return found[1]
        result = function(design)
        kept[key] = (weakref.ref(design, lambda _: kept.pop(key, None)), result)
        return result

    of.__doc__ = function.__doc__
    return of
