"""A vendor's description becomes a spec that builds, with the vendor's axes and no vendor mass."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import draft
from draft.cli import main
from draft.imports.ends import WHEEL_DENSITY
from draft.imports.importer import import_robot, translate
from draft.laws.structure import population
from tests.imports.written import CUBE, joint, link, quadruped


@pytest.fixture
def vendor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A sound quadruped in the working directory."""
    monkeypatch.chdir(tmp_path)
    path = Path("beast.urdf")
    path.write_text(quadruped(), encoding="utf-8")
    return path


def test_a_quadruped_becomes_one_chain_and_four_uses(vendor: Path) -> None:
    found = import_robot(vendor, Path("mine"))
    spec = found.spec
    assert spec.population == "quadruped"
    assert set(spec.actuators) == {"knee_drive", "abduction_flexion_drive"}
    text = (found.folder / "tree.yaml").read_text(encoding="utf-8")
    assert text.count("chain: leg") == 4
    assert {body.name for body in spec.bodies} >= {"FL_thigh", "FR_thigh", "RL_thigh", "RR_thigh"}
    assert found.joints == {name: name for name in found.joints}
    assert len(found.joints) == 12


def test_an_import_builds_and_answers_to_its_lengths(vendor: Path) -> None:
    spec = import_robot(vendor, Path("mine")).spec
    model = spec.resolve().build().mujoco
    assert model.njnt == 13
    longer = spec.resolve({"thigh_length": 0.3})
    assert longer.mass > spec.resolve().mass


def test_reversed_axes_of_the_right_side_stay_reversed(vendor: Path) -> None:
    model = import_robot(vendor, Path("mine")).spec.resolve().build().mujoco
    for name in ("FL", "RL"):
        assert model.joint(f"{name}_roll").axis == pytest.approx([1, 0, 0])
    for name in ("FR", "RR"):
        assert model.joint(f"{name}_roll").axis == pytest.approx([-1, 0, 0])
        assert model.joint(f"{name}_roll").range == pytest.approx([-1, 1.5])


def test_the_knee_is_driven_from_the_hip(vendor: Path) -> None:
    design = import_robot(vendor, Path("mine")).spec.resolve()
    thigh = next(body for body in design.bodies if body.name == "FL_thigh")
    assert thigh.link.motor is not None
    assert thigh.link.motor.actuator == "knee_drive"
    assert abs(float(thigh.link.motor.center[2])) < 1e-9


def test_without_meshes_only_the_box_of_mass_and_inertia_counts(vendor: Path) -> None:
    before = translate(vendor, "beast").texts
    vendor.write_text(quadruped(factor=3.7), encoding="utf-8")
    assert translate(vendor, "beast").texts == before
    assert "trunk_length: {value: 0.4," in before["parameters.yaml"]


def test_with_meshes_no_inertial_counts_at_all(vendor: Path) -> None:
    Path("body.obj").write_text(CUBE, encoding="utf-8")
    text = quadruped(mesh="package://beast/body.obj")
    vendor.write_text(text, encoding="utf-8")
    before = translate(vendor, "beast").texts
    assert "trunk_length: {value: 0.6," in before["parameters.yaml"]
    vendor.write_text(text.replace("<inertia ixx=", '<inertia ixx="9" a='), encoding="utf-8")
    assert translate(vendor, "beast").texts == before
    vendor.write_text(text.replace('mass value="8.0"', 'mass value="0"'), encoding="utf-8")
    assert translate(vendor, "beast").texts == before


def test_a_link_of_no_class_weighs_the_surveys_median_per_metre(vendor: Path) -> None:
    mast = link("mast") + joint("pan", "body", "mast", (0.1, 0, 0.1), "0 0 1")
    vendor.write_text(quadruped(mast), encoding="utf-8")
    found = import_robot(vendor, Path("mine"))
    text = (found.folder / "tree.yaml").read_text(encoding="utf-8")
    assert "length: end_length, segment: other}" in text
    assert " mass: " not in text
    design = found.spec.resolve()
    per_metre = population("quadruped").segments["other"].coefficient
    mass = per_metre * float(design.parameters["end_length"])
    assert design.body_masses()["mast"] == pytest.approx(mass)


def test_a_wheel_weighs_its_volume_times_a_named_density(vendor: Path) -> None:
    vendor.write_text(quadruped().replace("_knee", "_wheel"), encoding="utf-8")
    design = import_robot(vendor, Path("wheeled")).spec.resolve()
    radius, width = (float(design.parameters[f"wheel_{name}"]) for name in ("radius", "width"))
    mass = WHEEL_DENSITY * math.pi * radius**2 * width
    assert design.body_masses()["FL_calf"] == pytest.approx(mass)
    assert design.spec.parameters["wheel_density"].unit == "kg/m3"


