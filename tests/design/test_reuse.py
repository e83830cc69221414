"""What a design takes over from the last one of its spec is what it would compute."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design import plan as plans
from draft.design.reuse import Reuse

ROBOTS = draft.shipped()
SPECS = {name: draft.load(name) for name in ROBOTS}
# The same robots, of which no result is kept.
FRESH = {name: draft.load(name) for name in ROBOTS}
for spec in FRESH.values():
    plans._plans[spec] = replace(plans.plan(spec), last=Reuse(keeps=False))
DRIVES = ("peak_torque", "no_load_speed", "mass", "damping")


@st.composite
def edits(draw: st.DrawFn) -> tuple[str, list[dict[str, Any]]]:
    """A robot, and values that it takes one after the other, each with one edit more or less."""
    name = draw(st.sampled_from(ROBOTS))
    spec = SPECS[name]
    keys = [*spec.parameters, *(f"actuators.{a}.{q}" for a in spec.actuators for q in DRIVES)]
    factors = st.sampled_from(("*0.9", "*1.05", "*1", "0", "*1.3"))
    table: dict[str, Any] = {}
    tables = []
    for key, factor in draw(st.lists(st.tuples(st.sampled_from(keys), factors), max_size=5)):
        table = {**table, key: factor} if key not in table else {k: table[k] for k in [*table][1:]}
        tables.append(table)
    return name, [{}, *tables, {}]


def told(spec: draft.Spec, table: dict[str, Any]) -> object:
    """All that is told of a design: its numbers, findings and model, or why there is none."""
    try:
        design = spec.resolve(table)
        numbers = (design.bodies, design.segments, design.parameters, design.actuators)
        found = [*map(repr, numbers), design.findings, design.frames(), design.frames(home=True)]
        found += [design.mass, design.lowest(), design.lowest(home=True), design.trunk.mass]
    except draft.DraftError as error:
        return str(error)
    try:
        return [*found, design.build().xml]
    except draft.DraftError as error:
        return [*found, str(error)]


@settings(max_examples=25)
@given(edits())
def test_a_design_after_others_is_the_design_alone(drawn: tuple[str, list[dict[str, Any]]]) -> None:
    name, tables = drawn
    for table in tables:
        assert told(SPECS[name], table) == told(FRESH[name], table)


@pytest.mark.parametrize("name", ROBOTS)
def test_each_parameter_reaches_all_that_reads_it(name: str) -> None:
    for key, parameter in SPECS[name].parameters.items():
        if parameter.value.constant:
            edited = {key: "*1.07"}
            assert told(SPECS[name], edited) == told(FRESH[name], edited), key


def test_what_an_edit_does_not_change_is_the_same_object() -> None:
    spec = SPECS["humanoid"]
    first, second = (spec.resolve({"thigh_length": x}) for x in (0.2, 0.21))
    same = [
        one.name for one, other in zip(first.bodies, second.bodies, strict=True) if one is other
    ]
    assert spec.bodies[0].name in same
    assert not any("thigh" in name for name in same)
    assert first.actuators["large"] is second.actuators["large"]


def test_n_designs_are_not_kept() -> None:
    spec = SPECS["quadruped"]
    spec.resolve()
    before = spec.resolve().bodies[1]
    many = spec.resolve({"thigh_length": np.linspace(0.2, 0.3, 3)})
    assert many.bodies[1] is not before
    assert spec.resolve().bodies[1] is before


def test_a_spec_is_freed_with_its_results() -> None:
    spec = draft.load("hopper")
    spec.resolve({"payload": 1}).build()
    spec.resolve().build()
    kept = weakref.ref(spec)
    del spec
    gc.collect()
    assert kept() is None


def test_a_result_is_kept_as_long_as_its_arguments_are_the_same() -> None:
    reuse, calls = Reuse(), []
    one, two, other = object(), object(), object()

    def make(*of: object) -> int:
        calls.append(of)
        return len(calls)

    assert [reuse.result("a", make, *of) for of in ((one, two), (one, two))] == [1, 1]
    assert reuse.result("b", make, one, two) == 2
    assert [reuse.result("a", make, *of) for of in ((one, other), (one,), (one, two))] == [3, 4, 5]


def test_equal_numbers_count_as_the_same_but_for_the_sign_of_zero() -> None:
    reuse = Reuse()
    first = float("1.5")
    assert reuse.equal("a", first) is reuse.equal("a", float("1.5")) is first
    reuse.equal("a", 0.0)
    assert str(reuse.equal("a", -0.0)) == "-0.0"
