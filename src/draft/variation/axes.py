"""Axes: the numbers of a robot that are varied, with their ranges or values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from sys import float_info

import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.laws.quantities import QUANTITIES
from draft.spec import Spec
from draft.spec.check import key_problem
from draft.spec.payload import with_payload
from draft.values import Array
from draft.variation import words

# (low, high), (low, high, "log") or a list of values.
Range = Sequence[float | str] | NDArray[np.number]
# Ranges by name, or words such as "thigh_length=0.2:0.7".
Vary = Mapping[str, Range] | Sequence[str]


@dataclass(frozen=True, slots=True)
class Axis:
    """A varied number.

    Attributes:
        name: a parameter, or `actuators.CLASS.QUANTITY`.
        low, high: ends of the range, which belong to it, in the unit of the number.
        log: whether its logarithm is uniform.
        values: listed values; empty for a range.
    """

    name: str
    low: float
    high: float
    log: bool = False
    values: tuple[float, ...] = ()

    def at(self, share: Array) -> Array:
        """Values at shares in [0, 1] of the range, shape (N,)."""
        if self.values:
            index = np.minimum((share * len(self.values)).astype(np.int64), len(self.values) - 1)
            return np.asarray(self.values)[index]
        if self.log:
            found = self.low * (self.high / self.low) ** share
        else:
            found = self.low + (self.high - self.low) * share
        # Rounding must not leave the requested range, which may be that of the parameter.
        return np.clip(found, self.low, self.high)

    def record(self) -> str:
        """Text that identifies the range in a manifest."""
        if self.values:
            return ",".join(map(repr, self.values))
        return f"{self.low!r}:{self.high!r}" + (":log" if self.log else "")

    def __str__(self) -> str:
        """Word that gives this range, for messages."""
        text = re.sub(r"\.0(?=[,:]|$)", "", self.record())
        return f"{self.name}={text}"


def ranges(vary: Vary) -> Mapping[str, Range]:
    """Return ranges by name, also of words.

    Raises:
        DraftError: `vary` is neither, a word has another form, or a name is given twice.
    """
    if isinstance(vary, Mapping):
        if odd := [name for name in vary if not isinstance(name, str)]:
            raise DraftError(f"`vary` has the key {odd[0]!r}", "give names of numbers as text")
        return vary
    given = [vary] if isinstance(vary, str) else vary
    if not (isinstance(given, Sequence) and all(isinstance(word, str) for word in given)):
        cause = f"`vary` is {vary!r}, neither ranges by name nor words"
        raise DraftError(cause, 'give ranges such as {"thigh_length": (0.2, 0.4)}')
    return words.ranges(given)


def parse(spec: Spec, vary: Vary, fixed: Iterable[str] = ()) -> tuple[Axis, ...]:
    """Check ranges and make their axes.

    Args:
        spec: the robot.
        vary: (low, high), (low, high, "log") or a list of values by name; or words such as
            `thigh_length=0.2:0.7`.
        fixed: names with a fixed value.

    Raises:
        DraftError: a range has another form, a name is unknown, or a range exceeds that of its
            parameter.
    """
    if not len(vary):
        raise DraftError("nothing is varied", f"give `vary`; {words.FORM}")
    axes: list[Axis] = []
    for name, given in ranges(vary).items():
        axes.append(_axis(spec, name, given))
        if name in fixed:
            cause = f"'{name}' is given by `values` and by `vary`"
            raise DraftError(cause, "omit one of them")
    return tuple(axes)


def unit_of(spec: Spec, name: str) -> str:
    """Unit of a number that can be varied; "" for a number without one."""
    known = with_payload(spec, (name,)).parameters.get(name)
    quantity = QUANTITIES.get(name.rsplit(".", 1)[-1])
    unit = known.unit if known is not None else quantity.unit if quantity is not None else ""
    return "" if unit == "1" else unit


def _axis(spec: Spec, name: str, given: object) -> Axis:
    problem = key_problem(spec, name, None)
    if problem is not None:
        raise DraftError(f"`vary`: {problem.cause}", problem.remedy)
    words.check_number(name)
    axis = _of_numbers(name, given)
    if not axis.values:
        if not axis.low < axis.high:
            cause = f"`vary` '{axis}': the range {axis.low:g}:{axis.high:g} is empty"
            raise DraftError(cause, "write the lower end first")
        if axis.log and axis.low <= 0:
            cause = f"`vary` '{axis}': a logarithmic range cannot start at {axis.low:g}"
            raise DraftError(cause, "start above zero, or omit 'log'")
    _check_bounds(spec, axis)
    return axis


def _of_numbers(name: str, given: object) -> Axis:
    """Axis of a range or a list of values; its ends are not checked."""
    match given:
        case tuple((low, high)) if _real(low, high):
            return Axis(name, float(low), float(high))
        case tuple((low, high, "log")) if _real(low, high):
            return Axis(name, float(low), float(high), log=True)
        case list() | np.ndarray(ndim=1) if len(given) and _real(*given):
            values = tuple(float(value) for value in given)
            return Axis(name, min(values), max(values), values=values)
    cause = f"vary['{name}'] is {given!r}, neither a range nor a list of values"
    remedy = 'give (low, high), (low, high, "log") or a list such as [0.2, 0.3]'
    raise DraftError(cause, remedy)


def _real(*numbers: object) -> bool:
    kinds = (int, float, np.integer, np.floating)
    return all(
        isinstance(one, kinds) and not isinstance(one, bool) and abs(one) <= float_info.max
        for one in numbers
    )


def _check_bounds(spec: Spec, axis: Axis) -> None:
    parameter = with_payload(spec, (axis.name,)).parameters.get(axis.name)
    if parameter is None:
        zero = QUANTITIES[axis.name.rsplit(".", 1)[1]].may_be_zero
        if axis.low < 0 or (axis.low == 0 and not zero):
            least = "zero or more" if zero else "above zero"
            cause = f"`vary` '{axis}': it must be {least}"
            raise DraftError(cause, "raise the lower end")
        return
    if parameter.bounds is None:
        return
    low, high = parameter.bounds
    if axis.low < low or axis.high > high:
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        raise DraftError(
            f"`vary` '{axis}' leaves the range [{low:g}, {high:g}]{unit} of '{axis.name}'",
            f"stay inside it, or change it at {parameter.where}",
        )
