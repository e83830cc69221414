"""URDF and MJCF say the same robot, without their meshes, and MuJoCo agrees on its masses."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.description import mjcf, urdf
from draft.description.description import Description, Inertial
from draft.description.read import describe
from draft.description.rigid import box, combined, moved
from draft.description.segments import Segment, segments
from draft.description.xmlfile import DescriptionError, read_text
from tests.description import written
from tests.description.written import joint, link

numbers = st.floats(-1.0, 1.0)
points = st.tuples(numbers, numbers, numbers)


def _urdf(text: str) -> Description:
    return urdf.from_xml(read_text(text, "robot.urdf"))


def _mjcf(text: str) -> Description:
    return mjcf.from_xml(read_text(text, "robot.xml"))


def test_a_urdf_keeps_what_an_importer_needs() -> None:
    text = written.urdf(
        '<link name="base"><visual><origin xyz="0 0 1"/><geometry>'
        '<mesh filename="meshes/base.stl" scale="0.001 0.001 0.001"/></geometry></visual>'
        '<collision><geometry><cylinder radius="0.1" length="0.3"/></geometry></collision></link>'
        + link("arm")
        + "\n"
        + '<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>'
        '<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 2"/>'
        '<limit effort="7" velocity="3" lower="-1" upper="2"/></joint>'
    )
    robot = _urdf(text)
    turn = robot.joints["turn"]
    assert (turn.limits, turn.effort, turn.velocity, turn.axis) == ((-1, 2), 7, 3, (0, 0, 1))
    assert turn.position == (1, 2, 3)
    assert np.array(turn.rotation) == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    visual, collision = robot.links["base"].geometries
    assert (visual.use, visual.mesh, visual.scale) == ("visual", "meshes/base.stl", (1e-3,) * 3)
    assert (collision.use, collision.kind, collision.size) == ("collision", "cylinder", (0.1, 0.3))
    assert (str(turn.where), str(robot.links["base"].where)) == ("robot.urdf:4", "robot.urdf:3")


MODEL = """<mujoco model="tester"><compiler angle="degree" eulerseq="zyx"/>
<default><default class="drive"><joint axis="0 1 0" range="-90 90" actuatorfrcrange="-30 30"/>
<geom density="2000"/></default></default>
<worldbody><body name="base" childclass="drive"><freejoint/>
<geom type="box" size="0.1 0.2 0.3"/><geom size="0.1" mass="3" pos="0 0 1"/>
<frame pos="0 0 -0.1" euler="90 0 0"><body name="thigh" pos="0.2 0 0" axisangle="1 0 0 30">
<joint name="hip" pos="0 0 0.01"/><geom type="capsule" fromto="0 0 0 0.1 0.2 -0.3" size="0.05"/>
<body name="shank" pos="0 0 -0.4" xyaxes="0 1 0 -1 0 0"><joint name="knee" type="slide"/>
<joint name="twist"/><geom type="ellipsoid" size="0.1 0.2 0.05"/>
<geom type="cylinder" size="0.03 0.1" quat="1 1 0 0"/></body></body></frame></body></worldbody>
<actuator><motor joint="twist" gear="5" ctrlrange="-2 2"/></actuator></mujoco>"""


ROBOT = _mjcf(MODEL)
CUT = {one.name: one for one in segments(ROBOT)}


def posed() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """MuJoCo's own model, as the file shows it."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_masses_of_primitive_geoms_are_those_of_mujoco() -> None:
    model, _ = posed()
    for name in ("base", "thigh", "shank"):
        ours, body = ROBOT.links[name].inertial, model.body(name)
        assert ours is not None
        assert ours.mass == pytest.approx(body.mass[0], rel=1e-9)
        assert ours.com == pytest.approx(tuple(body.ipos), abs=1e-9)
        principal = np.linalg.eigvalsh(np.array(ours.inertia))
        assert principal == pytest.approx(np.sort(body.inertia), rel=1e-6)


