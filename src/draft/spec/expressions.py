"""Expressions in a spec: parsed once, evaluated on floats or on arrays of shape (N,).

Python's own parser reads the text into a syntax tree, of which only arithmetic, comparisons,
conditionals, names of parameters, values of actuators and calls of a fixed table of functions are
accepted. The tree becomes nested closures; nothing is compiled or executed as Python. All numbers
are floats, so that `9**9**9` overflows at once instead of growing.
"""

from __future__ import annotations

import ast
import contextlib
import keyword
import math
import re
from dataclasses import dataclass, field

import numpy as np

from draft.errors import Location, Problem, ResolveError, SpecError, suggest
from draft.spec import operators as ops
from draft.spec.operators import FUNCTIONS, Environment, Evaluate, Operate
from draft.values import Value

MAX_LENGTH = 500
MAX_DEPTH = 60

CONSTANTS: dict[str, float] = {"pi": math.pi}
# Names that a parameter or an actuator class cannot have.
RESERVED = frozenset((*FUNCTIONS, *CONSTANTS, *keyword.kwlist))

_NUMBER_LIKE = re.compile(r"(?<![\w.])\.?\d(?:[eE][-+]|[\w.])*")
_NUMBER = re.compile(r"([0-9][0-9_]*(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
_ONE_SIGN = re.compile(r"(?<![<>=!])=(?!=)")
_WITH_UNIT = re.compile(r"(?<![\w.])([\d.]+)\s+([^\W\d]\w*)")
ALLOWED = "an expression may use + - * / % **, comparisons, 'a if c else b', and the functions " + (
    " ".join(sorted(FUNCTIONS))
)
COMMA = 'close every parenthesis; inside [ ], quote an expression with a comma: "max(a, b)"'


@dataclass(frozen=True, slots=True)
class Expression:
    """A number of a spec, as a constant or as arithmetic over names.

    Attributes:
        text: the text in the file.
        names: parameters and values of actuators (`leg.radius`) that it reads.
        where: its file, line and column.
        constant: its value, if it reads no name; otherwise None.
    """

    text: str
    names: frozenset[str]
    where: Location | None = None
    constant: float | None = None
    _evaluate: Evaluate = field(repr=False, compare=False, default=lambda env: 0.0)

    def value(self, env: Environment, what: str = "") -> Value:
        """Evaluate to a finite float, or to an array of shape (N,).

        An array may have entries that are not finite: the caller marks those rows as invalid.

        Args:
            env: a float or an array of shape (N,) for each of `names`.
            what: name of the number, for the message.

        Raises:
            ResolveError: division by zero, overflow, a root of a negative number, not a number.
        """
        if self.constant is not None:
            return self.constant
        try:
            result = self._evaluate(env)
        except (ZeroDivisionError, OverflowError, ValueError) as error:
            raise self._unusable(env, what, _reason(error)) from None
        if isinstance(result, np.ndarray):
            return result.astype(np.float64) if result.dtype != np.float64 else result
        result = float(result)
        if not math.isfinite(result):
            reason = "it is undefined" if math.isnan(result) else "the number is too large"
            raise self._unusable(env, what, reason)
        return result

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the text, because closures cannot be pickled."""
        if self.constant is None:
            return parse, (self.text, self.where)
        return Expression, (self.text, self.names, self.where, self.constant)

    def _unusable(self, env: Environment, what: str, reason: str) -> ResolveError:
        known = ", ".join(f"{n} = {env[n]:.6g}" for n in sorted(self.names) if _scalar(env[n]))
        subject = f"{what} = '{_short(self.text)}'" if what else f"'{_short(self.text)}'"
        remedy = f"with {known}; change the expression or these values" if known else ""
        return ResolveError(
            Problem(
                f"{subject} has no value: {reason}",
                self.where,
                remedy or "write a number, or an expression with a value",
            )
        )


Triple = tuple[Expression, Expression, Expression]


def parse(source: float | str, where: Location | None = None) -> Expression:
    """Read a number or the text of an expression.

    Raises:
        SpecError: the text is not an expression that Draft accepts.
    """
    if not isinstance(source, str):
        return Expression(str(source), frozenset(), where, float(source))
    text = source.strip()
    where = _shifted(where, source.index(text))
    if len(text) > MAX_LENGTH:
        cause = f"an expression of {len(text)} characters is too long"
        raise _bad(cause, f"the limit is {MAX_LENGTH}; name parts of it as parameters", where)
    _check_spelling(text, where)
    try:
        tree = syntax_tree(text)
    except SyntaxError as error:
        end = len(text) + 1
        at = _shifted(where, min(error.offset or end, end) - 1)
        cause = f"'{_short(text)}' is not an expression: {error.msg}"
        raise _bad(cause, _remedy(text, error.msg), at) from None
    except (ValueError, RecursionError, MemoryError):
        raise _bad("the expression cannot be read", ALLOWED, where) from None
    names: set[str] = set()
    evaluate = _compile(tree.body, text, where, names, 0)
    if names:
        return Expression(text, frozenset(names), where, None, evaluate)
    expression = Expression(text, frozenset(), where, None, evaluate)
    try:
        constant = expression.value({})
    except ResolveError as error:
        raise SpecError(error.problems) from None
    return Expression(text, frozenset(), where, float(constant))


def _remedy(text: str, message: str) -> str:
    """What to do about a text that Python's parser refuses."""
    if "never closed" in message or "unmatched" in message:
        return COMMA
    if _ONE_SIGN.search(text):
        return "write == to compare"
    found = _WITH_UNIT.search(text)
    if found and not keyword.iskeyword(found[2]):
        return f"write {found[1]} without '{found[2]}': all numbers are in SI units"
    return ALLOWED


def syntax_tree(text: str) -> ast.Expression:
    """Syntax tree of an expression.

    CPython before 3.11.9 and 3.12.2 counts the depth of trees for all threads and finalisers
    together, and raises SystemError where two are built at once (gh-106905).
    """
    for _ in range(8):
        with contextlib.suppress(SystemError):
            return ast.parse(text, mode="eval")
    return ast.parse(text, mode="eval")


def _check_spelling(text: str, where: Location | None) -> None:
    """Refuse text about which Python's parser would print a warning, such as `1if x else 2`."""
    if "\\" in text:
        at = _shifted(where, text.index("\\"))
        raise _bad("a backslash is not allowed in an expression", ALLOWED, at)
    for word in _NUMBER_LIKE.finditer(text):
        if not _NUMBER.fullmatch(word[0]):
            at = _shifted(where, word.start())
            raise _bad(f"'{_short(word[0])}' is not a number", "such as 2, 0.5 or 1e-3", at)


def _compile(
    node: ast.expr, text: str, where: Location | None, names: set[str], depth: int
) -> Evaluate:
    """Turn one syntax node into a closure over an environment."""
    if depth > MAX_DEPTH:
        cause = "the expression is nested too deeply"
        raise _bad(cause, f"the limit is {MAX_DEPTH} levels; name parts of it as parameters", where)

    def sub(child: ast.expr) -> Evaluate:
        return _compile(child, text, where, names, depth + 1)

    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return _constant(value, node, where)
        case ast.Name() | ast.Attribute():
            return _name(node, text, where, names)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in ops.BINARY:
            return ops.binary(ops.BINARY[type(op)], sub(left), sub(right))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return ops.negative(sub(operand))
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return sub(operand)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return ops.negation(sub(operand))
        case ast.Compare(left=left, ops=kinds, comparators=rest) if all(
            type(kind) in ops.COMPARE for kind in kinds
        ):
            compare = [ops.COMPARE[type(kind)] for kind in kinds]
            return ops.comparison(compare, [sub(term) for term in (left, *rest)])
        case ast.BoolOp(op=op, values=operands):
            return ops.logic(isinstance(op, ast.Or), [sub(operand) for operand in operands])
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return ops.conditional(sub(test), sub(body), sub(orelse))
        case ast.Call(func=ast.Name(id=function), args=args, keywords=[]):
            known = _function(function, len(args), _shifted(where, node.col_offset))
            return ops.call(known, [sub(arg) for arg in args])
        case _:
            piece = ast.get_source_segment(text, node) or text
            at = _shifted(where, node.col_offset)
            raise _bad(f"'{_short(piece)}' is not allowed in an expression", ALLOWED, at)


def _constant(value: float, node: ast.expr, where: Location | None) -> Evaluate:
    try:
        number = float(value)
    except OverflowError:
        at = _shifted(where, node.col_offset)
        raise _bad("a number too large for floating point", "use a smaller one", at) from None
    return lambda env: number


def _name(
    node: ast.Name | ast.Attribute, text: str, where: Location | None, names: set[str]
) -> Evaluate:
    """Read a parameter (`thigh_length`), a constant (`pi`) or an actuator's value (`leg.mass`)."""
    match node:
        case ast.Name(id=name):
            pass
        case ast.Attribute(value=ast.Name(id=owner), attr=attribute):
            name = f"{owner}.{attribute}"
        case _:
            piece = ast.get_source_segment(text, node) or text
            at = _shifted(where, node.col_offset)
            cause = f"'{_short(piece)}' is not the value of an actuator"
            raise _bad(cause, "write CLASS.QUANTITY, such as leg.radius", at)
    if name in CONSTANTS:
        constant = CONSTANTS[name]
        return lambda env: constant
    if name.split(".", 1)[0] in FUNCTIONS:
        at = _shifted(where, node.col_offset)
        raise _bad(f"'{name}' is a function without its arguments", f"write {name}(...)", at)
    names.add(name)
    return lambda env: env[name]


def _function(name: str, count: int, where: Location | None) -> Operate:
    """Function of the table, checked for its number of arguments."""
    if name not in FUNCTIONS:
        raise _bad(f"unknown function '{name}'", suggest(name, FUNCTIONS, "functions"), where)
    function, fewest, most = FUNCTIONS[name]
    if not fewest <= count <= most:
        wanted = str(fewest) if fewest == most else f"{fewest} to {most}"
        given = "1 argument" if count == 1 else f"{count} arguments"
        raise _bad(f"{name}() got {given}", f"it takes {wanted}", where)
    return function


def _reason(error: Exception) -> str:
    if isinstance(error, ZeroDivisionError):
        return "division by zero"
    if isinstance(error, OverflowError):
        return "the number is too large"
    return "a root, power, logarithm or angle that is not a real number"


def _scalar(value: object) -> bool:
    return isinstance(value, float)


def _shifted(where: Location | None, columns: int) -> Location | None:
    if where is None or where.column is None:
        return where
    return Location(where.file, where.line, where.column + columns)


def _short(text: str) -> str:
    return text if len(text) <= 80 else text[:77] + "..."


def _bad(cause: str, remedy: str, where: Location | None) -> SpecError:
    return SpecError(Problem(cause, where, remedy))
