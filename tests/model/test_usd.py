"""USD beyond tests/model/test_formats_agree.py: drives, armatures, shapes, the root."""

# pyright: reportAttributeAccessIssue=false
# (OpenUSD's compiled modules carry no types.)
from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import draft
from draft.errors import DraftError
from draft.model.urdf import distinct_name
from draft.values import scalar
from tests.helpers import robot as robot_of
from tests.model.own_parts import everything
from tests.model.shipped import built
from tests.model.test_slides import telescope

pxr = pytest.mark.skipif(
    importlib.util.find_spec("pxr") is None, reason="the extra `usd` is not installed"
)
SINGLE = 2.0**-23  # Of two roundings to single precision, as a share.


def stage_of(model: draft.Model, folder: Path) -> Any:
    from pxr import Usd

    return Usd.Stage.Open(str(model.save(folder, ["usd"]) / "robot.usda"))


def joints_of(stage: Any) -> dict[str, Any]:
    from pxr import UsdPhysics

    return {one.GetName(): one for one in stage.Traverse() if one.IsA(UsdPhysics.Joint)}


@pxr
@pytest.mark.parametrize("name", ["quadruped", "wheeled", "hand", "telescope"])
def test_drives_are_the_servos_of_the_scene_and_armatures_those_of_the_model(
    name: str, tmp_path: Path
) -> None:
    from pxr import UsdPhysics

    model = robot_of(telescope()).resolve().build() if name == "telescope" else built(name, None)
    stage, scene = stage_of(model, tmp_path / "out"), model.scene()
    joints = joints_of(stage)
    driven = {scene.actuator(i).name for i in range(scene.nu)}
    assert driven
    for joint, of_design in model.design.joints.items():
        prim, one = joints[distinct_name(model.design, joint)], scene.joint(joint)
        turns = scene.jnt_type[one.id] == mujoco.mjtJoint.mjJNT_HINGE
        armature = prim.GetAttribute("newton:armature").Get()
        assert armature == pytest.approx(one.armature[0], rel=SINGLE)
        drive = UsdPhysics.DriveAPI.Get(prim, "angular" if turns else "linear")
        assert bool(drive) == (joint in driven)
        if not drive:
            assert math.isinf(prim.GetAttribute("newton:velocityLimit").Get())
            continue
        servo, per = scene.actuator(joint), 180 / math.pi if turns else 1.0
        assert drive.GetTypeAttr().Get() == "force"
        rolls = servo.biasprm[1] == 0  # a velocity servo
        stiffness, damping = (-servo.biasprm[i] for i in (1, 2))
        assert drive.GetStiffnessAttr().Get() * per == pytest.approx(stiffness, rel=SINGLE)
        assert drive.GetDampingAttr().Get() * per == pytest.approx(damping, rel=SINGLE)
        assert drive.GetMaxForceAttr().Get() == pytest.approx(servo.forcerange[1], rel=SINGLE)
        target = 0.0 if rolls else scalar(of_design.home)
        assert drive.GetTargetPositionAttr().Get() / per == pytest.approx(target, rel=SINGLE)


@pxr
@pytest.mark.parametrize(("name", "fixed"), [("quadruped", False), ("arm", True)])
def test_only_a_robot_with_a_fixed_base_is_fixed_to_the_world(
    name: str, fixed: bool, tmp_path: Path
) -> None:
    from pxr import UsdPhysics

    stage = stage_of(built(name, None), tmp_path / "out")
    bodies = {one.GetPath() for one in stage.Traverse() if one.HasAPI(UsdPhysics.RigidBodyAPI)}
    above = [UsdPhysics.Joint(one).GetBody0Rel().GetTargets() for one in joints_of(stage).values()]
    (root,) = (one for one in stage.Traverse() if one.HasAPI("NewtonArticulationRootAPI"))
    assert root.GetAttribute("newton:selfCollisionEnabled").Get() is False
    assert sum(not paths or paths[0] not in bodies for paths in above) == fixed


@pxr
def test_bodies_and_meshes_stand_where_mujoco_has_them_with_all_joints_at_zero(
    tmp_path: Path,
) -> None:
    from pxr import UsdGeom, UsdPhysics

    model = everything().resolve().build()
    stage, compiled = stage_of(model, tmp_path / "out"), model.mujoco
    data = mujoco.MjData(compiled)
    data.qpos[:] = 0
    data.qpos[3] = 1
    mujoco.mj_kinematics(compiled, data)
    placed, meshes = UsdGeom.XformCache(), 0
    for prim in stage.Traverse():
        pose = np.array(placed.GetLocalToWorldTransform(prim))  # of rows
        if prim.HasAPI(UsdPhysics.RigidBodyAPI):
            body = data.body(prim.GetName())
            assert pose[3, :3] == pytest.approx(body.xpos, abs=1e-6)
            assert pose[:3, :3].T.ravel() == pytest.approx(body.xmat, abs=1e-6)
        if prim.IsA(UsdGeom.Mesh):
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get()) @ pose[:3, :3] + pose[3, :3]
            geom = compiled.geom(prim.GetName().removesuffix("_collision"))
            start, count = (
                x[geom.dataid[0]] for x in (compiled.mesh_vertadr, compiled.mesh_vertnum)
            )
            own = compiled.mesh_vert[start : start + count]
            expected = own @ data.geom(geom.id).xmat.reshape(3, 3).T + data.geom(geom.id).xpos
            for bound in (np.min, np.max):
                assert bound(points, axis=0) == pytest.approx(bound(expected, axis=0), abs=1e-6)
            meshes += 1
    assert meshes == sum(compiled.geom_type == mujoco.mjtGeom.mjGEOM_MESH)


@pxr
def test_the_file_is_one_layer_that_names_no_other_and_is_the_same_each_time(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model = built("hopper", None)
    stage = stage_of(model, tmp_path / "one")
    text = (tmp_path / "one" / "robot.usda").read_bytes()
    assert not stage.GetRootLayer().GetCompositionAssetDependencies()
    assert b"tmp" not in text
    model.save(tmp_path / "two", ["usd"])
    assert (tmp_path / "two" / "robot.usda").read_bytes() == text
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="there is no extra to install")
def test_without_the_extra_the_message_names_it_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setitem(sys.modules, "urdf_usd_converter", None)
    monkeypatch.setattr("draft.model.usd.find_spec", lambda _: None)
    with pytest.raises(DraftError, match=r"^urdf_usd_converter is not installed\n.*usd"):
        draft.export(built("hopper", None), tmp_path / "out", ["usd"])
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(("version", "system"), [((3, 13), "linux"), ((3, 11), "darwin")])
def test_where_the_converter_cannot_be_installed_the_message_says_where_it_can(
    version: tuple[int, int], system: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("draft.model.usd.find_spec", lambda _: None)
    monkeypatch.setattr(sys, "version_info", version)
    monkeypatch.setattr(sys, "platform", system)
    with pytest.raises(DraftError, match=r"Python 3\.11 or 3\.12 on Linux or Windows.*\n.*`urdf`"):
        draft.export(built("hopper", None), tmp_path / "out", ["usd"])
    assert not any(tmp_path.iterdir())
