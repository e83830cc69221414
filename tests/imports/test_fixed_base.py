"""Arms and hands are imported on a fixed base, with links and actuators of their own families."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

import draft
from draft.imports.importer import import_robot
from draft.imports.options import Options
from draft.laws.catalogue import MODULE, SERVO
from tests import fixed
from tests.commands import Command

ODD = Path(__file__).parents[2].parent / "shared/robots/odd"
BASE = '<inertial><mass value="{mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
BOX = '<visual><geometry><box size="0.1 0.1 0.2"/></geometry></visual>'
LINK = '<link name="{name}"><inertial><mass value="0.1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
LINK += 'ixz="0" iyz="0"/></inertial></link>'
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{at}"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="{effort}" velocity="5"/>
</joint>"""


def urdf(folder: Path, limbs: int, effort: float, length: float) -> Path:
    """A base of 4 kg, 0.2 m high about its origin, with limbs of three joints upwards."""
    parts = [f'<link name="base">{BASE.format(mass=4)}</inertial>{BOX}</link>']
    for i in range(limbs):
        parent, at = "base", f"0 {0.1 * i} 0.1"
        for k in range(3):
            name = f"limb{i}_{k}"
            parts.append(LINK.format(name=name))
            joint = {
                "name": f"{name}_joint",
                "parent": parent,
                "child": name,
                "effort": effort / (1 + 2 * k),
            }
            parts.append(JOINT.format(**joint, at=at))
            parent, at = name, f"0 0 {length}"
    file = folder / "machine.urdf"
    file.write_text(f'<robot name="machine">{"".join(parts)}</robot>', encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("limbs", "effort", "length", "segment", "kind"),
    [
        (1, 60, 0.3, "cobot_link", MODULE),
        (1, 3, 0.1, "light_link", SERVO),
        (3, 1, 0.04, "finger", SERVO),
        (2, 60, 0.3, "cobot_link", MODULE),
    ],
    ids=["cobot", "servo arm", "hand", "two arms"],
)
def test_a_machine_without_legs_is_imported_on_a_fixed_base(
    limbs: int, effort: float, length: float, segment: str, kind: str, tmp_path: Path
) -> None:
    file = urdf(tmp_path, limbs, effort, length)
    found = import_robot(file, tmp_path / "out")
    design = found.spec.resolve()
    assert not design.floating
    assert "root.yaml" not in found.spec.files
    assert {one.trend for one in design.segments} <= {segment}
    assert {one.kind or MODULE for one in found.spec.actuators.values()} == {kind}
    model = design.build().mujoco
    assert model.nq == model.nv == 3 * limbs
    assert found.geometry.joints == 3 * limbs
    assert float(design.base_mass) == pytest.approx(4.0)  # The maker's: no law predicts it.
    # The maker's base reaches 0.1 m below its origin, which is raised so far above the floor.
    assert model.body("base").pos[2] == pytest.approx(0.1)
    assert not {"neck", "head"} & {
        word for name in found.spec.actuators for word in name.split("_")
    }
    said = [note.cause for note in found.notes if "fixed base" in note.cause]
    assert said
    assert segment in said[0]


def test_servos_of_an_import_lie_along_their_links_and_away_from_the_first(tmp_path: Path) -> None:
    """A limb upwards: the box in the base points down, and others back along their links."""
    found = import_robot(urdf(tmp_path, 3, 1, 0.04), tmp_path / "out")
    design = found.spec.resolve()
    boxes = {body.name: geom for body in design.bodies if (geom := body.motor_geom) is not None}
    assert len(boxes) == 9
    for body in design.bodies:
        geom = boxes.get(body.name)
        if geom is None:
            continue
        assert geom.form == "box"
        assert float(geom.center[2]) < float(body.link.tip[2])
    assert "long: -z" in (tmp_path / "out" / "tree.yaml").read_text(encoding="utf-8")
    import_robot(urdf(tmp_path, 1, 60, 0.3), tmp_path / "modules")
    assert "long" not in (tmp_path / "modules" / "tree.yaml").read_text(encoding="utf-8")


def test_the_pedestal_is_the_box_of_the_makers_base(tmp_path: Path) -> None:
    file = urdf(tmp_path, 1, 60, 0.3)
    beside = file.read_text().replace("<visual>", '<visual><origin xyz="0.2 -0.1 0.05"/>')
    file.write_text(beside, encoding="utf-8")
    model = import_robot(file, tmp_path / "out").spec.resolve().build().mujoco
    solid = model.geom("base_pedestal")
    assert solid.size == pytest.approx((0.05, 0.05, 0.1))
    assert solid.pos == pytest.approx((0.2, -0.1, 0.05))  # From its base, as in the file.


def test_the_twin_of_a_spec_on_a_fixed_base_is_on_one(tmp_path: Path) -> None:
    file = urdf(tmp_path, 1, 60, 0.3)
    found = import_robot(file, tmp_path / "out")
    twin = draft.compare_twin(file, found.spec, poses=2)
    assert twin.files.fixed
    assert max(pair.anchor_gap for pair in twin.links) < 1e-6  # The base stands 0.1 m higher.
    assert max(pair.axis_gap for pair in twin.links) < 1e-6
    assert twin.expected.wider == ("few arms and hands are known by their links",)


