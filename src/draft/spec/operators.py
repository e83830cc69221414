"""Operators and functions of expressions, on floats and on arrays of shape (N,).

For one design an undefined operation (division by zero, the root of a negative number) raises. For
many designs its row becomes NaN, and every result that reads it is NaN too, comparisons, min and
max included: a row is NaN exactly where the design alone would be an error. A branch that is not
taken has no effect. True is 1.0 and false is 0.0.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping

import numpy as np

from draft import values as v
from draft.values import Value

Environment = Mapping[str, Value]
Evaluate = Callable[[Environment], Value]
Operate = Callable[..., Value]


def _nan_where_undefined(operate: Operate) -> Operate:
    """Set rows of an array to NaN where an operation overflows or is undefined."""

    def guarded(*xs: Value) -> Value:
        for x in xs:
            if isinstance(x, np.ndarray):
                with np.errstate(all="ignore"):
                    result = operate(*xs)
                return np.where(np.isfinite(result), result, np.nan)
        return operate(*xs)

    return guarded


def _absolute(x: Value) -> Value:
    return abs(x)


def _angle(y: Value, x: Value) -> Value:
    """Angle of a point; minus zero, which has another angle, counts as zero."""
    return v.atan2(y + 0.0, x + 0.0)


def _power(x: Value, exponent: Value) -> Value:
    """Power, where also NaN to the power of zero, and one to the power of NaN, are NaN."""
    result = v.power(x, exponent)
    if isinstance(result, np.ndarray):
        return np.where(np.isnan(x) | np.isnan(exponent), np.nan, result)
    return result


BINARY: dict[type, Operate] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: _nan_where_undefined(lambda a, b: a / b),
    ast.Mod: _nan_where_undefined(lambda a, b: a % b),
    ast.Pow: _nan_where_undefined(_power),
}
COMPARE: dict[type, Operate] = {
    ast.Lt: lambda a, b: a < b,
    ast.LtE: lambda a, b: a <= b,
    ast.Gt: lambda a, b: a > b,
    ast.GtE: lambda a, b: a >= b,
    ast.Eq: lambda a, b: a == b,
    ast.NotEq: lambda a, b: a != b,
}
# name -> (function, fewest arguments, most arguments)
FUNCTIONS: dict[str, tuple[Operate, int, int]] = {
    "min": (v.minimum, 1, 16),
    "max": (v.maximum, 1, 16),
    "abs": (_absolute, 1, 1),
    "sqrt": (_nan_where_undefined(v.sqrt), 1, 1),
    "sin": (_nan_where_undefined(v.sin), 1, 1),
    "cos": (_nan_where_undefined(v.cos), 1, 1),
    "tan": (_nan_where_undefined(v.tan), 1, 1),
    "asin": (_nan_where_undefined(v.asin), 1, 1),
    "acos": (_nan_where_undefined(v.acos), 1, 1),
    "atan": (v.atan, 1, 1),
    "atan2": (_angle, 2, 2),
    "hypot": (v.hypot, 1, 16),
    "exp": (_nan_where_undefined(v.exp), 1, 1),
    "log": (_nan_where_undefined(v.log), 1, 1),
    "deg": (v.radians, 1, 1),
    "clip": (v.clip, 3, 3),
    "where": (v.where, 3, 3),
}


def binary(operate: Operate, left: Evaluate, right: Evaluate) -> Evaluate:
    """Binary operation."""
    return lambda env: operate(left(env), right(env))


def negative(operand: Evaluate) -> Evaluate:
    """Unary minus."""
    return lambda env: -operand(env)


def negation(operand: Evaluate) -> Evaluate:
    """Negation `not`: 1.0 for zero, else 0.0."""

    def evaluate(env: Environment) -> Value:
        x = operand(env)
        return _choose(x, 0.0, 1.0) if v.is_array(x) else float(not x)

    return evaluate


def logic(settled: bool, operands: list[Evaluate]) -> Evaluate:
    """Disjunction (`settled` is true) or conjunction (`settled` is false).

    Args:
        settled: truth of an operand that decides the result.
        operands: at least one.
    """

    def evaluate(env: Environment) -> Value:
        result = _truth(operands[0](env))
        for operand in operands[1:]:
            if not v.is_array(result):
                if bool(result) is settled:
                    break
                result = _truth(operand(env))
            elif settled:
                result = _choose(result, 1.0, _truth(_branch(operand, env)))
            else:
                result = _choose(result, _truth(_branch(operand, env)), 0.0)
        return result

    return evaluate


def comparison(operators: list[Operate], terms: list[Evaluate]) -> Evaluate:
    """Chain of comparisons, evaluated up to the first that fails."""

    def evaluate(env: Environment) -> Value:
        left = terms[0](env)
        result: Value = 1.0
        for operate, term in zip(operators, terms[1:], strict=True):
            if not v.is_array(result) and not result:
                break
            right = _branch(term, env) if v.is_array(result) else term(env)
            holds = _compared(operate, left, right)
            result = _choose(result, holds, 0.0) if v.is_array(result) else holds
            left = right
        return result

    return evaluate


def conditional(test: Evaluate, body: Evaluate, orelse: Evaluate) -> Evaluate:
    """Conditional `body if test else orelse`, design by design."""

    def evaluate(env: Environment) -> Value:
        condition = test(env)
        if v.is_array(condition):
            return _choose(condition, _branch(body, env), _branch(orelse, env))
        return body(env) if condition else orelse(env)

    return evaluate


def call(function: Operate, args: list[Evaluate]) -> Evaluate:
    """Call of a function of the table; `where` is a conditional."""
    if function is v.where:
        return conditional(*args)
    if len(args) == 1:
        only = args[0]
        return lambda env: function(only(env))
    return lambda env: function(*[arg(env) for arg in args])


def _branch(evaluate: Evaluate, env: Environment) -> Value:
    """Evaluate what only some designs need.

    What has no value for any design is NaN, as an array, which all operators carry on.
    """
    try:
        return evaluate(env)
    except (ZeroDivisionError, OverflowError, ValueError):
        return np.array([np.nan])


def _compared(operate: Operate, left: Value, right: Value) -> Value:
    holds = operate(left, right)
    if not isinstance(holds, np.ndarray):
        return float(holds)
    return np.where(np.isnan(left) | np.isnan(right), np.nan, holds)


def _truth(x: Value) -> Value:
    return _choose(x, 1.0, 0.0) if isinstance(x, np.ndarray) else float(bool(x))


def _choose(condition: Value, if_true: Value, if_false: Value) -> Value:
    """Choose row by row; a row whose condition is NaN is NaN."""
    picked = np.where(condition != 0.0, if_true, if_false)
    return np.where(np.isnan(condition), np.nan, picked)
