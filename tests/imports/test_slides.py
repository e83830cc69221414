"""Prismatic joints of a vendor's robot stay where they were, as slides that nothing drives."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.description.read import describe
from draft.description.xmlfile import DescriptionError
from draft.imports.importer import Imported
from draft.spec import Spec
from draft.twins.vendor import vendor_model
from tests.imports.written import LEGS, imported, joint, link, notes, quadruped, written
from tests.twins.test_vendors import misplaced

STROKE = 'lower="0" upper="0.12" effort="2500" velocity="0.5"'
DRIVES = "drives of prismatic joints"


def kinds(spec: Spec) -> dict[str, str | None]:
    """Structural class of each body with a member."""
    found = {body.name: body.link.member for body in spec.bodies}
    return {name: member.fields.segment for name, member in found.items() if member is not None}


def stands(found: Imported) -> bool:
    """Whether hinges and slides are where the vendor has them."""
    gap, angle = misplaced(found, describe(Path("beast.urdf")))
    return gap < 1e-4 and angle < 1e-3


def telescopic(
    at: float = -0.1, axis: str = "0 0 1", name: str = "calf", foot: float = -0.11
) -> str:
    """The quadruped, with a slide in every shank or thigh; right axes may point the other way."""
    text = quadruped()
    for leg, (_, y) in LEGS.items():
        rod, part = f"{leg}_rod", f"{leg}_{name}"
        way = axis if y > 0 else axis.replace("0 1 0", "0 -1 0")
        slide = joint(f"{leg}_piston", part, rod, (0, 0, at), way, STROKE, "prismatic")
        text = text.replace(f'parent link="{part}"', f'parent link="{rod}"')
        if name == "thigh":
            text = text.replace('xyz="0 0 -0.22"', f'xyz="0 0 {-0.22 - at:g}"')
        text = text.replace("</robot>", link(rod) + "\n" + slide + "\n</robot>")
    return text.replace('xyz="0 0 -0.21"', f'xyz="0 0 {foot:g}"')


def test_a_slide_in_a_shank_is_part_of_it() -> None:
    found = imported(telescopic())
    design = found.spec.resolve()
    assert len(found.joints) == 16
    pistons = {name: one for name, one in design.joints.items() if name.endswith("piston")}
    assert len(pistons) == 4
    assert all(one.slide and one.actuator is None for one in pistons.values())
    assert all(one.range == (0.0, 0.12) for one in pistons.values())
    own = kinds(found.spec)
    assert (own["FL_calf"], own["FL_rod"]) == ("shank", "shank")
    text = Path("mine/tree.yaml").read_text(encoding="utf-8")
    assert text.count("chain: leg") == 4
    assert "segment: thigh" in text
    assert set(found.spec.actuators) == {"knee_drive", "abduction_flexion_drive"}
    assert stands(found)


def test_the_drive_is_left_out_counted_and_named() -> None:
    found = imported(telescopic())
    assert found.ignored[DRIVES] == 4
    (told,) = notes(found, "prismatic")
    assert all(f"'{leg}_piston'" in told for leg in LEGS)
    assert told.startswith("beast.urdf:37: prismatic joint 'FL_piston' is kept without its")
    assert "this one weighs nothing" in told
    report = json.loads((found.folder / "import.json").read_text(encoding="utf-8"))
    assert report["ignored"][DRIVES] == 4
    assert report["joints"]["RR_piston"] == "RR_piston"


def test_a_slide_in_a_thigh_leaves_hip_and_knee_what_they_are() -> None:
    found = imported(telescopic(name="thigh", foot=-0.21))
    assert found.spec.population == "quadruped"
    own = kinds(found.spec)
    assert (own["FL_thigh"], own["FL_rod"], own["FL_calf"]) == ("thigh", "thigh", "shank")
    # A drive at the hip cannot reach a knee that slides away from it.
    rod = next(body for body in found.spec.bodies if body.name == "FL_rod")
    assert rod.link.motor is not None
    assert stands(found)
    assert found.spec.resolve().build().mujoco.njnt == 17


@pytest.mark.parametrize("name", ["thigh", "calf"])
def test_mirrored_legs_share_a_chain_whichever_way_their_slides_point(name: str) -> None:
    found = imported(telescopic(axis="0 1 0", name=name))
    assert Path("mine/tree.yaml").read_text(encoding="utf-8").count("chain: leg") == 4
    model = found.spec.resolve().build().mujoco
    assert model.joint("FL_piston").axis == pytest.approx([0, 1, 0])
    assert model.joint("FR_piston").axis == pytest.approx([0, -1, 0])
    assert model.joint("FR_piston").range == pytest.approx([0, 0.12])


def test_a_slide_is_no_copy_of_a_hinge() -> None:
    text = telescopic()
    turning = text.replace('name="RL_piston" type="prismatic"', 'name="RL_piston" type="revolute"')
    turning = turning.replace('effort="2500"', 'effort="25"')
    found = imported(turning)
    assert found.ignored[DRIVES] == 3
    chains = (found.folder / "tree.yaml").read_text(encoding="utf-8")
    assert chains.count("chain: leg,") + chains.count("chain: leg\n") < 4


def test_a_slide_without_a_place_of_its_own_divides_its_member() -> None:
    found = imported(telescopic(at=0.0, name="thigh", foot=-0.21))
    design = found.spec.resolve()
    bodies = {body.name: body for body in design.bodies}
    assert bodies["FL_rod"].position == pytest.approx((0, 0, -0.11))
    assert bodies["FL_calf"].position == pytest.approx((0, 0, -0.11))
    gap, _ = misplaced(found, describe(Path("beast.urdf")))
    assert gap == pytest.approx(0.11)  # of the slide's frame; the knees are where they were
    model = design.build().mujoco
    assert model.body("FL_thigh").mass > 0


def test_a_slide_at_its_knee_divides_the_way_to_the_foot() -> None:
    design = imported(telescopic(at=0.0, foot=-0.2)).spec.resolve()
    lengths = [s.length for s in design.segments if s.kind == "shank"]
    assert lengths == pytest.approx([0.1, 0.1])
    assert float(design.lowest()) == pytest.approx(0.42, abs=0.05)


def test_a_slide_with_no_member_to_divide_is_an_error_with_its_line() -> None:
    with pytest.raises(DescriptionError) as caught:
        imported(telescopic(at=-0.01, foot=-0.02))
    words = "beast.urdf:37: prismatic joint 'FL_piston' begins where the joint above it does"
    assert str(caught.value).startswith(words)
    assert not Path("mine").exists()


def test_a_slide_on_the_trunk_carries_what_hangs_on_it() -> None:
    arm = link("sled") + link("arm") + link("paw")
    arm += joint("rail", "body", "sled", (0, 0, 0.1), "1 0 0", STROKE, "prismatic")
    arm += joint("swing", "sled", "arm", (0, 0, 0.1)) + joint("bend", "arm", "paw", (0.3, 0, 0))
    found = imported(quadruped(arm))
    model = found.spec.resolve().build().mujoco
    assert model.joint("rail").axis == pytest.approx([1, 0, 0])
    assert model.njnt == 16
    assert kinds(found.spec)["sled"] == "other"
    assert stands(found)


def on_body(name: str, limit: str) -> Imported:
    """The quadruped with a slide on its trunk."""
    slide = joint(name, "body", "rod", (0, 0, 0.1), "0 0 1", limit, "prismatic")
    return imported(quadruped(link("rod") + slide))


@pytest.mark.parametrize(
    ("limit", "said"),
    [
        ('effort="9"', "the range [0, 0]"),
        ('lower="0" upper="0" effort="9"', "the range [0, 0]"),
        ('lower="0.2" upper="-0.2" effort="9"', "the range [0.2, -0.2]"),
        ('lower="-1e9" upper="1e9" effort="9"', "the range [-1e+09, 1e+09]"),
        ('lower="0" upper="0.0005" effort="9"', "the range [0, 0.0005]"),
    ],
)
def test_a_stroke_that_cannot_be_is_held_at_zero_and_named(limit: str, said: str) -> None:
    found = on_body("slide", limit)
    assert found.ignored["prismatic joints"] == 1
    assert "slide" not in found.joints
    words = f"beast.urdf:35: prismatic joint 'slide' has {said}: it is held at zero"
    assert any(note.startswith(words) for note in notes(found))


def test_a_slide_of_an_mjcf_without_a_range_is_held() -> None:
    text = """<mujoco model="hopper"><compiler angle="radian"/><worldbody><body name="trunk">
    <freejoint/><geom type="box" size="0.2 0.1 0.05" mass="8"/>
    <body name="thigh" pos="0 0 -0.1"><joint name="hip" axis="0 1 0" range="-1 1"/>
    <geom type="capsule" size="0.02 0.1" mass="1"/>
    <body name="rod" pos="0 0 -0.2"><joint name="rod" type="slide" axis="0 0 1" RANGE/>
    <geom type="sphere" size="0.03" mass="0.2"/></body></body></body></worldbody>
    <actuator><motor joint="hip" ctrlrange="-20 20"/><motor joint="rod" ctrlrange="-90 90"/>
    </actuator></mujoco>"""
    found = imported(text.replace("RANGE", 'range="-0.05 0.05"'), "hopper.xml")
    assert found.spec.resolve().joints["rod"].range == (-0.05, 0.05)
    free = imported(text.replace("RANGE", ""), "free.xml", "free")
    assert free.ignored["prismatic joints"] == 1
    assert "free.xml:5: prismatic joint 'rod' has no range: it is held" in str(free.notes[0])


@pytest.mark.parametrize(
    ("name", "limit", "kind"),
    [
        ("slide", 'lower="0" upper="0.1"', "passive joints"),
        ("slide", 'lower="0" upper="0.1" effort="0"', "passive joints"),
        ("gripper_slide", STROKE, "finger joints"),
    ],
)
def test_slides_of_grippers_and_without_effort_stay_held(name: str, limit: str, kind: str) -> None:
    found = on_body(name, limit)
    assert found.ignored[kind] == 1
    assert DRIVES not in found.ignored
    assert name not in found.joints


def test_the_vendors_own_model_slides_too() -> None:
    model = vendor_model(describe(written(telescopic())), ["FL_knee", "FL_piston"])
    assert model.joint("FL_piston").type[0] == mujoco.mjtJoint.mjJNT_SLIDE
    assert model.joint("FL_knee").type[0] == mujoco.mjtJoint.mjJNT_HINGE


def test_slides_alone_make_no_robot() -> None:
    text = link("body") + link("rod")
    text += joint("slide", "body", "rod", (0, 0, 0.1), "0 0 1", STROKE, "prismatic")
    with pytest.raises(DescriptionError, match="it has no hinges"):
        imported(f'<robot name="press">{text}</robot>')


def test_a_home_inside_the_stroke_is_taken() -> None:
    found = imported(telescopic().replace('lower="0" upper="0.12"', 'lower="0.02" upper="0.12"'))
    joints = found.spec.resolve().joints
    assert np.array([joints["FL_piston"].home, joints["RR_piston"].home]) == pytest.approx(0.02)
