"""Laws of servos are what the code gives, and hold on makers that they were not fitted to."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import draft
from draft.design.actuators import size
from draft.design.bands import actuator_bands
from draft.errors import DraftError
from draft.laws.actuators import laws
from draft.laws.catalogue import SERVO, catalogue
from draft.laws.servos import FILE, servo_laws
from draft.spec.new import new_robot
from tests.fitting.test_limits import SHARED

DOCS = Path(__file__).parents[2] / "docs" / "actuator-trends.md"


def test_errors_with_the_maker_held_out_keep_their_bars() -> None:
    trends = servo_laws().trends
    assert trends["mass"].n == 116
    assert trends["mass"].held_out["vendor"] == pytest.approx(1.330, abs=5e-4)
    assert trends["mass"].held_out["vendor"] < 1.35
    assert trends["rotor_inertia"].held_out["vendor"] == pytest.approx(1.925, abs=5e-4)
    assert trends["rotor_inertia"].held_out["vendor"] < 2.0
    text = " ".join(DOCS.read_text(encoding="utf-8").split())
    for name in ("mass", "volume", "gear_ratio", "rotor_inertia"):
        law = trends[name]
        assert law.formula in text
        assert f"| {law.n} | {law.held_out['vendor']:.2f} | {law.band(0.9):.2f} |" in text


def test_the_law_of_modules_is_far_off_where_that_of_servos_is_not() -> None:
    """Twice to eleven times the mass of servos by the laws of modules."""
    masses = {name: part.mass for name, part in catalogue(SERVO).items()}
    off, near = [], []
    for name, part in catalogue(SERVO).items():
        if part.peak_torque > 4:
            continue
        stated = {"peak_torque": part.peak_torque, "no_load_speed": part.no_load_speed}
        off.append(np.log(size("a", stated, None).mass / masses[name]))
        near.append(np.log(size("a", stated, None, laws=servo_laws()).mass / masses[name]))
    assert np.exp(np.mean(off)) > 2.5
    assert np.exp(np.mean(np.abs(near))) < 1.35


def test_the_band_of_a_servo_holds_nine_in_ten() -> None:
    inside = []
    for part in catalogue(SERVO).values():
        stated = {"peak_torque": part.peak_torque, "no_load_speed": part.no_load_speed}
        low, high = actuator_bands(size("a", stated, None, laws=servo_laws()), 0.9)["mass"]
        inside.append(low <= part.mass <= high)
    assert np.mean(inside) >= 0.9


def test_a_set_of_laws_of_that_name_is_of_modules() -> None:
    own = replace(laws(), name="servo")
    assert size("a", {"peak_torque": 20, "no_load_speed": 6}, None, laws=own).kind == "module"
    assert servo_laws().kind == "servo"


SERVO_CLASS = "hip: {kind: servo, peak_torque: 3, no_load_speed: 6}"


def test_a_class_is_sized_as_what_it_is(tmp_path: Path) -> None:
    design = _biped(tmp_path, SERVO_CLASS)
    hip, ankle = design.actuators["hip"], design.actuators["ankle"]
    assert (hip.kind, ankle.kind) == ("servo", "module")
    assert hip.mass == pytest.approx(float(servo_laws().trends["mass"](3.0)))
    assert not any(one.id == "outside_data" and one.where == "hip" for one in design.findings)


def test_a_class_like_a_servo_is_one(tmp_path: Path) -> None:
    part = catalogue(SERVO)["XC330-M288"]
    hip = _biped(tmp_path, "hip: {like: XC330-M288}").actuators["hip"]
    assert (hip.kind, hip.mass, hip.length) == ("servo", part.mass, part.length)
    assert hip.armature == pytest.approx(part.armature)
    stronger = _biped(tmp_path, "hip: {like: XC330-M288, peak_torque: 1.86}").actuators["hip"]
    ratio = servo_laws().trends["mass"].exponent
    assert stronger.mass == pytest.approx(part.mass * 2**ratio)


def test_servos_of_n_designs_equal_each_alone(tmp_path: Path) -> None:
    design = _biped(tmp_path, SERVO_CLASS)
    torques = [1.0, 2.0, 5.0]
    many = design.spec.resolve({"actuators.hip.peak_torque": np.array(torques)})
    alone = [design.spec.resolve({"actuators.hip.peak_torque": torque}) for torque in torques]
    masses = [one.actuators["hip"].mass for one in alone]
    assert np.asarray(many.actuators["hip"].mass).tolist() == masses


def test_a_module_below_the_modules_names_the_servos(tmp_path: Path) -> None:
    findings = _biped(tmp_path, "hip: {peak_torque: 3, no_load_speed: 6}").findings
    (one,) = [one for one in findings if one.id == "outside_data" and one.where == "hip"]
    assert "`kind: servo` sizes one" in one.message


def test_a_servo_of_four_hundred_newton_metres_is_refused(tmp_path: Path) -> None:
    design = _biped(tmp_path, "hip: {kind: servo, peak_torque: 400, no_load_speed: 6}")
    (one,) = [one for one in design.findings if one.id == "torque"]
    assert one.severity == "error"
    assert "the highest of servos" in one.message


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("hip: {kind: servos, peak_torque: 3, no_load_speed: 6}", "kind: unknown value 'servos'"),
        ("hip: {kind: module, like: XC330-M288}", "of kind module, and 'XC330-M288' is a servo"),
        ("hip: {like: XC330-M28}", "did you mean 'XC330-M288'"),
    ],
)
def test_wrong_kinds_are_refused_with_file_and_line(
    tmp_path: Path, written: str, message: str
) -> None:
    with pytest.raises(DraftError, match=r"parameters\.yaml:\d+:\d+") as caught:
        _biped(tmp_path, written)
    assert message in str(caught.value)


def test_the_shipped_table_is_that_of_the_sources() -> None:
    gathered = SHARED / "small_actuators.csv"
    if not gathered.exists():
        pytest.skip("the gathered tables are not at hand")
    columns = ("maker", "model", "mass_kg", "stall_torque_Nm", "no_load_speed_rad_s", "gear_ratio")
    files = (FILE, gathered)
    rows = []
    for path in files:
        with path.open(newline="", encoding="utf-8") as file:
            rows.append([[row[key] for key in columns] for row in csv.DictReader(file)])
    assert rows[0] == rows[1]


def _biped(folder: Path, hip: str) -> draft.Design:
    robot = new_robot(folder / f"servos_{len(list(folder.iterdir()))}", "biped")
    file = robot / "parameters.yaml"
    text = re.sub(r"  hip: .*", f"  {hip}", file.read_text(encoding="utf-8"))
    file.write_text(text, encoding="utf-8")
    return draft.load(robot).resolve()
