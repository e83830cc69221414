"""Functions that work on the number of one design and on the numbers of N designs.

A value is a Python float, or an array of shape (N,) with one entry per design. Plain operators
work on both; the functions here need a different routine for each. Floats use the `math` module
because NumPy's calls on scalars take ten times as long.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Value = float | Array
Mask = bool | NDArray[np.bool_]


def is_array(value: object) -> bool:
    """Whether a value is that of many designs rather than one."""
    return isinstance(value, np.ndarray)


def scalar(value: object) -> float:
    """Convert the number of one design to a Python float.

    Raises:
        TypeError: the value is that of many designs, or is not a number.
    """
    if isinstance(value, np.ndarray) and value.ndim:
        raise TypeError(f"expected the number of one design, got an array of shape {value.shape}")
    if not isinstance(value, (float, int, np.generic, np.ndarray)):
        raise TypeError(f"expected a number, got {type(value).__name__}")
    return float(value)


def brief(value: Value) -> str:
    """Text of a value with three digits; of N designs its range, such as "32.3..38.4"."""
    if isinstance(value, np.ndarray) and value.ndim:
        if not len(value):
            return "none"
        return "..".join(dict.fromkeys((brief(value.min()), brief(value.max()))))
    return f"{value:.0f}" if 1e3 <= abs(value) < 1e7 else f"{value:.3g}"


def signed(change: float) -> str:
    """Text of a change with three digits, with its sign; "-" for NaN."""
    if math.isnan(change):
        return "-"
    return f"{'+' if change > 0 else ''}{brief(change)}" if change else "0"


def told_apart(before: float, after: float) -> tuple[str, str]:
    """Texts of two values, with as many digits as it takes to see which is larger."""
    for digits in range(3, 17):
        first, second = (
            f"{x:.0f}" if 10**digits <= abs(x) < 1e7 else f"{x:.{digits}g}" for x in (before, after)
        )
        if first != second or before == after:
            return first, second
    return repr(before), repr(after)


def _unary(
    on_float: Callable[[float], float], on_array: Callable[[Array], Array]
) -> Callable[[Value], Value]:
    def function(x: Value) -> Value:
        return on_array(x) if isinstance(x, np.ndarray) else on_float(x)

    return function


sqrt = _unary(math.sqrt, np.sqrt)
sin = _unary(math.sin, np.sin)
cos = _unary(math.cos, np.cos)
tan = _unary(math.tan, np.tan)
asin = _unary(math.asin, np.arcsin)
acos = _unary(math.acos, np.arccos)
atan = _unary(math.atan, np.arctan)
exp = _unary(math.exp, np.exp)
log = _unary(math.log, np.log)
radians = _unary(math.radians, np.radians)


def atan2(y: Value, x: Value) -> Value:
    """Angle of the point (x, y) [rad]."""
    return np.arctan2(y, x) if is_array(x) or is_array(y) else math.atan2(y, x)


def hypot(*xs: Value) -> Value:
    """Euclidean length of a vector, from its components."""
    return sqrt(sum(x * x for x in xs))


def power(x: Value, exponent: Value) -> Value:
    """Real power: a negative base with a fractional exponent is an error, not a complex number."""
    if is_array(x) or is_array(exponent):
        return np.power(x, exponent)
    math.pow(x, exponent)  # It raises where there is no real power, which NumPy does not.
    # That of NumPy, which may differ in the last digit: a design alone is what it is among many.
    return float(np.power(float(x), float(exponent)))


def divide(x: Value, y: Value) -> Value:
    """Quotient; division by zero gives inf or NaN for floats as it does for arrays."""
    if is_array(x) or is_array(y) or y != 0:
        return x / y
    return math.nan if x == 0 or math.isnan(x) else math.copysign(math.inf, x)


def minimum(*xs: Value) -> Value:
    """Return the smallest of the values, design by design."""
    for x in xs:
        if isinstance(x, np.ndarray):
            return functools.reduce(np.minimum, xs)
    return min(xs)


def maximum(*xs: Value) -> Value:
    """Return the largest of the values, design by design."""
    for x in xs:
        if isinstance(x, np.ndarray):
            return functools.reduce(np.maximum, xs)
    return max(xs)


def clip(x: Value, low: Value, high: Value) -> Value:
    """Limit x to [low, high]."""
    return minimum(maximum(x, low), high)


def where(condition: Mask | Value, if_true: Value, if_false: Value) -> Value:
    """Return `if_true` for the designs where the condition is true, `if_false` for the others."""
    if is_array(condition):
        return np.where(condition, if_true, if_false)
    return if_true if condition else if_false


def both(a: Mask, b: Mask) -> Mask:
    """Conjunction of two masks."""
    return np.logical_and(a, b) if is_array(a) or is_array(b) else bool(a and b)


def either(a: Mask, b: Mask) -> Mask:
    """Disjunction of two masks."""
    return np.logical_or(a, b) if is_array(a) or is_array(b) else bool(a or b)


def negate(a: Mask) -> Mask:
    """Negation of a mask."""
    return np.logical_not(a) if is_array(a) else not a


def some(mask: Mask) -> bool:
    """Whether a mask is true for any design."""
    return bool(mask.any()) if isinstance(mask, np.ndarray) else bool(mask)


def every(mask: Mask) -> bool:
    """Whether a mask is true for all designs."""
    return bool(mask.all()) if isinstance(mask, np.ndarray) else bool(mask)


def plain(record: Mapping[str, object]) -> dict[str, Any]:
    """Convert a record to plain data for JSON and YAML: dicts, lists, strings and numbers."""
    return {str(key): plain_value(item) for key, item in record.items()}


def plain_value(value: object) -> object:
    """Convert a value of a record to plain data."""
    if isinstance(value, dict):
        return plain(value)
    if isinstance(value, (list, tuple)):
        return [plain_value(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return value
