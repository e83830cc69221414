"""An import's joints stand where MuJoCo's own compile of the maker's file has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft import load
from draft.description import description as descriptions
from draft.description import mjcf
from draft.description.description import Joint
from draft.description.xmlfile import DescriptionError, read_text
from tests.imports.written import imported, quadruped

INERTIAL = '<inertial pos="0 0 -.1" mass="1" diaginertia=".01 .01 .01"/>'
FOOT = '<geom type="sphere" size=".03" pos="0 0 -.25"/>'


def biped(hip: str = "", knee: str = "", head: str = "", thigh: str = "", shank: str = "") -> str:
    """A biped of two legs with attributes of its joints and bodies."""
    legs = "".join(
        f'<body name="{side}_thigh" pos="0 {y} 0" {thigh}>'
        f'<joint name="{side}_hip_pitch" axis="0 1 0" actuatorfrcrange="-40 40" {hip}/>{INERTIAL}'
        f'<body name="{side}_shank" pos="0 0 -.25" {shank}>'
        f'<joint name="{side}_knee_pitch" axis="0 1 0" actuatorfrcrange="-40 40" {knee}/>'
        f"{INERTIAL}{FOOT}</body></body>"
        for side, y in (("l", 0.1), ("r", -0.1))
    )
    return (
        f'<mujoco>{head}<worldbody><body name="trunk" pos="0 0 .5"><freejoint/>{INERTIAL}{legs}'
        "</body></worldbody></mujoco>"
    )


def foot_heights(model: mujoco.MjModel, joints: Mapping[str, str], sphere: str) -> list[float]:
    """Height of the feet below the trunk in three poses of hips and knees [m]."""
    data = mujoco.MjData(model)
    found: list[float] = []
    for hip, knee in ((0.0, -1.0), (0.7, -1.2), (-0.4, -2.0)):
        for side in "lr":
            data.joint(joints[f"{side}_hip_pitch"]).qpos[0] = hip
            data.joint(joints[f"{side}_knee_pitch"]).qpos[0] = knee
        mujoco.mj_kinematics(model, data)
        found += [
            float(data.geom_xpos[i][2] - data.xpos[1][2])
            for i in range(model.ngeom)
            if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_SPHERE
            and model.geom(i).name.endswith(sphere)
        ]
    return sorted(found)


# What places a joint in MJCF, each in a file that differs from the plain biped by it alone.
PLACED = {
    "ref in degrees": biped('ref="30" range="-60 90"', 'ref="-45" range="-164 -37"'),
    "ref in radians": biped(
        'ref="0.5" range="-1 1.5"',
        'ref="-0.8" range="-2.8 -0.6"',
        '<compiler angle="radian"/>',
    ),
    "ref of a joint beside its frame": biped(
        'ref="30" pos="0.02 0 0.03" range="-60 90"', 'ref="-45" pos="0 0 .01" range="-164 -37"'
    ),
    "ref and euler sequence": biped(
        'ref="20" range="-60 90"',
        'range="-164 -37"',
        '<compiler eulerseq="zyx"/>',
        'euler="0 10 20"',
        'euler="5 -10 0"',
    ),
    "fixed axes of an euler sequence": biped(
        'range="-60 90"',
        'range="-164 -37"',
        '<compiler eulerseq="XYZ"/>',
        'euler="10 10 20"',
    ),
    "range and ref of a default class": biped(
        'class="hip"',
        'class="knee"',
        '<default><joint damping="1"/><default class="leg"><joint ref="15"/>'
        '<default class="hip"><joint range="-60 90"/></default>'
        '<default class="knee"><joint ref="-45" range="-164 -37"/></default></default></default>',
    ),
    "the class of a frame": biped(
        'range="-60 90"', 'range="-164 -37"', '<default><default class="leg"/></default>'
    ).replace("<freejoint/>", '<freejoint/><frame pos="0.1 0 0.02" euler="0 0 20"/>'),
    "several worlds": biped('ref="30" range="-60 90"', 'ref="-45" range="-164 -37"').replace(
        "<worldbody>", '<worldbody><geom type="plane" size="1 1 1"/></worldbody><worldbody>'
    ),
    "a turned base": biped('range="-60 90"', 'range="-164 -37"').replace(
        'pos="0 0 .5"', 'pos="0 0 .5" euler="90 0 0"'
    ),
}


@pytest.mark.parametrize("name", PLACED)
def test_feet_are_where_mujoco_puts_them_at_the_same_joint_positions(
    name: str,
) -> None:
    found = imported(PLACED[name], "beast.xml")
    maker = mujoco.MjModel.from_xml_path("beast.xml")
    ours = load("mine").resolve().build().mujoco
    same = {joint: joint for joint in found.joints}
    assert np.allclose(
        foot_heights(maker, same, ""), foot_heights(ours, found.joints, "_end"), atol=2e-4
    )
    assert found.geometry.skipped == ""
    assert found.geometry.joints == 4


def test_a_urdf_is_held_against_mujocos_compile_too() -> None:
    found = imported(quadruped())
    assert (found.geometry.joints, found.geometry.poses, found.geometry.skipped) == (12, 20, "")
    assert 0 < found.geometry.distance < 1e-4


def test_a_reader_that_ignores_ref_is_caught_with_the_joints_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mjcf, "displaced", lambda joint, position: descriptions.displaced(joint, 0))
    with pytest.raises(DescriptionError) as caught:
        imported(PLACED["ref in degrees"], "beast.xml")
    words = "joint 'l_knee_pitch' is not where MuJoCo's compile of this file has it"
    assert words in str(caught.value)
    assert not Path("mine").exists()


@pytest.mark.parametrize("change", ["axis", "limits"])
def test_another_axis_or_limit_is_caught(change: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader off by little more than is allowed: 0.02 degrees."""
    off = 3.5e-4
    plain = mjcf._Reader._joint

    def wrong(self: mjcf._Reader, *given: object) -> Joint:
        joint = plain(self, *given)  # type: ignore[arg-type]  # Passed on as they came.
        if change == "axis":
            return replace(joint, axis=(off, np.sqrt(1 - off**2), 0.0))
        return joint if joint.limits is None else replace(joint, limits=(joint.limits[0] + off, 1))

    monkeypatch.setattr(mjcf._Reader, "_joint", wrong)
    with pytest.raises(DescriptionError, match=r"(axis|limit) off by 0\.0"):
        imported(biped('range="-60 57.29578"', 'range="-164 57.29578"'), "beast.xml")


