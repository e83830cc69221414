"""Expressions: arithmetic on floats and on arrays by the same code, and nothing but arithmetic."""

from __future__ import annotations

import ast
import math
import pickle
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.errors import Location, ResolveError, SpecError
from draft.spec.expressions import FUNCTIONS, parse

HERE = Location("tree.yaml", 7, 20)


def value(text: str, **names: float) -> float:
    """What an expression comes to."""
    result = parse(text).value(names)
    assert type(result) is float
    return result


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("7 - 2 - 1", 4.0),
        ("8 / 4 / 2", 1.0),
        ("7 % 4", 3.0),
        ("-7 % 4", 1.0),
        ("-2 ** 2", -4.0),
        ("2 ** 3 ** 2", 512.0),
        ("2 ** -1", 0.5),
        ("+3 - -3", 6.0),
        ("1e3 + .5", 1000.5),
        ("1 / 3", 1 / 3),
    ],
)
def test_operators_have_the_precedence_of_arithmetic(text: str, expected: float) -> None:
    assert value(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 if x < 3 else 2", 1.0),
        ("1 if x > 3 else 2", 2.0),
        ("1 if 0 < x < 3 else 2", 1.0),
        ("1 if 0 < x < 1 else 2", 2.0),
        ("1 if 3 > x >= 2 != 3 else 2", 1.0),
        ("1 if x == 2 and not x > 5 else 2", 1.0),
        ("1 if x > 5 or x < 0 else 2", 2.0),
        ("(x > 1) + (x > 5)", 1.0),
    ],
)
def test_comparisons_chain_and_choose(text: str, expected: float) -> None:
    assert value(text, x=2.0) == expected


@pytest.mark.parametrize(
    "text",
    [
        "where(x > 0, 1 / x, 5)",
        "1 / x if x > 0 else 5",
        "5 if x <= 0 or 1 / x > 0 else 6",
        "6 if x > 0 and 1 / x > 0 else 5",
        "6 if 0 < x < 1 / x else 5",
    ],
)
def test_a_branch_that_is_not_taken_is_not_worked_out(text: str) -> None:
    assert value(text, x=0.0) == 5.0


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("min(3, 1, 2)", 1.0),
        ("max(3, 1, 2)", 3.0),
        ("min(4)", 4.0),
        ("abs(-2)", 2.0),
        ("sqrt(9)", 3.0),
        ("sin(pi / 2)", 1.0),
        ("cos(0)", 1.0),
        ("tan(pi / 4)", math.tan(math.pi / 4)),
        ("asin(1)", math.pi / 2),
        ("acos(1)", 0.0),
        ("atan(1)", math.pi / 4),
        ("atan2(1, -1)", 3 * math.pi / 4),
        ("hypot(3, 4)", 5.0),
        ("hypot(2, 3, 6)", 7.0),
        ("exp(0)", 1.0),
        ("log(exp(2))", 2.0),
        ("deg(180)", math.pi),
        ("clip(5, 0, 1)", 1.0),
        ("clip(-5, 0, 1)", 0.0),
        ("where(2 > 1, 3, 4)", 3.0),
    ],
)
def test_each_function_gives_its_value(text: str, expected: float) -> None:
    assert value(text) == pytest.approx(expected, rel=1e-15, abs=1e-15)


def test_every_function_works_on_arrays_as_on_floats() -> None:
    xs = np.array([0.1, 0.4, 0.9])
    for name, (_, fewest, _) in FUNCTIONS.items():
        arguments = ["x", "x / 2", "x + 1"][:fewest]
        expression = parse(f"{name}({', '.join(arguments)})")
        rows = np.array([expression.value({"x": float(x)}) for x in xs])
        together = np.asarray(expression.value({"x": xs}))
        np.testing.assert_allclose(together, rows, rtol=1e-14, err_msg=name)


def test_a_dotted_name_reads_an_actuator() -> None:
    expression = parse("2 * leg.radius + gap")
    assert expression.names == {"leg.radius", "gap"}
    assert expression.value({"leg.radius": 0.05, "gap": 0.01}) == pytest.approx(0.11)


def test_an_expression_without_names_is_a_constant() -> None:
    assert parse(" deg(90) ").constant == pytest.approx(math.pi / 2)
    assert parse(3).constant == 3.0
    assert parse("3 * x").constant is None


def numbers() -> st.SearchStrategy[str]:
    return st.sampled_from(["x", "y", "leg.radius", "0.5", "2", "3.25"])


