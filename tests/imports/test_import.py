"""A vendor's description becomes a spec that builds, with the vendor's axes and no vendor mass."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import draft
from draft.imports.ends import WHEEL_DENSITY
from draft.laws.structure import population
from tests.commands import printed
from tests.imports.written import CUBE, imported, joint, link, quadruped, translated, written


def test_a_quadruped_becomes_one_chain_and_four_uses() -> None:
    found = imported(quadruped())
    spec = found.spec
    assert spec.population == "quadruped"
    assert set(spec.actuators) == {"knee_drive", "abduction_flexion_drive"}
    assert Path("mine/tree.yaml").read_text(encoding="utf-8").count("chain: leg") == 4
    assert {body.name for body in spec.bodies} >= {"FL_thigh", "FR_thigh", "RL_thigh", "RR_thigh"}
    assert found.joints == {name: name for name in found.joints}
    assert len(found.joints) == 12


def test_an_import_builds_and_answers_to_its_lengths() -> None:
    spec = imported(quadruped()).spec
    assert spec.resolve().build().mujoco.njnt == 13
    assert spec.resolve({"thigh_length": 0.3}).mass > spec.resolve().mass


def test_reversed_axes_of_the_right_side_stay_reversed() -> None:
    model = imported(quadruped()).spec.resolve().build().mujoco
    for name, way in (("FL", 1), ("RL", 1), ("FR", -1), ("RR", -1)):
        assert model.joint(f"{name}_roll").axis == pytest.approx([way, 0, 0])
        assert model.joint(f"{name}_roll").range == pytest.approx([-1, 1.5])


def test_the_knee_is_driven_from_the_hip() -> None:
    design = imported(quadruped()).spec.resolve()
    thigh = next(body for body in design.bodies if body.name == "FL_thigh")
    assert thigh.link.motor is not None
    assert thigh.link.motor.actuator == "knee_drive"
    assert abs(float(thigh.link.motor.center[2])) < 1e-9


def test_without_meshes_only_the_box_of_mass_and_inertia_counts() -> None:
    before = translated(quadruped()).texts
    assert translated(quadruped(factor=3.7)).texts == before
    assert "trunk_length: {value: 0.4," in before["parameters.yaml"]


def test_with_meshes_no_inertial_counts_at_all() -> None:
    written(CUBE, "body.obj")
    text = quadruped(mesh="package://beast/body.obj")
    before = translated(text).texts
    assert "trunk_length: {value: 0.6," in before["parameters.yaml"]
    for old, new in (("<inertia ixx=", '<inertia ixx="9" a='), ('value="8.0"', 'value="0"')):
        assert translated(text.replace(old, new)).texts == before


def test_a_link_of_no_class_weighs_the_surveys_median_per_metre() -> None:
    mast = link("mast") + joint("pan", "body", "mast", (0.1, 0, 0.1), "0 0 1")
    design = imported(quadruped(mast)).spec.resolve()
    text = Path("mine/tree.yaml").read_text(encoding="utf-8")
    assert "length: end_length, segment: other}" in text
    assert " mass: " not in text
    per_metre = population("quadruped").segments["other"].coefficient
    mass = per_metre * float(design.parameters["end_length"])
    assert design.body_masses()["mast"] == pytest.approx(mass)


def test_a_wheel_weighs_its_volume_times_a_named_density() -> None:
    design = imported(quadruped().replace("_knee", "_wheel")).spec.resolve()
    radius, width = (float(design.parameters[f"wheel_{name}"]) for name in ("radius", "width"))
    mass = WHEEL_DENSITY * math.pi * radius**2 * width
    assert design.body_masses()["FL_calf"] == pytest.approx(mass)
    assert design.spec.parameters["wheel_density"].unit == "kg/m3"


def test_the_same_file_gives_the_same_spec() -> None:
    imported(quadruped(), out="one/mine")
    imported(quadruped(), out="two/mine")
    for name in ("parameters.yaml", "tree.yaml", "root.yaml", "import.json"):
        assert Path("one/mine", name).read_bytes() == Path("two/mine", name).read_bytes()


def test_a_passive_joint_is_held_and_counted() -> None:
    passive = 'effort="0" velocity="0"'
    tail = link("tail") + joint("wag", "body", "tail", (-0.3, 0, 0), limit=passive)
    found = imported(quadruped(tail))
    assert found.ignored["passive joints"] == 1
    report = json.loads((found.folder / "import.json").read_text(encoding="utf-8"))
    assert report["ignored"] == found.ignored
    assert "wag" not in report["joints"]


def test_the_command_says_what_it_made() -> None:
    written(quadruped())
    out = printed("import", "beast.urdf", "--out", "mine")
    assert "made mine: a quadruped with 12 joints and 2 actuator classes" in out
    printed("check", "mine")
    record = json.loads(printed("import", "beast.urdf", "--out", "other", "--json"))
    assert record["population"] == "quadruped"
    assert draft.load("mine").designs == {}