def test_the_same_file_gives_the_same_spec(vendor: Path) -> None:
    import_robot(vendor, Path("one/mine"))
    import_robot(vendor, Path("two/mine"))
    for name in ("parameters.yaml", "tree.yaml", "root.yaml", "import.json"):
        assert Path("one/mine", name).read_bytes() == Path("two/mine", name).read_bytes()


def test_a_passive_joint_is_held_and_counted(vendor: Path) -> None:
    more = link("tail") + joint(
        "wag", "body", "tail", (-0.3, 0, 0), limit='effort="0" velocity="0"'
    )
    vendor.write_text(quadruped(more), encoding="utf-8")
    found = import_robot(vendor, Path("mine"))
    assert found.ignored["passive joints"] == 1
    assert "beast.urdf:35: joint 'wag' declares an effort of 0" in str(found.notes[0])
    report = json.loads((found.folder / "import.json").read_text(encoding="utf-8"))
    assert report["ignored"] == found.ignored
    assert "wag" not in report["joints"]


def test_the_command_says_what_it_made(vendor: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", "beast.urdf", "--out", "mine"]) == 0
    out = capsys.readouterr().out
    assert "made mine: a quadruped with 12 joints and 2 actuator classes" in out
    assert main(["check", "mine"]) == 0
    capsys.readouterr()
    assert main(["import", "beast.urdf", "--out", "other", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["population"] == "quadruped"
    assert draft.load("mine").designs == {}


BAD = {
    "effort that is not a number": (
        link("rod") + joint("turn", "body", "rod", (0, 0, 0.1), limit='effort="nan"'),
        "beast.urdf:35: effort of joint 'turn' is not a number",
    ),
    "limit that is not a number": (
        link("rod") + joint("turn", "body", "rod", (0, 0, 0.1), limit='lower="nan" effort="1"'),
        'beast.urdf:35: lower="nan" of <limit> is not a finite number',
    ),
    "a name twice": (link("body"), "beast.urdf:35: link 'body' occurs twice"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_named_and_nothing_is_written(
    vendor: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    more, words = BAD[name]
    vendor.write_text(quadruped(more), encoding="utf-8")
    assert main(["import", "beast.urdf", "--out", "mine"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"error: {words}")
    assert [path.name for path in Path().iterdir()] == ["beast.urdf"]


def test_a_folder_that_exists_is_kept(vendor: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("mine").mkdir()
    assert main(["import", "beast.urdf", "--out", "mine"]) == 2
    assert "'mine' exists; it is kept" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        ("package://beast/none.stl", "beast.urdf:2: mesh 'package://beast/none.stl' is missing"),
        ("../../secret.stl", "mesh '../../secret.stl' leads outside the robot's folder"),
        ("/etc/hostname.stl", "mesh '/etc/hostname.stl' leads outside the robot's folder"),
        ("broken.stl", "mesh 'broken.stl' cannot be read: it is not an STL file"),
        ("body.dae", "mesh 'body.dae' cannot be read: it has no finite triangles"),
        ("body.glb", "mesh 'body.glb' cannot be read: '.glb' is not read"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_a_warning(vendor: Path, mesh: str, words: str) -> None:
    Path("broken.stl").write_text("no mesh", encoding="utf-8")
    Path("body.dae").write_text("<COLLADA/>", encoding="utf-8")
    Path("body.glb").write_bytes(b"glTF")
    vendor.write_text(quadruped(mesh=mesh), encoding="utf-8")
    found = import_robot(vendor, Path("mine"))
    assert any(words in str(note) for note in found.notes)
    assert any("the box with its inertia stands in" in str(note) for note in found.notes)


@pytest.mark.parametrize(
    ("limit", "span"),
    [('lower="0" upper="0"', 6.2832), ('lower="-1e9" upper="1e9"', 6.2832)],
)
def test_a_range_that_cannot_be_becomes_a_turn(vendor: Path, limit: str, span: float) -> None:
    text = quadruped().replace('lower="-1" upper="1.5"', limit)
    vendor.write_text(text, encoding="utf-8")
    model = import_robot(vendor, Path("mine")).spec.resolve().build().mujoco
    assert model.joint("FL_roll").range == pytest.approx([-span, span], abs=1e-4)
