"""Values in another unit than Draft's are refused with the unit they look like."""

from __future__ import annotations

import csv
import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design.actuators import size
from draft.design.filter_units import ABOVE, FAR, actuator
from draft.laws.catalogue import catalogue, span
from tests.design.test_battery import with_battery
from tests.helpers import BOX, DRIVE, ids, leg, robot

QUADRUPED = draft.load("quadruped")
SHARED = Path(os.environ.get("DRAFT_SHARED", Path(__file__).parents[2].parent / "shared"))


def said(design: draft.Design, kind: str = "wrong_unit") -> list[str]:
    """Messages of a kind of finding."""
    return [finding.message for finding in design.findings if finding.id == kind]


@pytest.mark.parametrize(
    ("quantity", "stated", "unit", "meant"),
    [
        ("mass", 1100, "grams", "1.1"),
        ("peak_torque", 60000, "N mm", "60"),
        ("rated_torque", 20000, "N mm", "20"),
        ("no_load_speed", 1146, "degrees per second", "20"),
        ("radius", 45, "millimetres", "0.045"),
        ("length", 60, "millimetres", "0.06"),
        ("rotor_inertia", 500, "g cm2", "5e-05"),
        ("rotor_inertia", 0.5, "kg cm2", "5e-05"),
    ],
)
def test_a_motor_in_another_unit_is_refused_and_the_message_names_the_unit(
    quantity: str, stated: float, unit: str, meant: str
) -> None:
    more = {"peak_torque": 30000} if quantity == "rated_torque" else {}
    values = {f"actuators.leg.{name}": x for name, x in {**more, quantity: stated}.items()}
    design = QUADRUPED.resolve(values)
    assert not design.accepted
    assert any(f"looks like {unit}; write {meant}" in message for message in said(design))


def test_the_motor_of_1100_kg_is_refused_for_its_unit_and_because_it_cannot_stand() -> None:
    design = QUADRUPED.resolve({"actuators.leg.mass": 1100.0})
    assert {"wrong_unit", "cannot_stand"} <= ids(design)
    (message,) = said(design)
    assert "0.191 to 9.29 kg of 114 modules" in message
    assert float(draft.metrics.of_design(design, ["payload_rated"])["payload_rated"]) < -13e3


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_no_module_of_the_catalogue_is_remarked_on_when_its_values_are_stated(name: str) -> None:
    part = catalogue()[name]
    stated = {
        f"actuators.leg.{q}": x
        for q in ("peak_torque", "no_load_speed", "mass", "radius", "length", "rotor_inertia")
        if (x := getattr(part, q)) is not None
    }
    assert not ids(QUADRUPED.resolve(stated)) & {"wrong_unit", "stated_value"}


@given(st.sampled_from(["mass", "radius", "peak_torque"]), st.floats(0.1, 1e4))
def test_the_edges_of_remark_and_refusal_are_factors_of_the_data(name: str, share: float) -> None:
    known = span(name)
    assert known is not None
    value = known.high * share
    spec = robot(actuators={"leg": {**DRIVE, name: value}})
    found = ids(spec.resolve())
    assert ("wrong_unit" in found or "stated_value" in found) == (share > FAR)
    if "wrong_unit" in found:
        assert share > ABOVE


def test_a_module_of_a_table_in_grams_is_refused_too() -> None:
    part = replace(catalogue()["MIT U12"], name="own", mass=1100.0)
    (finding,) = actuator(size("leg", {}, part))
    assert finding.id == "wrong_unit"
    assert "looks like grams; write 1.1" in finding.message
    assert not list(actuator(size("leg", {}, catalogue()["MIT U12"])))


@pytest.mark.parametrize(
    ("stated", "unit"),
    [
        ("{energy: 2160000}", "battery energy .* looks like joules; write 600"),
        ("{energy: 0.6}", "battery energy .* looks like kilowatt hours; write 600"),
        ("{mass: 2500}", "battery mass .* looks like grams; write 2.5"),
    ],
)
def test_a_battery_in_another_unit_is_refused(stated: str, unit: str) -> None:
    design = with_battery(stated).resolve()
    assert any(re.search(unit, message) for message in said(design)), said(design)


