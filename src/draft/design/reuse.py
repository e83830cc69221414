"""Results of the last design of a spec, which the next one takes over where nothing has changed.

An edit changes a few of the hundreds of numbers of a robot. What is computed from the same objects
as in the design before is that design's, and what follows from it is the same object in turn. So
arguments are compared by identity, which costs little, and arrays need no comparison.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from operator import is_
from typing import Any, TypeVar

T = TypeVar("T")


class Reuse:
    """Keeps one result for each place in the plan of a spec, with the arguments that it is of.

    A result is that of a function of its arguments alone, and nobody changes it. It must not refer
    to a spec or a design, which would then never be freed. Designs that are resolved by several
    threads replace each other's results, and each has its own.

    Args:
        keeps: whether to keep results; those of N designs are large, and are not.
    """

    def __init__(self, keeps: bool = True) -> None:
        self._keeps = keeps
        self._results: dict[Hashable, tuple[tuple[object, ...], Any]] = {}
        self._values: dict[Hashable, Any] = {}

    def result(self, place: Hashable, make: Callable[..., T], *of: object) -> T:
        """Result of a function, or the last one of a place where all arguments are the same.

        Args:
            place: what the result is of; a place has always one function.
            make: the function.
            of: its arguments.
        """
        if not self._keeps:
            return make(*of)
        last = self._results.get(place)
        if last is not None and len(last[0]) == len(of) and all(map(is_, last[0], of)):
            return last[1]
        made = make(*of)
        self._results[place] = of, made
        return made

    def equal(self, place: Hashable, value: T) -> T:
        """Return the last value of a place if this one is equal, so that it counts as the same.

        Zero is as it is, because it has a sign.
        """
        if not self._keeps:
            return value
        last = self._values.get(place)
        if last is not None and last == value and value != 0:
            return last
        self._values[place] = value
        return value
