"""Values that refer to what they replace: `1.2*thigh_length`, `*1.2`, `/2`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.errors import DraftError
from draft.explore.screen import screen
from draft.metrics import METRICS
from draft.spec.relative import merged
from draft.studio.library import Library
from draft.studio.session import Point, Session
from draft.values import scalar
from tests.helpers import DRIVE, parameter, robot

QUADRUPED = draft.load("quadruped")
TORQUE = "actuators.leg.peak_torque"


def number(design: draft.Design, key: str) -> float:
    """Value of a parameter or of a quantity of an actuator class."""
    if not key.startswith("actuators."):
        return scalar(design.parameters[key])
    _, actuator, quantity = key.split(".")
    return scalar(getattr(design.actuators[actuator], quantity))


keys = st.sampled_from(
    [
        *("thigh_length", "shank_length", "foot_radius", TORQUE),
        *(f"actuators.leg.{name}" for name in ("mass", "rotor_inertia", "gear_ratio", "radius")),
    ]
)
forms = st.sampled_from(["*{f}", " * {f}", "{f}*{name}", "{name} * ({f})", "{name} / (1 / {f})"])
named = st.sampled_from([None, "bear", "giraffe"])


@settings(max_examples=60)
@given(keys, forms, st.floats(0.9, 1.05), named)
def test_a_relative_value_gives_the_design_of_the_number_it_comes_to(
    key: str, form: str, factor: float, base: str | None
) -> None:
    text = form.format(f=repr(factor), name=key.removeprefix("actuators."))
    expected = factor * number(QUADRUPED.resolve(base), key)
    relative, absolute = (QUADRUPED.resolve(base, {key: v}) for v in (text, expected))
    assert number(relative, key) == pytest.approx(expected, rel=1e-12)
    assert relative.mass == pytest.approx(absolute.mass, rel=1e-12)
    assert [f.id for f in relative.findings] == [f.id for f in absolute.findings]


def test_what_is_replaced_stays_an_expression_of_its_own() -> None:
    chosen = {"a": parameter(2.0), "b": parameter("a + 1"), "c": parameter("-a")}
    spec = robot(parameters=chosen)
    got = spec.resolve({"a": 5.0, "b": "*2", "c": "c**2"}).parameters
    assert (got["b"], got["c"]) == (12.0, 25.0)


def test_a_named_design_may_scale_the_file_and_be_scaled_itself(tmp_path: Path) -> None:
    file = tmp_path / "longer.yaml"
    file.write_text("doc: Longer.\nvalues: {thigh_length: '*1.1'}\n")
    base = number(QUADRUPED.resolve(), "thigh_length")
    assert number(QUADRUPED.resolve(file), "thigh_length") == pytest.approx(1.1 * base)
    twice = QUADRUPED.resolve(file, {"thigh_length": "*1.1"})
    assert number(twice, "thigh_length") == pytest.approx(1.21 * base)


def test_arrays_are_scaled_design_by_design() -> None:
    torque = np.array([20.0, 40.0])
    many = QUADRUPED.resolve({TORQUE: torque}, {TORQUE: "*2", "actuators.leg.mass": "*3"})
    assert np.allclose(many.actuators["leg"].peak_torque, 2 * torque)
    usual = QUADRUPED.resolve({TORQUE: 2 * torque}).actuators["leg"].mass
    assert np.allclose(many.actuators["leg"].mass, 3 * np.asarray(usual))


@pytest.mark.parametrize(
    "values",
    [
        {"a": "b + a", "b": "2*a"},
        {"b": "b + c", "c": "c + b"},
        {"actuators.leg.mass": "2 * leg.radius"},
        {"actuators.leg.mass": "leg.mass + leg.radius"},
    ],
)
def test_a_cycle_through_another_number_is_still_refused(values: dict[str, str]) -> None:
    spec = robot(parameters={"a": parameter(1.0), "b": parameter("a"), "c": parameter("a")})
    with pytest.raises(DraftError, match="in a cycle"):
        spec.resolve(values)


@pytest.mark.parametrize(
    ("older", "kind"), [(None, "nothing"), ("trend", "'trend'"), (np.ones(2), "an array")]
)
def test_a_value_that_refers_to_no_number_says_so(older: object, kind: str) -> None:
    key = "actuators.leg.corner_speed"
    with pytest.raises(DraftError, match=f"refers to the value that it replaces, .* {kind}"):
        merged({key: older}, {key: "leg.corner_speed * leg.gear_ratio"})


def test_a_quantity_by_a_trend_refers_to_what_the_trend_gives() -> None:
    spec = robot(actuators={"leg": {**DRIVE, "corner_speed": "trend"}})
    key = "actuators.leg.corner_speed"
    assert number(spec.resolve({key: "/2"}), key) == pytest.approx(number(spec.resolve(), key) / 2)


@pytest.mark.parametrize("text", ["**2", "*", "//2", "*2*"])
def test_an_unfinished_scale_is_no_expression(text: str) -> None:
    with pytest.raises(DraftError, match="is not"):
        QUADRUPED.resolve({"thigh_length": text})


def test_the_studio_scales_the_present_value(tmp_path: Path) -> None:
    session = Session(Library(QUADRUPED, tmp_path), Point("bear"))
    base = number(session.design, "thigh_length")
    for power in (1, 2):
        assert session.set_text("thigh_length", "*0.9"), session.message
        assert number(session.design, "thigh_length") == pytest.approx(0.9**power * base)


def test_a_screen_scales_the_value_of_its_design(tmp_path: Path) -> None:
    pytest.importorskip("scipy")
    pytest.importorskip("pyarrow")
    bear = QUADRUPED.resolve("bear")
    rows = screen(
        bear,
        vary={TORQUE: (60.0, 70.0)},
        out=tmp_path / "rows.parquet",
        n=4,
        metrics=["leg_length"],
        values={"thigh_length": "*0.9"},
        workers=1,
    )
    expected = QUADRUPED.resolve("bear", {"thigh_length": "*0.9"})
    found = rows.table()["leg_length"].to_numpy()
    assert np.allclose(found, METRICS["leg_length"].function(expected))