def test_places_of_mjcf_joints_are_those_of_mujoco() -> None:
    _, data = posed()
    hip, knee = data.joint("hip").xanchor, data.joint("knee").xanchor
    assert CUT["thigh"].length == pytest.approx(np.linalg.norm(knee - hip), rel=1e-9)
    joints = ROBOT.joints
    assert joints["hip"].limits == pytest.approx((-math.pi / 2, math.pi / 2))
    assert (joints["hip"].effort, joints["twist"].effort) == (30, 30)
    # A segment's centre is counted from its joint, and not from its frame.
    assert np.linalg.norm(hip - data.body("thigh").xpos) > 0.005
    along = (data.body("thigh").xipos - hip) @ (knee - hip) / ((knee - hip) @ (knee - hip))
    assert CUT["thigh"].centre == pytest.approx(along, abs=1e-6)


def test_a_body_with_two_joints_becomes_a_chain() -> None:
    ends = [(ROBOT.joints[name].parent, ROBOT.joints[name].child) for name in ("knee", "twist")]
    assert ends == [("thigh", "shank:1"), ("shank:1", "shank")]
    assert ROBOT.links["shank:1"].inertial is None


@given(st.lists(st.tuples(st.floats(0.1, 5), points), min_size=1, max_size=5), points)
def test_bolting_bodies_together_conserves_mass_and_does_not_depend_on_the_origin(
    parts: list[tuple[float, tuple[float, float, float]]], shift: tuple[float, float, float]
) -> None:
    round_ = ((0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01))
    bodies = [Inertial(mass, com, round_) for mass, com in parts]
    identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    whole = combined(bodies)
    away = combined([moved(body, shift, identity) for body in bodies])
    assert whole.mass == pytest.approx(sum(mass for mass, _ in parts))
    assert np.array(away.inertia) == pytest.approx(np.array(whole.inertia), abs=1e-9)
    assert np.array(away.com) - np.array(shift) == pytest.approx(np.array(whole.com), abs=1e-9)


@given(st.floats(0.1, 50), st.tuples(*[st.floats(0.01, 1)] * 3))
def test_the_box_with_a_boxs_inertia_is_that_box(
    mass: float, edges: tuple[float, float, float]
) -> None:
    a, b, c = edges
    xx, yy, zz = (mass * (x * x + y * y) / 12 for x, y in ((b, c), (a, c), (a, b)))
    found = box(Inertial(mass, (0.0, 0.0, 0.0), ((xx, 0.0, 0.0), (0.0, yy, 0.0), (0.0, 0.0, zz))))
    assert found == pytest.approx(tuple(sorted(edges, reverse=True)), rel=1e-6)


def test_segments_conserve_mass_and_measure_joint_to_joint() -> None:
    robot = _urdf(written.leg())
    cut = {one.name: one for one in segments(robot)}
    assert sum(one.mass for one in cut.values()) == pytest.approx(robot.mass)
    assert cut["thigh"].length == pytest.approx(0.3)
    edge = math.sqrt(6 * 0.01 / 1.0)
    assert cut["foot"].length == pytest.approx(edge)
    # The segment that is measured by its box and the root have no centre.
    assert math.isnan(cut["foot"].centre)
    assert math.isnan(cut["pelvis"].centre)


@given(st.floats(-0.5, 1.5), points)
def test_a_segments_centre_is_the_share_of_its_length_at_which_it_balances(
    share: float, offset: tuple[float, float, float]
) -> None:
    # Of the sideways offset nothing counts: the knee hangs straight below the hip.
    com = f"{offset[0]} {offset[1]} {-0.3 * share}"
    text = written.leg().replace("0 0 -0.15", com, 1)
    cut = {one.name: one for one in segments(_urdf(text))}
    assert cut["thigh"].centre == pytest.approx(share, abs=1e-7)
    assert cut["shank"].centre == pytest.approx(0.5)


def robot(links: str, *joints: tuple[str, ...]) -> list[Segment]:
    """Segments of links with a mass, and of joints."""
    return segments(_urdf(written.urdf(links + "".join(joint(*one) for one in joints))))


@pytest.mark.parametrize(("gap", "kept"), [("0.0199", ["base", "a"]), ("0.02", ["base", "a", "b"])])
def test_a_joint_closer_than_two_centimetres_joins_its_parents_segment(
    gap: str, kept: list[str]
) -> None:
    above = ("hip_roll", "base", "a", "0 0 -0.5")
    cut = robot(link("base") + link("a") + link("b"), above, ("x", "a", "b", f"0 0 -{gap}"))
    assert [one.name for one in cut] == kept