def _box(**changes: Any) -> draft.Spec:
    link = {"name": "crate", "type": "box", "box": {"size": [0.1, 0.1, 0.1], **changes}}
    return robot(children=[{"chain": "leg", "at": [0, 0, -0.2]}, link])


@pytest.mark.parametrize(
    ("spec", "unit"),
    [
        (robot(leg(thigh={"link": {"axis": "-z", "length": 300, "segment": "thigh"}})), "millim"),
        (robot(leg(thigh={"link": {"axis": "-z", "length": 30, "segment": "thigh"}})), "centim"),
        (
            robot(leg(thigh={"link": {"axis": "-z", "length": 0.3, "mass": 1200}})),
            "grams; write 1.2",
        ),
        (
            robot(
                leg(thigh={"link": {"axis": "-z", "length": 0.3, "segment": "thigh", "mass": 400}})
            ),
            "grams; write 0.4",
        ),
        (_box(mass=2500), "grams; write 2.5"),
        (robot(root={"density": 0.65}), "g/cm3; write 650"),
        (
            robot(
                root={
                    **BOX,
                    "sections": [{"at": 10 * (2 * k - 1), "rectangle": [20, 10]} for k in range(2)],
                }
            ),
            "cubic centimetres",
        ),
    ],
    ids=["mm", "cm", "link mass", "class mass", "box mass", "density", "trunk"],
)
def test_a_robot_in_another_unit_is_refused(spec: draft.Spec, unit: str) -> None:
    design = spec.resolve()
    assert not design.accepted
    assert any(f"looks like {unit}" in message for message in said(design)), said(design)


def test_joint_ranges_in_degrees_are_refused_and_three_turns_are_remarked_on() -> None:
    def ranged(low: float, high: float, home: float = 0) -> draft.Design:
        joint: dict[str, Any] = {"name": "hip", "axis": "x", "actuator": "leg"}
        joint |= {"range": [low, high], "home": home}
        return robot(leg(thigh={"joint": joint})).resolve()

    (message,) = said(ranged(-45, 45))
    assert "looks like degrees; write deg(...)" in message
    assert said(ranged(100, 101, home=100))
    assert not ranged(-45, 45).accepted
    for low, high, remark in ((-6.2, 6.2, False), (-9.42, 9.42, True), (-10, 10, True)):
        assert ("joint_range" in ids(ranged(low, high))) == remark
        assert not said(ranged(low, high))


def test_a_continuous_joint_has_no_limits_to_compare() -> None:
    joint = {"name": "hip", "axis": "x", "range": [-50, 50]}
    driven = {**joint, "type": "continuous", "actuator": "leg"}
    assert not said(robot(leg(thigh={"joint": driven})).resolve())


def test_allow_accepts_a_value_that_is_meant() -> None:
    spec = robot(leg(thigh={"link": {"axis": "-z", "length": 30, "segment": "thigh"}}))
    assert "wrong_unit" in {f.id for f in spec.resolve().findings if f.severity == "error"}
    meant = robot(
        leg(thigh={"link": {"axis": "-z", "length": 30, "segment": "thigh"}}),
        allow=["wrong_unit:thigh"],
    )
    assert {f.severity for f in meant.resolve().findings if f.id == "wrong_unit"} == {"warning"}


def test_a_robot_that_its_motors_cannot_hold_is_refused_for_its_worst_joint_alone() -> None:
    torque = np.array([4.0, 60.0])
    many = QUADRUPED.resolve({"actuators.leg.peak_torque": torque})
    (finding,) = (f for f in many.findings if f.id == "cannot_stand")
    assert np.asarray(finding.mask).tolist() == [True, False]
    assert "knee" in finding.message
    assert np.asarray(many.accepted).tolist() == [False, True]


@pytest.mark.skipif(not SHARED.is_dir(), reason="the data are not beside this folder")
def test_no_small_servo_outside_the_catalogue_is_refused_for_its_unit() -> None:
    columns = {
        "mass_kg": "mass",
        "stall_torque_Nm": "peak_torque",
        "no_load_speed_rad_s": "no_load_speed",
        "gear_ratio": "gear_ratio",
    }
    with (SHARED / "data/small_actuators.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 100
    for column, name in columns.items():
        values = np.array([float(row[column]) for row in rows if row[column]])
        design = QUADRUPED.resolve({f"actuators.leg.{name}": values})
        assert "wrong_unit" not in ids(design), name
