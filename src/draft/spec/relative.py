"""Values that refer to what they replace: `1.2*thigh_length` of `thigh_length`, or `*1.2`."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from draft.errors import ResolveError, SpecError
from draft.spec.expressions import Expression, parse, syntax_tree
from draft.spec.schema import asks_for_trend

_Given = TypeVar("_Given")


def name_of(key: str) -> str:
    """Name of a number in expressions: `leg.mass` of the key `actuators.leg.mass`."""
    return key.removeprefix("actuators.")


def spelled_out(key: str, value: object) -> object:
    """Return `*1.2` and `/2` as expressions of the number that they replace; others as given."""
    if not isinstance(value, str) or key.endswith(".like"):
        return value
    text = value.strip()
    if text[:1] not in ("*", "/") or text[1:2] in ("", "*", "/"):
        return value
    return f"{name_of(key)} {text[0]} {text[1:].strip()}"


def merged(older: Mapping[str, _Given], newer: Mapping[str, _Given]) -> dict[str, _Given]:
    """Values of two tables; those of the newer replace those of the older, or refer to them.

    Raises:
        ResolveError: a value refers to one that is no number.
    """
    table = dict(older)
    for key, value in newer.items():
        table[key] = _replacing(key, value, older[key]) if key in older else value
    return table


def substituted(expression: Expression, name: str, by: Expression) -> Expression:
    """Return an expression with another one in place of a name that it reads.

    Raises:
        SpecError: the result is too long or nested too deeply.
    """
    return parse(_substituted(expression.text, name, by.text), expression.where)


def _replacing(key: str, value: Any, older: Any) -> Any:
    """Value that replaces an older one, with that in place of its own name."""
    text = spelled_out(key, value)
    name = name_of(key)
    try:
        if not isinstance(text, str) or name not in parse(text).names:
            return value
    except SpecError:
        return value  # It is reported where all values are checked.
    if isinstance(older, np.ndarray) and older.ndim and parse(text).names == {name}:
        return parse(text).value({name: np.asarray(older, dtype=np.float64)}, key)
    of, quantity = spelled_out(key, older), key.rpartition(".")[2]
    try:
        if isinstance(of, (int, float, str, np.number)) and not asks_for_trend(quantity, of):
            by = of if isinstance(of, str) else repr(float(of))
            both = parse(_substituted(text, name, by))
            return both.text if both.constant is None else both.constant
    except (SpecError, SyntaxError, ValueError):
        pass
    kind = "nothing" if older is None else "an array" if np.ndim(older) else f"'{older}'"
    cause = f"{key} = '{value}' refers to the value that it replaces, which is {kind}"
    raise ResolveError(cause, "give it without its own name")


def _substituted(text: str, name: str, by: str) -> str:
    """Text of an expression with the tree of another one in place of a name."""

    class _Replace(ast.NodeTransformer):
        def visit(self, node: ast.AST) -> ast.AST:
            if isinstance(node, (ast.Name, ast.Attribute)) and ast.unparse(node) == name:
                return syntax_tree(by.strip()).body
            return self.generic_visit(node)

    return ast.unparse(_Replace().visit(syntax_tree(text.strip())))