def test_a_passive_joint_is_held_where_its_spring_or_its_limits_leave_it() -> None:
    driven = '_knee_pitch" axis="0 1 0" actuatorfrcrange="-40 40" range="-164 -37"/>'
    text = biped('range="-60 90"', 'range="-164 -37"')
    for side, given in (
        ("l", 'stiffness="5" springref="-40" range="-164 -37"'),
        ("r", 'range="-164 -50" ref="-45"'),
    ):
        assert side + driven in text
        text = text.replace(side + driven, f'{side}_knee_pitch" axis="0 1 0" {given}/>')
    held = {
        joint.name: np.degrees(joint.held_at)
        for joint in mjcf.from_xml(read_text(text, "b.xml")).moving
    }
    assert held["l_knee_pitch"] == pytest.approx(-40)
    assert held["r_knee_pitch"] == pytest.approx(-50)
    found = imported(text, "beast.xml")
    assert found.geometry.joints == 2
    assert found.geometry.skipped == ""


def test_a_file_that_mujoco_refuses_is_imported_and_not_checked() -> None:
    text = biped('range="-60 90"', 'range="-164 -37"')
    wrong = text.replace('<body name="r_shank"', '<body name="l_thigh2" wrong="1"')
    found = imported(wrong, "beast.xml")
    assert "MuJoCo does not compile its joints" in found.geometry.skipped
