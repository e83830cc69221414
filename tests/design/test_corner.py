"""A motor with a limited current: full peak torque up to a corner speed, then a falling line."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design.actuators import Actuator, size
from draft.design.bands import actuator_bands
from draft.design.loads import loads
from draft.design.report import actuator_record, design_file
from draft.fitting.limits import DATA
from draft.laws.catalogue import catalogue
from draft.laws.limits import copper_loss, limits
from draft.metrics import carry, of_design
from draft.model.urdf import actuators
from draft.values import scalar
from tests.written import write_robot

QUADRUPED = draft.load("quadruped")
KEY = "actuators.leg.corner_speed"
STATED = {"peak_torque": 60.0, "no_load_speed": 20.0}
KNOWN = [part for part in catalogue().values() if part.corner_speed is not None]


def motor(corner: float, **more: float) -> Actuator:
    return size("leg", {**STATED, "corner_speed": corner, **more}, None)


@given(st.floats(0.1, 19.9), st.floats(0, 30))
def test_torque_is_full_up_to_the_corner_and_falls_in_a_line_to_no_load(
    corner: float, speed: float
) -> None:
    a = motor(corner)
    expected = 60 if speed <= corner else max(60 * (20 - speed) / (20 - corner), 0)
    assert a.available(speed) == pytest.approx(expected, abs=1e-9)
    assert a.stall_torque == pytest.approx(60 * 20 / (20 - corner))
    assert a.torque_speed() == ((0.0, 60.0), (corner, 60.0), (20.0, 0.0))


@given(st.floats(0.0, 19.9), st.floats(0.0, 20.0))
def test_the_points_of_the_line_are_straight_along_the_torque_that_is_available(
    corner: float, speed: float
) -> None:
    a = motor(corner)
    speeds, torques = zip(*a.torque_speed(), strict=True)
    assert np.interp(speed, speeds, torques) == pytest.approx(a.available(speed), abs=1e-9)


@given(st.floats(0.0, 19.9), st.floats(0.0, 60.0))
def test_the_fastest_speed_of_a_torque_is_where_the_line_has_it(
    corner: float, torque: float
) -> None:
    a = motor(corner)
    speed = a.fastest(torque)
    assert a.available(speed) == pytest.approx(torque, abs=1e-6)
    assert speed >= corner * (1 - 1e-9) - 1e-12
    assert a.fastest(60.001) == (0.0 if corner else pytest.approx(0.0, abs=1e-9))


@given(st.floats(0.05, 19.9))
def test_peak_power_is_the_largest_product_along_the_line(corner: float) -> None:
    a = motor(corner)
    speeds = np.append(np.linspace(0, 20, 20_001), corner)
    assert a.peak_power == pytest.approx(float(np.max(speeds * a.available(speeds))), rel=1e-5)


def test_without_a_corner_everything_is_as_without_the_option() -> None:
    bare, zero = size("leg", STATED, None), motor(0.0)
    assert (bare.corner_speed, bare.stall_torque, bare.has_corner) == (0.0, 60.0, False)
    assert bare.torque_speed() == zero.torque_speed() == ((0.0, 60.0), (20.0, 0.0))
    assert "corner_speed" not in actuator_record(bare)
    design = QUADRUPED.resolve("cheetah")
    assert of_design(design) == of_design(QUADRUPED.resolve("cheetah", {KEY: 0})) | {
        "top_speed": of_design(design)["top_speed"]
    }
    entry = actuators(design)["joints"]["FL_knee"]
    assert not {"corner_speed", "stall_torque"} & entry.keys()
    assert len(design.build().scene().numeric("FL_knee_dc_motor").data) == 2


def test_the_trend_is_a_share_of_the_no_load_speed_with_a_wide_band() -> None:
    a = QUADRUPED.resolve("cheetah", {KEY: "trend"}).actuators["leg"]
    law = limits().corner
    assert a.corner_speed == pytest.approx(law.coefficient * 40)
    assert law.coefficient == pytest.approx(0.55, abs=0.005)
    low, high = actuator_bands(a)["corner_speed"]
    assert low == pytest.approx(a.corner_speed / law.band(0.9))
    assert high == 40  # no corner is beyond the no-load speed
    record = actuator_record(a)
    assert record["corner_speed"]["origin"] == "trend"
    assert record["corner_speed"]["n"] == law.n
    assert record["peak_power"]["band"]["90"][1] <= 72 * 40


def test_a_part_has_its_own_corner_where_it_is_known_and_keeps_its_share() -> None:
    assert {part.name for part in KNOWN} == {"RS00", "RS03", "RS04", "RS05", "RS06"}
    for part in KNOWN:
        a = size("leg", {}, part, by_trend=("corner_speed",))
        assert (a.corner_speed, a.origins["corner_speed"].kind) == (part.corner_speed, "catalogue")
        faster = size("leg", {"no_load_speed": 30.0}, part, by_trend=("corner_speed",))
        own = (part.corner_speed or 0.0) / part.no_load_speed
        assert faster.corner_speed == pytest.approx(own * 30)
    unasked = size("leg", {}, KNOWN[0])
    assert not unasked.has_corner


def test_corners_of_parts_are_those_of_the_table_at_the_speed_of_the_catalogue() -> None:
    with (DATA / "torque_speed_corners.csv").open(encoding="utf-8") as file:
        rows = {
            row["name"].partition(" ")[2]: row
            for row in csv.DictReader(file)
            if row["use_in_stats"] == "yes"
        }
    for name, part in catalogue().items():
        row = rows.get(name)
        speed = float(row["no_load_speed_rad_s"]) if row else 0.0
        if row is None or abs(speed / part.no_load_speed - 1) > 0.03:
            assert part.corner_speed is None
        else:
            assert part.corner_speed == float(row["corner_speed_rad_s"])


@given(st.floats(0.5, 38.0))
def test_a_later_corner_jumps_higher_stands_cooler_and_runs_no_slower(corner: float) -> None:
    values = {KEY: np.array([0.0, corner, corner + 1]), "payload": 60.0}
    found = of_design(QUADRUPED.resolve("cheetah", values))
    for name in ("jump_height", "squat_power", "top_speed"):
        assert np.all(np.diff(np.asarray(found[name])) >= -1e-9), name
    assert np.all(np.diff(np.asarray(found["cost_of_standing"])) <= 0)
    for same in ("payload_peak", "torque_margin", "mass"):
        assert np.ptp(np.asarray(found[same])) == 0


def test_carrying_at_a_speed_knows_the_corner() -> None:
    values = {KEY: np.array([0.0, 30.0])}
    slow, quick = np.asarray(carry(QUADRUPED.resolve("cheetah", values), 100, 1.0).margin)
    assert quick >= slow


def test_the_heat_of_standing_is_that_of_its_rating_or_of_its_line_the_lesser() -> None:
    design = QUADRUPED.resolve("cheetah", {KEY: 30})
    heat = float(of_design(design)["cost_of_standing"]) * scalar(design.mass)
    square = sum(x.leg.copies * scalar(x.torque) ** 2 for x in loads(design))
    # The module is a cylinder of 63 mm by 46 mm with a rated torque of 24.78 N m.
    by_rating = 12 * 75 * 2 * np.pi * 0.063 * (0.063 + 0.046) / 24.777**2
    assert heat / square == pytest.approx(by_rating, rel=1e-3)
    # tau^2 w_NL / tau_stall with a stall torque of 20 times the peak.
    late = QUADRUPED.resolve("cheetah", {KEY: 38})
    assert scalar(late.actuators["leg"].copper_loss) == pytest.approx(40 / (20 * 72))


def test_a_motor_without_a_corner_heats_as_one_with_that_of_the_trend() -> None:
    found = copper_loss(72.0, 40.0, np.array([0.0, 30.0, limits().corner(40.0)]))
    assert found == pytest.approx([40 / 72 * 0.453125, 40 / 72 / 4, 40 / 72 * 0.453125])


def test_files_say_the_corner_and_are_read_back(tmp_path: Path) -> None:
    for value in ("trend", 30.0):
        design = QUADRUPED.resolve("cheetah", {KEY: value})
        a = design.actuators["leg"]
        scene = design.build().scene()
        peak, speed, stall = scene.numeric("FL_knee_dc_motor").data
        assert (peak, speed) == (72, 40)
        assert stall == pytest.approx(scalar(a.stall_torque))
        table = actuators(design)
        assert table["joints"]["FL_knee"]["stall_torque"] == a.stall_torque
        assert "stall_torque" in table["torque_speed"]
        folder = design.build().save(tmp_path / str(value))
        again = QUADRUPED.resolve(Path(folder) / "design.yaml")
        assert again.actuators["leg"].corner_speed == a.corner_speed
        assert design_file(design)["values"][KEY] == value


def test_a_class_states_it_in_its_file_and_expressions_read_it(tmp_path: Path) -> None:
    folder = write_robot(tmp_path / "robot")
    file = folder / "parameters.yaml"
    text = file.read_text(encoding="utf-8")
    stated = text.replace("gear_ratio: 15", "gear_ratio: 15\n    corner_speed: trend")
    file.write_text(
        stated.replace("0.5 * leg.radius", "0.5 * leg.radius * (1 + leg.corner_speed / 20)"),
        encoding="utf-8",
    )
    spec = draft.load(folder)
    a = spec.resolve().actuators["leg"]
    assert a.origins["corner_speed"].trend == "corner"
    share = limits().corner.coefficient
    assert spec.resolve().parameters["foot_radius"] == pytest.approx(0.5 * a.radius * (1 + share))
    # A design takes it away, or states another.
    assert not spec.resolve({KEY: None}).actuators["leg"].has_corner
    assert spec.resolve({KEY: 8}).actuators["leg"].corner_speed == 8
    assert design_file(spec.resolve({KEY: None}))["values"][KEY] is None


def test_torque_or_speed_cannot_follow_from_the_power_of_a_motor_with_a_corner() -> None:
    stated = {"peak_torque": 60.0, "peak_power": 300.0, "corner_speed": 5.0}
    with pytest.raises(draft.DraftError, match="its torque or speed would follow from peak_power"):
        size("leg", stated, None)
    both = size("leg", {**stated, "no_load_speed": 20.0}, None)
    assert both.peak_power == 300
