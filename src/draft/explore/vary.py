"""Ranges of varied numbers: `name=low:high`, `name=low:high:log` or `name=a,b,c`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.laws.quantities import QUANTITIES
from draft.spec import Spec
from draft.spec.check import key_problem
from draft.spec.payload import with_payload
from draft.values import Array

FORM = "write NAME=LOW:HIGH, NAME=LOW:HIGH:log or NAME=A,B,C, in plain numbers"
# (low, high), (low, high, "log") or a list of values.
Range = Sequence[float | str] | NDArray[np.number]


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


def parse(
    spec: Spec, words: Sequence[str], fixed: Mapping[str, object] | Iterable[str] = ()
) -> tuple[Axis, ...]:
    """Parse the arguments of `--vary`.

    Args:
        spec: the robot.
        words: arguments such as `thigh_length=0.2:0.7`.
        fixed: names with a fixed value, from `--set`.

    Raises:
        DraftError: an argument has another form, a name is unknown, or a range exceeds that of its
            parameter.
    """
    if not words:
        raise DraftError("nothing is varied", f"give --vary; {FORM}")
    axes: dict[str, Axis] = {}
    for word in words:
        axis = _axis(spec, word)
        if axis.name in axes:
            raise DraftError(f"--vary gives '{axis.name}' twice", "give it once")
        if axis.name in fixed:
            cause = f"'{axis.name}' is given by --set and by --vary"
            raise DraftError(cause, "omit one of them")
        axes[axis.name] = axis
    return tuple(axes.values())


def unit_of(spec: Spec, name: str) -> str:
    """Unit of a number that can be varied; "" for a number without one."""
    known = with_payload(spec, (name,)).parameters.get(name)
    quantity = QUANTITIES.get(name.rsplit(".", 1)[-1])
    unit = known.unit if known is not None else quantity.unit if quantity is not None else ""
    return "" if unit == "1" else unit


def words_of(vary: Mapping[str, Range]) -> list[str]:
    """Arguments for `parse` from ranges by name.

    Args:
        vary: (low, high), (low, high, "log") or a list of values by name.

    Raises:
        DraftError: a range has another form.
    """
    return [f"{name}={_text(name, given)}" for name, given in vary.items()]


def _text(name: str, given: object) -> str:
    """A range or a list of values as the text after the equals sign."""
    match given:
        case tuple((low, high)) if _real(low, high):
            return f"{float(low)!r}:{float(high)!r}"
        case tuple((low, high, "log")) if _real(low, high):
            return f"{float(low)!r}:{float(high)!r}:log"
        case list() | np.ndarray() if np.ndim(given) == 1 and np.size(given) and _real(*given):
            return ",".join(repr(float(value)) for value in given)
    cause = f"vary['{name}'] is {given!r}, neither a range nor a list of values"
    remedy = 'give (low, high), (low, high, "log") or a list such as [0.2, 0.3]'
    raise DraftError(cause, remedy)


def _real(*numbers: object) -> bool:
    kinds = (int, float, np.integer, np.floating)
    return all(isinstance(one, kinds) and not isinstance(one, bool) for one in numbers)


def _axis(spec: Spec, word: str) -> Axis:
    name, equals, text = (part.strip() for part in word.partition("="))
    if not equals or not name or not text:
        raise DraftError(f"--vary '{word}' gives no range", FORM)
    problem = key_problem(spec, name, None)
    if problem is not None:
        raise DraftError(f"--vary: {problem.cause}", problem.remedy)
    if name.endswith(".like"):
        cause = f"'{name}' is a catalogue part, not a number"
        raise DraftError(f"--vary: {cause}", f"run once for each, with --set {name}")
    if "," in text or ":" not in text:
        values = tuple(_number(word, part) for part in text.split(","))
        axis = Axis(name, min(values), max(values), values=values)
    else:
        axis = _range(name, word, text)
    _check_bounds(spec, axis, text)
    return axis


def _range(name: str, word: str, text: str) -> Axis:
    low_text, high_text, *more = text.split(":")
    log = more == ["log"]
    if more and not log:
        cause = f"--vary '{word}': '{':'.join(more)}' is not 'log'"
        raise DraftError(cause, FORM)
    low, high = _number(word, low_text), _number(word, high_text)
    if not low < high:
        cause = f"--vary '{word}': the range {low:g}:{high:g} is empty"
        raise DraftError(cause, "write the lower end first")
    if log and low <= 0:
        cause = f"--vary '{word}': a logarithmic range cannot start at {low:g}"
        raise DraftError(cause, "start above zero, or omit ':log'")
    return Axis(name, low, high, log)


def _number(word: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        cause = f"--vary '{word}': '{text.strip()}' is not a number"
        raise DraftError(cause, FORM)
    return number


def _check_bounds(spec: Spec, axis: Axis, text: str) -> None:
    parameter = with_payload(spec, (axis.name,)).parameters.get(axis.name)
    if parameter is None:
        zero = QUANTITIES[axis.name.rsplit(".", 1)[1]].may_be_zero
        if axis.low < 0 or (axis.low == 0 and not zero):
            least = "zero or more" if zero else "above zero"
            cause = f"--vary '{axis.name}={text}': it must be {least}"
            raise DraftError(cause, "raise the lower end")
        return
    if parameter.bounds is None:
        return
    low, high = parameter.bounds
    if axis.low < low or axis.high > high:
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        raise DraftError(
            f"--vary '{axis.name}={text}' leaves the range [{low:g}, {high:g}]{unit} "
            f"of '{axis.name}'",
            f"stay inside it, or change it at {parameter.where}",
        )
