"""The bill of materials: every mass once, and the nearest module of the catalogue."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np
import pytest

import draft
from draft.laws.catalogue import catalogue, nearest
from draft.model.bom import COLUMNS, bom_csv
from draft.values import scalar
from tests.helpers import LEG, robot
from tests.model.shipped import SHIPPED, built

MINE = (
    "name,vendor,family,peak_torque_nm,no_load_speed_rad_s,mass_kg,diameter_mm,length_mm,source\n"
    '"S-40, ""wide""",Own & Sons,S,60,20,0.9,100,40,"data sheet, page 2"\n'
)


def rows(design: draft.Design) -> list[dict[str, str]]:
    """Rows of the table of a design, as a spreadsheet reads them."""
    text = bom_csv(design)
    table = csv.reader(io.StringIO(text, newline=""), strict=True)
    header, *found = table
    assert tuple(header) == COLUMNS
    assert {len(row) for row in found} == {len(COLUMNS)}
    return [dict(zip(header, row, strict=True)) for row in found]


def _files(**texts: str) -> dict[str, str]:
    spec = robot()
    return {name: file.read_bytes().decode() for name, file in spec.files.items()} | texts


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_the_masses_are_those_of_the_robot(name: str, label: str | None) -> None:
    design = built(name, label).design
    found = rows(design)
    total = sum(float(row["mass_total_kg"]) for row in found)
    assert total == pytest.approx(scalar(design.mass), rel=1e-5)
    count = sum(int(row["count"]) for row in found if row["kind"] == "actuator")
    assert count == sum(body.actuator is not None for body in design.bodies)
    masses = design.body_masses()
    for row in found:
        each, n = float(row["mass_each_kg"]), int(row["count"])
        assert each * n == pytest.approx(float(row["mass_total_kg"]), rel=1e-5)
        assert row["mass_source"]
        if row["kind"] == "link":
            assert each <= scalar(masses[row["name"]]) * (1 + 1e-5)
            assert float(row["density_kg_m3"]) > 0 or each == 0


def test_a_row_says_where_its_mass_comes_from() -> None:
    links = [dict(one) for one in LEG]
    links[1] = links[1] | {"link": {"axis": "-z", "length": 0.3, "mass": 0.7}}
    load = {"name": "load", "type": "box", "box": {"size": [0.1, 0.1, 0.1], "mass": 2}}
    hung: list[dict[str, Any]] = [{"chain": "leg", "at": [0, 0, -0.2]}, load]
    design = robot(links, hung, root={"density": 500}).resolve()
    found = {row["name"]: row for row in rows(design)}
    assert found["trunk"]["mass_source"] == "density: stated"
    assert float(found["trunk"]["density_kg_m3"]) == 500
    assert found["thigh"]["mass_source"] == "stated"
    assert found["load"]["mass_source"] == "end stated"
    assert float(found["load"]["density_kg_m3"]) == 2000
    assert found["shank"]["mass_source"].startswith("m = ")
    assert "draft/laws/data/segments.csv" in found["shank"]["mass_source"]
    assert found["leg"]["mass_source"].startswith("mass = ")
    assert "housing" not in found  # It has no solid of its own.
    heavy = design.spec.resolve({"actuators.leg.mass": 1.5})
    assert {row["name"]: row for row in rows(heavy)}["leg"]["mass_source"] == "stated"


def test_the_nearest_module_is_nearest_in_torque_and_speed_as_ratios() -> None:
    parts = [*catalogue().values()]
    measured = np.log([(part.peak_torque, part.no_load_speed) for part in parts])
    for row in rows(built("humanoid", None).design):
        if row["kind"] == "actuator":
            own = np.log([float(row["peak_torque_nm"]), float(row["no_load_speed_rad_s"])])
            part = parts[int(np.argmin(np.linalg.norm(measured - own, axis=1)))]
            assert row["nearest_module"] == part.name
            assert row["nearest_maker"] == part.vendor
            assert float(row["nearest_mass_kg"]) == pytest.approx(part.mass, rel=1e-5)
            assert float(row["nearest_peak_torque_nm"]) == pytest.approx(part.peak_torque, rel=1e-5)
            assert row["nearest_source"] == part.source


@pytest.mark.parametrize("part", [part.name for part in catalogue().values()][::9])
def test_a_class_like_a_module_has_that_module(part: str) -> None:
    design = robot(actuators={"leg": {"like": part}}, allow=[]).resolve()
    assert rows(design)[0]["nearest_module"] == part


def test_a_servo_is_compared_with_servos() -> None:
    (row,) = (row for row in rows(built("hand", None).design) if row["kind"] == "actuator")
    assert (row["nearest_module"], row["nearest_maker"]) == ("XC330-M288", "ROBOTIS")


def test_a_module_of_the_robots_own_table_counts_with_its_text_as_written() -> None:
    files = _files(**{"mine.csv": MINE})
    files["parameters.yaml"] += "catalogue: mine.csv\n"
    design = draft.Spec.parse(files).resolve()
    row = rows(design)[0]
    assert (row["nearest_module"], row["nearest_maker"]) == ('S-40, "wide"', "Own & Sons")
    assert row["nearest_source"] == "data sheet, page 2"


def test_a_class_that_drives_nothing_has_no_row() -> None:
    actuators = {"leg": {"peak_torque": 60, "no_load_speed": 20}, "spare": {"like": "AK80-6"}}
    found = rows(robot(actuators=actuators).resolve())
    assert [row["name"] for row in found if row["kind"] == "actuator"] == ["leg"]


def test_of_equally_near_modules_the_first_is_taken() -> None:
    first, *others = catalogue().values()
    assert nearest(first.peak_torque, first.no_load_speed, [first, *others, first]) is first