def test_fixed_links_belong_to_their_parents_segment_and_reach_as_far_as_they_do() -> None:
    links = link("base") + link("hand") + link("tip", None)
    frame = ("tip_frame", "hand", "tip", "0 0 -0.17", "fixed")
    hand = robot(links, ("wrist", "base", "hand"), frame)[1]
    assert hand.links == ("hand", "tip")
    assert hand.length == pytest.approx(0.17)


def test_a_robot_on_a_floating_joint_is_that_robot() -> None:
    free = ("free", "world", "base", "0 0 1", "floating")
    links = link("world", None) + link("base") + link("a")
    cut = robot(links, free, ("hip", "base", "a", "0 0 -0.01"))
    assert [one.name for one in cut] == ["world"]


BASE = '<mujoco><include file="parts/defaults.xml"/><worldbody>{}</worldbody></mujoco>'
ARM = '<body name="a"><freejoint/><body name="b"><joint name="j" class="tight"/></body></body>'
DEFAULTS = (
    '<mujocoinclude><default><default class="tight"><joint {}/></default></default></mujocoinclude>'
)


def test_included_files_count_where_they_are_included(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "defaults.xml").write_text(DEFAULTS.format('range="-90 45"'))
    (tmp_path / "r.xml").write_text(BASE.format('<include file="arm.xml"/>'))
    (tmp_path / "arm.xml").write_text(f"<mujoco>\n{ARM}</mujoco>")
    joint = describe(tmp_path / "r.xml", "here/r.xml").joints["j"]
    assert joint.limits == pytest.approx((-np.pi / 2, np.pi / 4))
    assert str(joint.where) == "here/arm.xml:2"


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("gone.xml", "r.xml:1: it includes 'gone.xml', which does not exist"),
        ("../secret.xml", "r.xml:1: it includes '../secret.xml', which is outside the robot's"),
        ("r.xml", "r.xml:1: file 'r.xml' is included twice, or includes itself"),
    ],
)
def test_an_include_that_cannot_be_is_refused(file: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "r.xml").write_text(f'<mujoco><include file="{file}"/><worldbody/></mujoco>')
    with pytest.raises(DescriptionError) as caught:
        describe(folder / "r.xml", "r.xml")
    assert str(caught.value).startswith(message)


def test_all_kinds_of_actuator_share_one_default_as_in_mujoco() -> None:
    text = (
        '<mujoco><default><motor forcerange="-7 7"/></default><worldbody>'
        '<body name="a"><freejoint/>'
        '<body name="b"><joint name="j"/></body><body name="c"><joint name="k"/></body></body>'
        '</worldbody><actuator><position joint="j" gear="2"/></actuator></mujoco>'
    )
    joints = mjcf.from_xml(read_text(text, "r.xml")).joints
    assert (joints["j"].effort, joints["j"].driven) == (14.0, True)
    assert (joints["k"].effort, joints["k"].driven) == (None, False)


def test_a_joint_that_an_equality_couples_follows_the_other() -> None:
    text = (
        '<mujoco><worldbody><body name="a"><freejoint/><body name="b"><joint name="j"/>'
        '<body name="c"><joint name="k"/></body></body></body></worldbody>'
        '<equality><joint joint1="j" joint2="k"/><connect body1="c" body2="a" anchor="0 0 0"/>'
        '</equality><actuator><motor joint="j" ctrlrange="-1 1"/></actuator></mujoco>'
    )
    found = mjcf.from_xml(read_text(text, "r.xml"))
    assert found.joints["k"].mimics == "j"
    assert [loop.links for loop in found.loops] == [("c", "a")]
    assert [joint.name for joint in found.between("c", "a")] == ["k", "j"]


def test_a_second_way_to_a_link_is_a_loop_that_is_cut_where_the_tree_is_shortest() -> None:
    ends = {"x": "ab", "rod": "ad", "y": "bc", "z": "cd"}
    parts = [*map(link, "abcd"), *(joint(name, *pair) for name, pair in ends.items())]
    found = _urdf(written.urdf("\n".join(parts)))
    assert list(found.joints) == ["x", "y", "z"]
    assert [(loop.name, loop.links) for loop in found.loops] == [("rod", ("a", "d"))]