def combined(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """Operators that IEEE 754 rounds correctly, so that floats and arrays agree to the bit."""
    pair = st.tuples(inner, inner)
    return st.one_of(
        st.builds("({0[0]} {1} {0[1]})".format, pair, st.sampled_from("+-*")),
        st.builds("({0[0]} / (1 + abs({0[1]})))".format, pair),
        st.builds("{1}({0[0]}, {0[1]})".format, pair, st.sampled_from(["min", "max"])),
        st.builds("sqrt(abs({}))".format, inner),
        st.builds("(-{})".format, inner),
        st.builds("({0[0]} if {1} < {0[1]} <= 2 else {1})".format, pair, inner),
        st.builds("where({0[0]} > {0[1]} or {1} > 1, {0[0]}, {1})".format, pair, inner),
    )


@given(
    text=st.recursive(numbers(), combined, max_leaves=12).filter(lambda text: len(text) <= 500),
    seed=st.integers(0, 2**32 - 1),
)
def test_arrays_give_the_numbers_of_a_loop_over_floats(text: str, seed: int) -> None:
    expression = parse(text)
    random = np.random.default_rng(seed)
    env = {name: random.uniform(-3, 3, 5) for name in expression.names}
    together = np.broadcast_to(np.asarray(expression.value(env)), 5)
    for i in range(5):
        alone = expression.value({name: float(column[i]) for name, column in env.items()})
        assert together[i] == pytest.approx(alone, rel=1e-12, abs=1e-12)


def test_a_tree_that_python_miscounts_is_built_again(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, asked = ast.parse, []

    def miscounting(text: str, **options: Any) -> ast.AST:
        asked.append(text)
        if len(asked) == 1:
            raise SystemError("AST constructor recursion depth mismatch (before=141, after=157)")
        return whole(text, **options)

    monkeypatch.setattr(ast, "parse", miscounting)
    assert value("1 + 2") == 3.0
    assert len(asked) == 2


def test_a_row_that_cannot_be_is_not_finite_and_leaves_the_others() -> None:
    with np.errstate(all="ignore"):
        result = parse("sqrt(x)").value({"x": np.array([4.0, -1.0])})
    np.testing.assert_array_equal(np.isfinite(result), [True, False])


REFUSED = {
    "attribute trick": ("().__class__", "is not the value of an actuator"),
    "chain of attributes": ("leg.radius.__class__", "is not the value of an actuator"),
    "attribute of a text": ("''.join", "is not the value of an actuator"),
    "import": ("__import__('os')", "unknown function '__import__'"),
    "method": ("leg.radius.hex()", "is not allowed"),
    "lambda": ("lambda: 1", "is not allowed"),
    "comprehension": ("[x for x in y]", "is not allowed"),
    "generator": ("max(x for x in y)", "is not allowed"),
    "subscript": ("x[0]", "is not allowed"),
    "text": ("'x'", "is not allowed"),
    "formatted text": ("f'{x}'", "is not allowed"),
    "keyword argument": ("min(1, key=x)", "is not allowed"),
    "starred argument": ("min(*x)", "is not allowed"),
    "complex number": ("1j", "is not a number"),
    "truth value": ("True", "is not allowed"),
    "assignment": ("(x := 3)", "is not allowed"),
    "bits": ("1 << 9", "is not allowed"),
    "matrix product": ("x @ y", "is not allowed"),
    "membership": ("x in y", "is not allowed"),
    "statement": ("import os", "is not an expression"),
    "unfinished": ("3 +", "is not an expression"),
    "nothing": ("# a remark", "is not an expression"),
    "tower of powers": ("9**9**9", "the number is too large"),
    "infinite constant": ("1e400", "the number is too large"),
    "not a number": ("1e400 - 1e400", "it is undefined"),
    "long integer": ("1" + "0" * 400, "too large for floating point"),
    "division by zero": ("1 / 0", "division by zero"),
    "remainder by zero": ("1 % 0", "division by zero"),
    "even root": ("sqrt(-1)", "not a real number"),
    "fractional power": ("(-8) ** (1 / 3)", "not a real number"),
    "logarithm of zero": ("log(0)", "not a real number"),
    "very long": ("1 + " * 200 + "1", "expression of 801 characters"),
    "deep signs": ("-" * 300 + "1", "nested too deeply"),
    "deep calls": ("abs(" * 70 + "1" + ")" * 70, "nested too deeply"),
    "open parentheses": ("(" * 200, "is not an expression"),
    "function alone": ("sqrt", "is a function without its arguments"),
    "too few arguments": ("clip(1, 2)", "clip() got 2 arguments"),
    "too many arguments": ("sqrt(1, 2)", "sqrt() got 2 arguments"),
    "no arguments": ("min()", "min() got 0 arguments"),
}


@pytest.mark.parametrize(("text", "cause"), REFUSED.values(), ids=REFUSED)
def test_what_is_not_arithmetic_is_refused_at_its_place(text: str, cause: str) -> None:
    with pytest.raises(SpecError) as caught:
        parse(text, HERE)
    (problem,) = caught.value.problems
    assert cause in problem.cause
    assert problem.remedy
    assert problem.where is not None
    assert (problem.where.file, problem.where.line) == ("tree.yaml", 7)
    assert len(problem.cause) < 200


def test_many_parentheses_around_a_number_are_only_parentheses() -> None:
    assert parse("(" * 150 + "1" + ")" * 150).constant == 1.0


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("sqr(2)", 20),
        ("1 + sqr(2)", 24),
        ("  1 + sqr(2)", 26),
        ("min(x, 1, foo(2))", 30),
        ("x + 'a'", 24),
        ("2 * ().real", 24),
        ("1 + sin", 24),
        ("2 * 1j", 24),
    ],
)
def test_the_column_is_that_of_the_piece_that_is_wrong(text: str, column: int) -> None:
    with pytest.raises(SpecError) as caught:
        parse(text, HERE)
    assert caught.value.problems[0].where == Location("tree.yaml", 7, column)


