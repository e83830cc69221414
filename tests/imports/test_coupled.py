"""Joints that follow others in a description: mimic joints of URDF, equalities of MJCF."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from draft.description.read import describe
from draft.description.xmlfile import DescriptionError
from draft.imports.importer import Imported, import_robot
from draft.imports.options import Options
from draft.values import scalar
from tests.commands import Command
from tests.imports.test_fixed_base import BASE, BOX, LINK

SURVEY = Path(__file__).parents[2].parent / "shared/robots/survey"
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{name}_link"/>
<origin xyz="{at}" rpy="{rpy}"/><axis xyz="{axis}"/>
<limit lower="0" upper="1.5" effort="1" velocity="5"/>{mimic}</joint>"""
NEAR = '<mimic joint="{finger}_a" multiplier="0.8" offset="0.05"/>'


def gripper(
    folder: Path, mimics: dict[str, str] | None = None, rpy: str = "0 0 0", arm: str = ""
) -> Path:
    """A palm with three fingers of two joints, of which the second mimics the first.

    Args:
        folder: folder of the file.
        mimics: other text of `mimic` by joint.
        rpy: turn of the palm in what carries it.
        arm: name of a link that carries the palm on a joint; "" for none.
    """
    parts = [f'<link name="palm">{BASE.format(mass=0.5)}</inertial>{BOX}</link>']
    if arm:
        parts += [
            LINK.format(name=arm),
            JOINT.format(
                name="wrist", parent=arm, at="0.1 0.2 0.3", rpy=rpy, axis="0 0 1", mimic=""
            ).replace("wrist_link", "palm"),
        ]
    for i, finger in enumerate(("left", "middle", "right")):
        parent, at = "palm", f"{0.05 * i} 0 0.1"
        for k in "ab":
            name = f"{finger}_{k}"
            mimic = NEAR.format(finger=finger) if k == "b" else ""
            mimic = (mimics or {}).get(name, mimic)
            axis = "0 1 0" if i < 2 else "0 -1 0"
            joint = {"name": name, "parent": parent, "at": at, "rpy": "0 0 0", "axis": axis}
            parts += [LINK.format(name=f"{name}_link"), JOINT.format(**joint, mimic=mimic)]
            parent, at = f"{name}_link", "0 0 0.05"
    file = folder / "gripper.urdf"
    file.write_text(f'<robot name="gripper">{"".join(parts)}</robot>', encoding="utf-8")
    return file


def couplings(found: Imported) -> dict[str, tuple[str, float, float]]:
    """Leader, ratio and offset of each joint that follows another, by the maker's names."""
    theirs = {ours: theirs for theirs, ours in found.joints.items()}
    return {
        theirs[name]: (theirs[f.joint], scalar(f.ratio), scalar(f.offset))
        for name, joint in found.spec.resolve().joints.items()
        if (f := joint.follows) is not None
    }


def test_mimic_joints_of_a_hand_follow_those_of_their_finger(tmp_path: Path) -> None:
    found = import_robot(gripper(tmp_path), tmp_path / "out")
    fingers = ("left", "middle", "right")
    assert couplings(found) == {f"{x}_b": (f"{x}_a", 0.8, 0.05) for x in fingers}
    assert found.geometry.joints == 6
    design = found.spec.resolve()
    drives = [design.drive(joint) for joint in design.joints.values()]
    assert sum(one is not None for one in drives) == 3
    assert design.build().mujoco.neq == 3
    assert {name.split("_")[0] for name in found.spec.actuators} == {"finger"}


def test_a_joint_follows_one_of_another_finger_and_a_chain_of_them(tmp_path: Path) -> None:
    mimics = {
        "right_a": '<mimic joint="left_a" multiplier="-1"/>',
        "right_b": '<mimic joint="right_a" multiplier="0.5" offset="0.2"/>',
    }
    found = import_robot(gripper(tmp_path, mimics), tmp_path / "out")
    follows = couplings(found)
    assert follows["right_a"] == ("left_a", -1.0, 0.0)
    assert follows["right_b"] == ("left_a", -0.5, 0.2)
    assert follows["left_b"] == ("left_a", 0.8, 0.05)


def test_what_follows_a_joint_that_is_held_is_held_too(tmp_path: Path) -> None:
    file = gripper(tmp_path)
    text = file.read_text().replace('name="left_a" type="revolute"', 'name="left_a" type="fixed"')
    file.write_text(text, encoding="utf-8")
    found = import_robot(file, tmp_path / "out")
    assert set(couplings(found)) == {"middle_b", "right_b"}


def test_a_hand_below_a_turned_wrist_is_imported_from_its_own_file(tmp_path: Path) -> None:
    file = gripper(tmp_path, rpy="0.4 -0.9 2.0", arm="forearm")
    found = import_robot(file, tmp_path / "out", options=Options(root="palm"))
    assert found.geometry.joints == 6
    assert len(couplings(found)) == 3


