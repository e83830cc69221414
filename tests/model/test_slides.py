"""A slide moves its link along its axis, in metres, on both sides alike, and nothing drives it."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft import geometry as g
from draft.cli import main
from tests.helpers import ids, leg, parameter, robot
from tests.written import edit, write_robot

HINGE = "joint: {name: knee, axis: y, range: [-2.0, 2.0], actuator: leg}"
PISTON = "joint: {name: piston, type: slide, axis: -z, range: [0, 0.1], home: 0.04}"
HIP = {"axis": "x", "range": [-1, 1], "actuator": "leg"}
MIRROR = np.diag([1.0, -1.0, 1.0])


def telescope(axis: Any = "-z", home: Any = 0.04, **changes: Any) -> list[dict[str, Any]]:
    """The leg of the tests with a shank in two halves, the lower of which slides."""
    links = leg(shank={"type": "basic", "sphere": None}, **changes)
    links[2]["link"] = {"axis": "-z", "length": 0.15, "segment": "shank"}
    slide = {"name": "piston", "type": "slide", "axis": axis, "range": [-0.1, 0.1], "home": home}
    lower = {"axis": "-z", "length": 0.1, "segment": "shank"}
    foot = {"radius": 0.02, "site": "foot"}
    links.append({"name": "rod", "type": "sphere", "joint": slide, "link": lower, "sphere": foot})
    return links


def placed(model: mujoco.MjModel, values: dict[str, float]) -> mujoco.MjData:
    """A model with its trunk at the origin and some joints at a value."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0
    data.qpos[3] = 1
    for name, value in values.items():
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    return data


def test_mujoco_gets_a_slide_without_armature_or_force() -> None:
    model = robot(telescope()).resolve().build().mujoco
    piston = model.joint("piston")
    assert piston.type[0] == mujoco.mjtJoint.mjJNT_SLIDE
    assert piston.range == pytest.approx([-0.1, 0.1])
    assert model.dof_armature[piston.dofadr[0]] == 0
    assert not model.jnt_actfrclimited[piston.id]


def test_the_home_pose_moves_the_link_and_turns_nothing() -> None:
    design = robot(telescope(axis=[0.6, 0, -0.8])).resolve()
    rod = next(i for i, body in enumerate(design.bodies) if body.name == "rod")
    (zero, turned), (home, turned_home) = design.frames()[rod], design.frames(home=True)[rod]
    assert g.subtract(home, zero) == pytest.approx((0.04 * 0.6, 0, -0.04 * 0.8))
    assert turned_home == turned
    assert float(design.lowest(home=True)) == pytest.approx(float(design.lowest()) + 0.032)


def test_frames_of_a_bent_leg_are_mujocos() -> None:
    links = telescope()
    links[2]["joint"]["home"] = 0.7
    links[3]["rpy"] = [0.2, -0.1, 0.3]
    design = robot(links).resolve()
    data = placed(design.build().mujoco, {"hip": 0, "knee": 0.7, "piston": 0.04})
    for body, (origin, _) in zip(design.bodies, design.frames(home=True), strict=True):
        assert data.body(body.name).xpos == pytest.approx(origin, abs=1e-9)


def test_the_scenes_home_pose_stands_on_the_floor_with_the_slide_out() -> None:
    built = robot(telescope()).resolve().build()
    scene = built.scene()
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    mujoco.mj_kinematics(scene, data)
    assert data.joint("piston").qpos[0] == 0.04
    assert data.geom("rod_end").xpos[2] == pytest.approx(0.02, abs=1e-9)
    assert {scene.actuator(i).name for i in range(scene.nu)} == {"hip", "knee"}