def test_an_unknown_function_names_the_nearest_and_all_others() -> None:
    with pytest.raises(SpecError) as caught:
        parse("sqr(2)", HERE)
    remedy = caught.value.problems[0].remedy
    assert remedy.startswith("did you mean 'sqrt'?")
    assert all(name in remedy for name in FUNCTIONS)


def test_a_value_that_comes_to_no_number_names_its_inputs() -> None:
    with pytest.raises(ResolveError) as caught:
        parse("sqrt(a - b)", HERE).value({"a": 1.0, "b": 2.0}, "thigh_length")
    (problem,) = caught.value.problems
    assert problem.cause.startswith("thigh_length = 'sqrt(a - b)' has no value")
    assert "a = 1, b = 2" in problem.remedy
    assert problem.where == HERE


@given(st.text(max_size=60))
def test_any_text_is_an_expression_or_a_spec_error(text: str) -> None:
    try:
        where = parse(text, HERE).where
    except SpecError as error:
        where = error.problems[0].where
    assert where is not None
    assert where.line == 7


@pytest.mark.parametrize(
    "text",
    [
        # Truth is a number.
        *("(a > 0.2) + (a > 0.1)", "deg(a > 0.1)", "-(a > 0.2)", "(a > 0.2) - (a > 0.1)"),
        *("exp(not a > 0.2)", "(a > 0.2 and a > 0.1) + (a > 0.2 or a > 0.1)"),
        # A row is spoilt where the design alone would be an error.
        *("min(1 / (a - 0.3), 3)", "1 / exp(a * 4000)", "(1 / (a - 0.3) > 2) + 1"),
        *("sqrt(a - 0.4) ** 0", "1 ** log(a - 0.3)", "1 if 1 / (a - 0.3) > 2 else 0"),
        "max(log(a - 0.3), 0)",
        # A branch that is not taken spoils none.
        *("where(a > 0, 1 / a, 7)", "1 / a if a > 0 else 7", "a > 0 and 1 / a > 1"),
        # Minus zero has the angle of zero.
        *("atan2(0, clip(0, 0, 0 * a))", "atan2(0 * a, -1)"),
    ],
)
def test_a_row_is_the_design_alone_and_is_spoilt_where_that_is_an_error(text: str) -> None:
    many = np.array([0.0, 0.15, 0.2, 0.25, 0.3, 0.5, -2.0, 2.0])
    expression = parse(text)
    with np.errstate(all="ignore"):
        batch = np.broadcast_to(np.asarray(expression.value({"a": many})), len(many))
    for a, row in zip(many, batch, strict=True):
        try:
            alone = expression.value({"a": float(a)})
        except ResolveError:
            assert not np.isfinite(row)
        else:
            assert row == pytest.approx(alone, abs=1e-15)
    if text.startswith("atan2"):
        assert batch[6] == batch[7]


@pytest.mark.parametrize(
    "text",
    ["1if 2 else 3", "2 if 1else 3", "0x1for 2", "1.or 2", "'\\d'", "1 + \\\n 2", "3j", "2x"],
)
def test_what_pythons_parser_would_warn_of_is_refused(text: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(SpecError, match=r"is not a number|a backslash is not allowed"):
            parse(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("1e-3", 1e-3), ("2.5E+2-1", 249), (".5", 0.5), ("1.", 1), ("1_000", 1000), ("3-.5e1", -2)],
)
def test_numbers_may_be_written_as_people_do(text: str, expected: float) -> None:
    assert parse(text).constant == expected


@pytest.mark.parametrize("source", [5, 0.25, float("inf"), "2 * 3", " 2 * leg.radius + a"])
def test_an_expression_travels_between_processes(source: float | str) -> None:
    first = parse(source, Location("a.yaml", 3, 4))
    again = pickle.loads(pickle.dumps(first))  # noqa: S301
    assert again == first
    env = {"leg.radius": 0.1, "a": 3.0}
    assert again.value(env) == first.value(env)


def test_a_spec_travels_between_processes() -> None:
    spec = draft.load("quadruped")
    again = pickle.loads(pickle.dumps(spec))  # noqa: S301
    assert again.resolve("bear").body_masses() == spec.resolve("bear").body_masses()