def test_a_population_that_is_named_makes_it_a_robot_with_a_trunk(tmp_path: Path) -> None:
    found = import_robot(urdf(tmp_path, 1, 60, 0.3), tmp_path / "out", population="humanoid")
    assert found.spec.resolve().floating


def test_the_command_says_what_machine_it_made(tmp_path: Path, command: Command) -> None:
    said = command(f"import {urdf(tmp_path, 1, 60, 0.3)} --out", tmp_path / "out").out
    assert "a fixed arm with 3 joints" in said
    assert "machine: on a fixed base" in said
    assert "trunk" not in said.split("made ")[1]


def test_the_twin_of_an_arm_is_held_by_its_base(tmp_path: Path) -> None:
    """An exported arm against its own import: M(q) by the same dynamics of another model."""
    vendor = draft.export(fixed.arm().resolve(), tmp_path / "vendor") / "robot.urdf"
    found = draft.compare_twin(vendor, poses=10)
    assert len(found.joints) == 6
    assert not found.unmatched
    assert math.isfinite(found.inertia.median)
    assert max(pair.anchor_gap for pair in found.links) < 1e-4
    assert found.vendor_mass == pytest.approx(float(fixed.arm().resolve().mass), rel=1e-6)
    assert found.mass_ratio == pytest.approx(1.0, abs=0.6)


@pytest.mark.skipif(not ODD.is_dir(), reason="needs the gathered robots")
def test_a_collaborative_arm_is_near_its_mass_by_its_maker(tmp_path: Path) -> None:
    found = import_robot(ODD / "universal_robots_ur5e/ur5e.xml", tmp_path / "ur5e")
    design = found.spec.resolve()
    maker = mujoco.MjSpec.from_file(str(ODD / "universal_robots_ur5e/ur5e.xml"))
    mass = sum(body.mass for body in maker.bodies)
    assert 1 / 1.35 < float(design.mass) / mass < 1.35
    assert np.isclose(float(design.base_mass), 4.0)


TWO = """<mujoco model="cell"><worldbody>
<body name="left" pos="0 1 0"><geom type="box" size="0.1 0.1 0.1"/>{left}</body>
<body name="right" pos="0 -1 0" euler="0 0 90"><geom type="box" size="0.1 0.1 0.1"/>{right}</body>
</worldbody></mujoco>"""
ARM = """<body name="{0}_upper" pos="0 0 0.1"><joint name="{0}_lift" axis="0 1 0" range="-90 90"/>
<geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.3"/>
<body name="{0}_fore" pos="0 0 0.3"><joint name="{0}_bend" axis="0 1 0" range="-90 90"/>
<geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.3"/></body></body>"""


def cell(folder: Path) -> Path:
    """Two equal arms on the world."""
    file = folder / "cell.xml"
    text = TWO.format(left=ARM.format("left"), right=ARM.format("right"))
    file.write_text(text, encoding="utf-8")
    return file


def test_one_of_several_robots_of_a_file_is_imported_by_its_body(
    tmp_path: Path, command: Command
) -> None:
    said = command.refuses("import", cell(tmp_path), "--out", str(tmp_path / "none"))
    assert "2 bodies on the world: left, right" in said
    assert "--root" in said
    said = command(
        f"import {cell(tmp_path)} --root right --torque 30 --out", tmp_path / "right"
    ).err
    design = draft.load(tmp_path / "right").resolve()
    assert list(design.joints) == ["right_lift", "right_bend"]
    assert not design.floating
    assert "no picture" not in said


@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_a_limb_of_a_robot_is_imported_by_the_link_that_carries_it(
    kind: str, tmp_path: Path
) -> None:
    """The upper arm stays where it is, and what is above it is left out."""
    folder = draft.export(fixed.arm().resolve(), tmp_path / "maker", [kind])
    file = next(folder.glob("*.urdf" if kind == "urdf" else "*.xml"))
    found = import_robot(file, tmp_path / "out", options=Options(root="upper_arm"))
    assert list(found.joints) == ["elbow", "pitch", "roll", "yaw"]
    assert found.geometry.joints == 4
    assert found.geometry.distance < 1e-6
    twin = draft.compare_twin(file, poses=5, options=Options(root="upper_arm"))
    assert len(twin.joints) == 4


def test_a_root_that_the_file_does_not_have_is_named(tmp_path: Path, command: Command) -> None:
    said = command.refuses("import", cell(tmp_path), "--root", "rihgt_upper")
    assert "no link 'rihgt_upper'" in said or "2 bodies" in said
    folder = draft.export(fixed.arm().resolve(), tmp_path / "maker", ["urdf"])
    said = command.refuses("import", folder / "robot.urdf", "--root", "uper_arm")
    assert "it has no link 'uper_arm'" in said
    assert "did you mean 'upper_arm'?" in said