def sides(axis: Any, changes: dict[str, Any] | None = None) -> draft.Spec:
    """Two telescopic legs, the right one the mirror image of the left."""
    place = {"chain": "leg", "at": [0.1, 0.2, -0.2], "rpy": [0.3, 0.1, -0.2]}
    right = {**place, "prefix": "R_", "mirror": "y", "joints": changes or {}}
    numbers = {name: parameter(x) for name, x in zip("abc", (0.0, 0.6, 0.8), strict=True)}
    children = [{**place, "prefix": "L_"}, right]
    return robot(telescope(axis=axis), children=children, parameters=numbers)


@pytest.mark.parametrize("axis", ["x", "y", "z", "-y"])
def test_a_slide_along_an_axis_keeps_it_on_the_other_side(axis: str) -> None:
    model = sides(axis).resolve().build().mujoco
    assert list(model.joint("R_piston").axis) == list(model.joint("L_piston").axis)
    assert list(model.joint("R_piston").range) == list(model.joint("L_piston").range)


CANTED = sides(["a", "b", "c"])
components = st.floats(-1, 1).filter(lambda x: abs(x) > 0.05)


@settings(max_examples=15)
@given(st.tuples(components, components, components), st.floats(-0.1, 0.1))
def test_mirrored_slides_put_every_body_at_its_mirror_image(
    axis: tuple[float, float, float], out: float
) -> None:
    model = CANTED.resolve(dict(zip("abc", axis, strict=True))).build().mujoco
    left, right = model.joint("L_piston").axis, model.joint("R_piston").axis
    assert left @ right >= 0
    # The reflection of a motion goes along the reflected axis: a slide's axis is a polar vector.
    sense = 1.0 if left @ MIRROR @ right > 0 else -1.0
    assert sense * right == pytest.approx(MIRROR @ left)
    data = placed(model, {"L_piston": out, "R_piston": sense * out})
    for body in ("shank", "rod"):
        one, two = data.body(f"L_{body}"), data.body(f"R_{body}")
        assert two.xpos == pytest.approx(MIRROR @ one.xpos, abs=1e-9)
        assert two.xipos == pytest.approx(MIRROR @ one.xipos, abs=1e-9)


def test_one_side_may_slide_the_other_way_over_a_range_of_its_own() -> None:
    change = {"piston": {"reverse": True, "range": [0, 0.2], "home": 0.15}}
    model = sides("y", change).resolve().build().mujoco
    assert model.joint("R_piston").axis == pytest.approx(-model.joint("L_piston").axis)
    assert model.joint("R_piston").range == pytest.approx([0, 0.2])


def test_show_gives_the_stroke_in_metres(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = write_robot(tmp_path / "robot")
    edit(path, "tree.yaml", "      motor: {actuator: leg, axis: y}\n", "")
    edit(path, "tree.yaml", HINGE, PISTON)
    assert main(["show", str(path)]) in (0, 1)
    out = capsys.readouterr().out
    assert "piston (0 0 -1) 0..0.1 m, slides" in out
    assert "hip (1 0 0) -1..1 rad" in out


@pytest.mark.parametrize(("stroke", "apart"), [(0.01, False), (0.5, True)])
def test_actuators_that_a_slide_parts_do_not_overlap(stroke: float, apart: bool) -> None:
    short = {"axis": "-z", "length": 0.02, "segment": "thigh"}
    slide = {"name": "piston", "type": "slide", "axis": "z", "range": [-stroke, 0]}
    links = [
        {"name": "housing", "motor": {"actuator": "leg", "axis": "x"}},
        {"name": "sled", "joint": slide, "link": short, "motor": {"actuator": "leg", "axis": "x"}},
        {"name": "thigh", "joint": {**HIP, "name": "hip"}, "link": short},
        {"name": "shank", "joint": {**HIP, "name": "knee"}, "link": short},
    ]
    design = robot(links, allow=["actuator_overlap"]).resolve()
    assert ("actuator_overlap" in ids(design)) is not apart
    said = [f.message for f in design.findings if f.id == "actuator_overlap"]
    assert all("at every position of the slide" in words for words in said)