@pytest.mark.parametrize(
    ("polynomial", "driven", "expected"),
    [
        ('polycoef="0.1 0.5 0 0 0"', "first", ("second", "first", 0.5, 0.1)),
        ('polycoef="0.1 0.5 0 0 0"', "second", ("first", "second", 2.0, -0.2)),
        ("", "first", ("second", "first", 1.0, 0.0)),
        ('polycoef="0 1 0.3 0 0"', "first", ("second", "first", 0.0, 0.0)),
    ],
)
def test_an_equality_of_mjcf_couples_the_joint_without_an_actuator(
    polynomial: str, driven: str, expected: tuple[str, str, float, float], tmp_path: Path
) -> None:
    file = tmp_path / "pair.xml"
    file.write_text(
        f"""<mujoco><worldbody><body name="a"><geom size="0.1"/><body name="b"><joint name="first"/>
        <geom size="0.1"/><body name="c"><joint name="second"/><geom size="0.1"/></body></body>
        </body></worldbody><equality><joint joint1="second" joint2="first" {polynomial}/></equality>
        <actuator><motor joint="{driven}"/></actuator></mujoco>""",
        encoding="utf-8",
    )
    joints = describe(file).joints
    follower, leader, ratio, offset = expected
    one = joints[follower]
    assert (one.mimics, one.ratio) == (leader, pytest.approx(ratio))
    assert one.offset == pytest.approx(offset)
    assert joints[leader].mimics is None


GRIPPER = """<mujoco model="gripper"><worldbody><body name="palm">
<geom type="box" size="0.05 0.05 0.05"/>
<body name="left" pos="0 0.04 0.1"><joint name="left" axis="1 0 0" range="0 1"/>
<geom type="box" size="0.01 0.01 0.04" pos="0 0 0.04"/></body>
<body name="right" pos="0 -0.04 0.1"><joint name="right" axis="-1 0 0" range="0 1"/>
<geom type="box" size="0.01 0.01 0.04" pos="0 0 0.04"/></body></body></worldbody>
<tendon><fixed name="split"><joint joint="left" coef="0.5"/>
<joint joint="right" coef="{coef}"/></fixed></tendon>{equality}<actuator>
<general name="grip" tendon="split" forcerange="-6 6" ctrlrange="0 1"/></actuator></mujoco>"""
SAME = '<equality><joint joint1="right" joint2="left"/></equality>'


@pytest.mark.parametrize(
    ("coefficient", "equality", "ratio", "effort"),
    [(0.5, SAME, 1.0, 6.0), (0.5, "", 1.0, 6.0), (0.25, "", 0.5, 3.75)],
    ids=["coupled by an equality", "by the tendon alone", "by unlike coefficients"],
)
def test_one_drive_of_a_tendon_moves_both_fingers(
    coefficient: float, equality: str, ratio: float, effort: float, tmp_path: Path
) -> None:
    file = tmp_path / "gripper.xml"
    file.write_text(GRIPPER.format(coef=coefficient, equality=equality), encoding="utf-8")
    found = import_robot(file, tmp_path / "out")
    assert couplings(found) == {"right": ("left", ratio, 0.0)}
    design = found.spec.resolve()
    (drive,) = (one for one in map(design.drive, design.joints.values()) if one is not None)
    assert drive.peak_torque == pytest.approx(effort)


def test_the_work_of_a_tendon_is_that_of_mujoco(tmp_path: Path) -> None:
    """Torque of the drive at its joint against the moment arm of MuJoCo's tendon."""
    text = GRIPPER.format(coef=0.25, equality="")
    (tmp_path / "gripper.xml").write_text(text, encoding="utf-8")
    left = describe(tmp_path / "gripper.xml").joints["left"]
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    lengths = []
    for angle in (0.0, 0.5):
        data.qpos[:] = angle, 0.5 * angle  # The right joint has half the coefficient.
        mujoco.mj_forward(model, data)
        lengths.append(float(data.ten_length[0]))
    assert left.effort == pytest.approx(6.0 * (lengths[1] - lengths[0]) / 0.5)


def test_a_multiplier_that_is_no_number_is_named_with_its_line(tmp_path: Path) -> None:
    mimics = {"left_b": '<mimic joint="left_a" multiplier="twice"/>'}
    with pytest.raises(DescriptionError) as error:
        import_robot(gripper(tmp_path, mimics), tmp_path / "out")
    problem = error.value.problems[0]
    assert problem.cause == 'multiplier="twice" of <mimic> is not a finite number'
    assert problem.where is not None
    assert problem.where.line


@pytest.mark.parametrize("leader", ["left_b", "right_b"])
def test_joints_that_mimic_each_other_are_held(leader: str, tmp_path: Path) -> None:
    mimics = {"left_b": f'<mimic joint="{leader}"/>', "right_b": '<mimic joint="left_b"/>'}
    found = import_robot(gripper(tmp_path, mimics), tmp_path / "out")
    assert {*found.joints} == {"left_a", "middle_a", "middle_b", "right_a"}


@pytest.mark.skipif(not SURVEY.is_dir(), reason="needs the gathered robots")
def test_a_hand_of_six_drives_is_imported_with_the_joints_that_follow(tmp_path: Path) -> None:
    options = Options(root="R_hand_base_link")
    found = import_robot(SURVEY / "h1_2.urdf", tmp_path / "hand", options=options)
    follows = couplings(found)
    assert len(found.joints) == 12
    assert follows["R_thumb_distal_joint"] == ("R_thumb_proximal_pitch_joint", 2.4, 0.0)
    assert len(follows) == 6
    assert found.geometry.joints == 12


def test_a_gripper_on_an_arm_keeps_its_fingers_with_their_own_links(tmp_path: Path) -> None:
    file = gripper(tmp_path, arm="forearm")
    found = import_robot(file, tmp_path / "out")
    design = found.spec.resolve()
    assert len(design.joints) == 7
    assert len(couplings(found)) == 3
    assert {one.kind for one in design.segments} == {"finger", "light_link"}


def test_the_command_counts_the_joints_that_follow(tmp_path: Path, command: Command) -> None:
    said = command(f"import {gripper(tmp_path)} --out", tmp_path / "out").out
    assert "joints: 3 driven hinges, 3 joints that follow them; none held" in said
