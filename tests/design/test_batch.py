"""N designs resolved at once are the N designs resolved one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design.bands import actuator_bands
from draft.design.battery import battery
from draft.metrics import of_design, payload_for
from tests.design.test_battery import with_battery
from tests.helpers import leg, parameter, robot
from tests.model.test_slides import telescope

QUADRUPED = draft.load("quadruped")
RANGES: dict[str, tuple[float, float]] = {
    name: p.bounds for name, p in QUADRUPED.parameters.items() if p.bounds is not None
} | {
    "actuators.leg.peak_torque": (1.0, 3000.0),
    "actuators.leg.no_load_speed": (0.5, 120.0),
    "actuators.leg.gear_ratio": (1.0, 300.0),
    "actuators.leg.mass": (0.1, 200.0),
    "actuators.leg.aspect_ratio": (0.1, 3.0),
    "actuators.leg.damping": (0.0, 1.0),
}
unit = st.floats(0, 1)


@st.composite
def tables(draw: st.DrawFn) -> tuple[dict[str, Any], int]:
    """A table of values of the quadruped, each an array of N or one number for all."""
    count = draw(st.integers(1, 5))
    names = draw(st.lists(st.sampled_from(sorted(RANGES)), min_size=1, unique=True))
    table: dict[str, Any] = {}
    for k, name in enumerate(names):
        low, high = RANGES[name]
        shares = draw(st.lists(unit, min_size=count, max_size=count))
        values = np.clip(low + (high - low) * np.array(shares), low, high)
        table[name] = values if k == 0 or draw(st.booleans()) else float(values[0])
    return table, count


def _row(table: dict[str, Any], i: int) -> dict[str, Any]:
    return {key: float(x[i]) if isinstance(x, np.ndarray) else x for key, x in table.items()}


def _pick(value: Any, count: int, i: int) -> Any:
    """Entry of one design among N; a number that no array touches is the same for all."""
    return np.broadcast_to(value, count)[i]


def _numbers(design: draft.Design) -> dict[str, Any]:
    """Every number of a design, by name."""
    found: dict[str, Any] = {f"parameter {k}": x for k, x in design.parameters.items()}
    found |= {f"mass of {k}": x for k, x in design.body_masses().items()}
    for name, a in design.actuators.items():
        found |= {f"{name}.{q}": getattr(a, q) for q in a.quantities}
    for segment in design.segments:
        found |= {f"length of {segment.bodies}": segment.length}
    for body, (origin, _) in zip(design.bodies, design.frames(home=True), strict=True):
        found |= {f"{body.name} {k}": x for k, x in enumerate(origin)}
        found |= {f"radius of {body.name}": body.member_radius}
        found |= {f"centre of {body.name}": body.member_centre}
    volume, com, inertia = (getattr(design.trunk.loft, x) for x in ("volume", "com", "inertia"))
    found |= {"volume": volume, "lowest": design.lowest(), "lowest at home": design.lowest(True)}
    found |= {f"com {k}": com[k] for k in range(3)}
    found |= {f"inertia {i}{j}": inertia[i][j] for i in range(3) for j in range(3)}
    return found | {"mass": design.mass, "actuator mass": design.actuator_mass}


def _said(design: draft.Design, i: int | None = None) -> dict[tuple[str, str, str], bool]:
    """What the filter says about one design (of many), by kind, place and severity."""
    said: dict[tuple[str, str, str], bool] = {}
    for f in design.findings:
        holds = bool(f.mask) if i is None else bool(_pick(f.mask, design.count or 1, i))
        key = (f.id, f.where, f.severity)
        said[key] = said.get(key, False) or holds
    return {key: True for key, holds in said.items() if holds}


def _check_same(
    spec: draft.Spec,
    table: dict[str, Any],
    count: int,
    numbers_of: Callable[[draft.Design], dict[str, Any]] = _numbers,
) -> None:
    many = spec.resolve(table)
    assert many.count == count
    numbers = numbers_of(many)
    for i in range(count):
        one = spec.resolve(_row(table, i))
        for name, expected in numbers_of(one).items():
            value = _pick(numbers[name], count, i)
            assert value == pytest.approx(expected, rel=1e-12, abs=1e-14, nan_ok=True), name
        assert _said(many, i) == _said(one)
        assert _pick(many.accepted, count, i) == one.accepted


def _told(design: draft.Design) -> dict[str, Any]:
    """Numbers, metrics and bands of a design, by name."""
    bands = {"mass": design.mass_band(), "payload for a minute": payload_for(design, 60.0)}
    bands["energy"] = battery(design).band
    for name, actuator in design.actuators.items():
        bands |= {f"{name}.{of}": band for of, band in actuator_bands(actuator).items()}
    found = _numbers(design) | of_design(design)
    return found | {f"band of {k} {i}": x for k, band in bands.items() for i, x in enumerate(band)}


KEY = "actuators.leg."
CHEETAH, BEAR = (dict(QUADRUPED.designs[name].values) for name in ("cheetah", "bear"))
# A robot, and what varies: laws change at their ends, findings come and go.
VARIED: dict[str, tuple[draft.Spec, dict[str, Any]]] = {
    "legs inside and outside the survey": (
        replace(QUADRUPED, structure="calibrated"),
        {"thigh_length": [0.1, 0.25, 0.6]},
    ),
    "corner speeds": (
        QUADRUPED,
        CHEETAH | {KEY + "corner_speed": [0.0, 5.0, 22.0, 39.0], "payload": 20.0},
    ),
    "payloads": (QUADRUPED, BEAR | {"payload": [0.0, 2.0, 50.0]}),
    "torques of servos and of modules": (
        QUADRUPED,
        {KEY + "like": None, KEY + "peak_torque": [2.0, 4.2, 30.0, 72.0, 200.0]},
    ),
    "reductions with different laws of the rated torque": (
        robot(),
        {KEY + "peak_torque": [50.0, 60.0, 70.0, 80.0], KEY + "gear_ratio": [10.0, 49, 50, 100]},
    ),
    "rated torques below that of standing": (QUADRUPED, {KEY + "rated_torque": [5.0, 30.0]}),
    "masses in another unit": (QUADRUPED, {KEY + "mass": [1.1, 1100.0, 0.5, 40.0]}),
    "batteries": (with_battery("{energy: 1000 * trunk_length}"), {"trunk_length": [0.4, 0.6]}),
    "a humanoid": (draft.load("humanoid"), {"thigh_length": [0.15, 0.2, 0.3]}),
    "a hopper": (draft.load("hopper"), {"shin_length": [0.2, 0.3], "payload": [0.0, 30.0]}),
    "homes of a slide": (
        robot(telescope(home="out"), parameters={"out": parameter(0.0, -1, 1)}),
        {"out": [-0.05, 0.0, 0.08]},
    ),
}


@pytest.mark.parametrize(("spec", "table"), VARIED.values(), ids=VARIED)
def test_what_is_told_of_many_is_told_of_each(spec: draft.Spec, table: dict[str, Any]) -> None:
    arrays = {key: np.array(x) if isinstance(x, list) else x for key, x in table.items()}
    count = max(len(x) for x in arrays.values() if isinstance(x, np.ndarray))
    _check_same(spec, arrays, count, _told)


@settings(max_examples=60)
@given(tables())
def test_every_number_and_finding_of_many_is_that_of_each(
    drawn: tuple[dict[str, Any], int],
) -> None:
    _check_same(QUADRUPED, *drawn)


@given(st.sampled_from(sorted(QUADRUPED.designs)), st.lists(unit, min_size=1, max_size=4))
def test_a_named_design_varied_is_each_of_its_variations(name: str, shares: list[float]) -> None:
    base = dict(QUADRUPED.designs[name].values)
    torque = float(base["actuators.leg.peak_torque"] or 0) * (0.3 + 2 * np.array(shares))
    _check_same(QUADRUPED, {**base, "actuators.leg.peak_torque": torque}, len(shares))


bent = robot(
    leg(
        thigh={
            "rpy": ["roll", "0.3", "pitch"],
            "joint": {
                "name": "hip",
                "axis": [1, "cant", 0.2],
                "range": ["low", "low + 1.5"],
                "home": "low + 0.5",
                "actuator": "leg",
            },
            "link": {"axis": [0, "cant", -1], "length": "thigh", "segment": "thigh"},
        }
    ),
    children=[
        {"chain": "leg", "prefix": "L_", "at": [0, "spacing", -0.2]},
        {"chain": "leg", "prefix": "R_", "at": [0, "spacing", -0.2], "mirror": "y"},
    ],
    parameters={
        "roll": parameter(0.0),
        "pitch": parameter(0.0),
        "cant": parameter(0.0),
        "low": parameter(-0.75),
        "thigh": parameter(0.3),
        "spacing": parameter(0.1),
        "waist": parameter(0.2),
    },
    root={
        "axis": "z",
        "sections": [
            {"at": -0.2, "polygon": [[-0.1, -0.1], ["waist", -0.1], [0.02, 0], [-0.1, 0.1]]},
            {"at": 0.2, "polygon": [[-0.1, -0.1], [0.1, -0.1], [0.02, 0], [-0.1, "waist"]]},
        ],
    },
)
# Zero and one number for all are where a direction or a rotation degenerates.
BENT = {
    "roll": (-1.0, 1.0),
    "pitch": (-1.0, 1.0),
    "cant": (-0.9, 0.9),
    "low": (-1.4, 0.8),
    "thigh": (0.02, 0.5),
    "spacing": (-0.1, 0.3),
    "waist": (0.1, 0.3),
}
rows = st.fixed_dictionaries({k: st.one_of(st.floats(*v), st.just(v[0])) for k, v in BENT.items()})


@pytest.mark.slow
@given(st.lists(rows, min_size=1, max_size=5), st.sets(st.sampled_from(sorted(BENT)), min_size=1))
def test_canted_axes_and_rotated_links_of_many_are_those_of_each(
    drawn: list[dict[str, float]], varied: set[str]
) -> None:
    table: dict[str, Any] = dict(drawn[0])
    table |= {name: np.array([row[name] for row in drawn]) for name in varied}
    _check_same(bent, table, len(drawn))


@pytest.mark.parametrize(
    ("chain", "bad"),
    [
        pytest.param(leg(thigh={"link": {"axis": "-z", "length": "x", "segment": "thigh"}}), -0.1),
        pytest.param(leg(thigh={"link": {"axis": ["x", 0, 0], "length": 1, "mass": 1}}), 0.0),
        pytest.param(leg(shank={"sphere": {"radius": "log(x)"}}), -1.0),
        pytest.param(leg(shank={"sphere": {"radius": "1 / x"}}), 0.0),
        pytest.param(leg(thigh={"at": [0, 0, "sqrt(x)"]}), -1.0),
    ],
    ids=["length", "axis", "logarithm", "division", "root"],
)
def test_a_row_with_a_number_that_cannot_be_is_marked_and_alone_is_an_error(
    chain: list[dict[str, Any]], bad: float
) -> None:
    spec = robot(chain, parameters={"x": parameter(2.0)})
    many = spec.resolve({"x": np.array([2.0, bad, 3.0])})
    marked = [f for f in many.findings if f.id == "not_physical"]
    assert [list(np.asarray(f.mask)) for f in marked] == [[False, True, False]]
    assert not _pick(many.accepted, 3, 1)
    with pytest.raises(draft.ResolveError):
        spec.resolve({"x": bad})
    assert spec.resolve({"x": 2.0}).count is None


@pytest.mark.parametrize(
    ("key", "good", "bad"), [("corner_speed", 5.0, 400.0), ("rated_torque", 20.0, 80.0)]
)
def test_a_row_with_a_quantity_beyond_another_is_marked(key: str, good: float, bad: float) -> None:
    many = QUADRUPED.resolve({KEY + key: np.array([good, bad])})
    assert list(np.asarray(many.accepted)) == [True, False]


def test_a_derived_parameter_out_of_its_bounds_marks_its_row() -> None:
    derived = {**parameter("2 * x"), "range": [0, 1]}
    spec = robot(parameters={"x": parameter(0.3), "y": derived})
    many = spec.resolve({"x": np.array([0.3, 0.6])})
    assert list(np.asarray(many.accepted)) == [True, False]
    with pytest.raises(draft.ResolveError, match="outside its range"):
        spec.resolve({"x": 0.6})


def test_a_row_whose_polygon_crosses_itself_is_marked_and_alone_is_an_error() -> None:
    polygon = [[0, 0], [1, "1 - x"], [1, "x"], [0, 1]]
    sections = [{"at": at, "polygon": polygon} for at in (0, 0.1)]
    spec = robot(root={"sections": sections}, parameters={"x": parameter(1.0)})
    many = spec.resolve({"x": np.array([1.0, 0.0])})
    assert list(np.asarray(many.accepted)) == [True, False]
    with pytest.raises(draft.ResolveError, match="edges 1 and 3 of this polygon cross"):
        spec.resolve({"x": 0.0})


def test_a_batch_in_which_every_row_is_bad_is_still_a_batch() -> None:
    chain = leg(thigh={"link": {"axis": "-z", "length": "x", "segment": "thigh"}})
    spec = robot(chain, parameters={"x": parameter(1.0)})
    many = spec.resolve({"x": np.array([-1.0, 0.0, -2.0])})
    assert not np.any(many.accepted)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_an_actuator_quantity_that_cannot_be_is_an_error_in_an_array_too(bad: float) -> None:
    for value in (bad, np.array([60.0, bad])):
        with pytest.raises(draft.ResolveError):
            QUADRUPED.resolve({"actuators.leg.peak_torque": value})


def test_arrays_of_different_lengths_are_an_error() -> None:
    table = {"thigh_length": np.full(3, 0.2), "shank_length": np.full(4, 0.2)}
    with pytest.raises(draft.ResolveError, match="has 4 entries, another has 3"):
        QUADRUPED.resolve(table)


def test_a_parameter_out_of_its_range_is_an_error_in_an_array_too() -> None:
    with pytest.raises(draft.ResolveError, match="thigh_length = 5 m is outside its range"):
        QUADRUPED.resolve({"thigh_length": np.array([0.2, 5.0])})


def test_many_designs_cannot_be_built_at_once() -> None:
    with pytest.raises(draft.DraftError, match="this is 2 designs"):
        QUADRUPED.resolve({"thigh_length": np.array([0.2, 0.3])}).build()


@pytest.mark.parametrize(
    ("values", "cause"),
    [
        ({"a": np.array(["a"])}, "a needs real numbers, found an array of <U1"),
        ({"a": np.array([1 + 2j])}, "a needs real numbers, found an array of complex128"),
        ({"a": np.array([True])}, "a needs real numbers, found an array of bool"),
        ({"a": np.array([None])}, "a needs real numbers, found an array of object"),
        ({"a": np.array(1 + 2j)}, "a needs a number, found a complex"),
        ({"a": np.array(True)}, "a needs a number, found a bool"),
        ({1: 2.0}, "1 is not the name of a parameter"),
    ],
)
def test_what_is_no_number_is_an_error_in_python_too(values: Any, cause: str) -> None:
    spec = robot(parameters={"a": parameter(1.0)})
    with pytest.raises(draft.ResolveError) as caught:
        spec.resolve(values)
    assert caught.value.problems[0].cause == cause


@pytest.mark.slow
@settings(max_examples=20)
@given(tables())
def test_an_indexed_design_is_the_design_resolved_alone(
    drawn: tuple[dict[str, Any], int],
) -> None:
    table, count = drawn
    many = QUADRUPED.resolve("bear", table)
    assert len(many) == count
    for i, found in enumerate(many):
        one = QUADRUPED.resolve("bear", _row(table, i))
        assert (found.label, found.values, found.count) == (one.label, one.values, None)
        assert found.findings == one.findings
        np.testing.assert_equal(_numbers(found), _numbers(one))


def test_slices_masks_and_lists_of_rows_select_designs() -> None:
    lengths = np.array([0.2, 0.25, 0.3, 0.35])
    many = QUADRUPED.resolve({"thigh_length": lengths, "shank_length": 0.3})
    for index in (slice(1, 3), slice(None, None, -1), [0, 3], np.array([2]), lengths > 0.22):
        some = many[index]
        assert len(some) == some.count == len(lengths[index])
        np.testing.assert_array_equal(some.parameters["thigh_length"], lengths[index])
        assert some.parameters["shank_length"] == 0.3
    assert many[-1].parameters["thigh_length"] == 0.35
    assert all(isinstance(value, float) for value in many[np.int64(2)].values.values())


def test_an_index_that_selects_no_design_is_an_error() -> None:
    many = QUADRUPED.resolve({"thigh_length": np.array([0.2, 0.3])})
    for index in (2, -3, slice(2, None), np.array([False, False]), []):
        with pytest.raises(IndexError):
            many[index]
    with pytest.raises(TypeError, match="2 dimensions"):
        many[np.zeros((2, 2), dtype=int)]


def test_a_single_design_has_neither_length_nor_index_and_is_true() -> None:
    one = QUADRUPED.resolve()
    for use in (len, list, lambda design: design[0]):
        with pytest.raises(TypeError, match="a single Design has no length"):
            use(one)
    assert one


def test_a_row_that_no_design_can_be_is_an_error_when_it_is_selected() -> None:
    spec = robot(leg(shank={"sphere": {"radius": "1 / x"}}), parameters={"x": parameter(2.0)})
    many = spec.resolve({"x": np.array([2.0, 0.0])})
    assert many[0].accepted
    with pytest.raises(draft.ResolveError):
        many[1]
