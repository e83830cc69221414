"""Exports say what the MJCF says: URDF by two readers at random poses, glTF by another."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's and Pinocchio's compiled modules carry no types.)
from __future__ import annotations

import io
import json
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

import draft
from draft.imports.importer import import_robot
from draft.laws.catalogue import catalogue
from draft.model import sdf, urdf
from draft.model.shapes import matrix
from draft.model.urdf import rpy
from tests.helpers import robot
from tests.imports.written import joint, link
from tests.model.shipped import built
from tests.model.test_slides import sides, telescope

pinocchio = pytest.importorskip("pinocchio")
trimesh = pytest.importorskip("trimesh")
SHIPPED = (("quadruped", "bear"), ("quadruped", None), ("humanoid", None), ("hopper", None))


@pytest.fixture(scope="module", params=SHIPPED, ids=lambda pair: "-".join(filter(None, pair)))
def model(request: pytest.FixtureRequest) -> draft.Model:
    return built(*request.param)


def poses(model: draft.Model, count: int = 6) -> np.ndarray:
    """Places, turns and joint values as MuJoCo counts them, shape (count, nq)."""
    rng = np.random.default_rng(3)
    q = rng.uniform(-1, 1, (count, model.mujoco.nq))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    low, high = model.mujoco.jnt_range[1:].T
    q[:, 7:] = rng.uniform(low, high, (count, model.mujoco.njnt - 1))
    return q


def inertia(model: mujoco.MjModel, q: np.ndarray) -> np.ndarray:
    """M(q) without armatures; the base's speed in the world, its turning rate in its own axes."""
    model.dof_armature[:] = 0
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return full


def by_mujoco(path: Path, names: list[str], q: np.ndarray) -> np.ndarray:
    """M(q) of a URDF that MuJoCo reads, its root set free, joints in the order of the names."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.worldbody.first_body().add_freejoint()
    model = spec.compile()
    assert model.njnt == len(names) + 1
    own, dofs = q.copy(), [*range(6)]
    for name, value in zip(names, q[7:], strict=True):
        own[model.joint(name).qposadr[0]] = value
        dofs.append(int(model.joint(name).dofadr[0]))
    return inertia(model, own)[np.ix_(dofs, dofs)]


def by_pinocchio(path: Path, names: list[str], q: np.ndarray) -> np.ndarray:
    """The same by Pinocchio, whose base moves in its own axes and counts quaternions otherwise."""
    model = pinocchio.buildModelFromUrdf(str(path), pinocchio.JointModelFreeFlyer())
    assert model.njoints == len(names) + 2
    data = model.createData()
    angles = np.concatenate([q[:3], q[4:7], q[3:4], np.zeros(model.nq - 7)])
    dofs = [*range(6)]
    for name, value in zip(names, q[7:], strict=True):
        one = model.joints[model.getJointId(name)]
        angles[one.idx_q] = value
        dofs.append(one.idx_v)
    pinocchio.crba(model, data, angles)
    full = (np.triu(data.M) + np.triu(data.M, 1).T)[np.ix_(dofs, dofs)]
    turn = np.eye(len(full))
    turn[:3, :3] = matrix(q[3:7])
    return turn @ full @ turn.T


def agree(model: draft.Model, folder: Path) -> None:
    """Both readers find M(q) of the MJCF."""
    path = model.save(folder / "out", ("urdf",)) / "robot.urdf"
    names = list(model.design.joints)
    compiled = mujoco.MjModel.from_xml_string(model.xml)
    for q in poses(model):
        ours = inertia(compiled, q)
        largest = np.abs(ours).max()
        for read in (by_mujoco, by_pinocchio):
            assert np.abs(read(path, names, q) - ours).max() < 1e-6 * largest, read.__name__
            assert read(path, names, q) == pytest.approx(ours, abs=1e-6 * max(largest, 1.0))


def test_two_readers_find_the_same_inertia(model: draft.Model, tmp_path: Path) -> None:
    agree(model, tmp_path)


def test_slides_are_prismatic_and_agree(tmp_path: Path) -> None:
    agree(sides([0.3, 0.2, -0.9]).resolve().build(), tmp_path)
    root = ElementTree.parse(tmp_path / "out" / "robot.urdf").getroot()
    kinds = {one.get("name"): one.get("type") for one in root.iter("joint")}
    assert kinds["L_piston"] == kinds["R_piston"] == "prismatic"
    limit = root.find("joint[@name='L_piston']/limit")
    assert limit is not None
    assert (limit.get("lower"), limit.get("upper"), limit.get("effort")) == ("-0.1", "0.1", "0")


CANTED = (
    '<robot name="canted">'
    + link("body", 8.0)
    + "".join(link(name) for name in ("thigh", "shank"))
    + joint("hip", "body", "thigh", (0.1, 0.1, 0), "0.6 0.48 0.64")
    + joint("knee", "thigh", "shank", (0, 0.02, -0.25), "0.1 0.9 -0.4")
    + '<link name="foot"/><joint name="ball" type="fixed"><parent link="shank"/>'
    '<child link="foot"/><origin xyz="0 0 -0.2"/></joint></robot>'
)


def test_an_import_with_canted_axes_agrees(tmp_path: Path) -> None:
    source = tmp_path / "canted.urdf"
    source.write_text(CANTED, encoding="utf-8")
    import_robot(source, tmp_path / "canted", population="quadruped")
    found = draft.load(tmp_path / "canted").resolve().build()
    assert any(np.count_nonzero(axis) > 1 for axis in found.mujoco.jnt_axis[1:])
    agree(found, tmp_path)


def test_masses_and_limits_stand_in_the_urdf(model: draft.Model) -> None:
    root = ElementTree.fromstring(urdf.robot_urdf(model))
    masses = {
        one.get("name"): float(one.find("inertial/mass").get("value"))  # type: ignore
        for one in root.iter("link")
        if one.find("inertial") is not None
    }
    # MuJoCo keeps the trunk's vertices in single precision.
    assert sum(masses.values()) == pytest.approx(float(model.design.mass), rel=1e-6)
    assert sum(masses.values()) == pytest.approx(model.mujoco.body_mass.sum(), rel=1e-9)
    names = [one.get("name") for tag in ("link", "joint") for one in root.findall(tag)]
    assert not any(" " in str(name) for name in names)
    assert root.findall("link")[0].get("name") == model.design.bodies[0].name
    for name, made in model.design.joints.items():
        limit = root.find(f"joint[@name='{name}']/limit")
        assert limit is not None
        a = model.design.actuators[str(made.actuator)]
        assert float(limit.get("effort", 0)) == pytest.approx(a.peak_torque)
        assert float(limit.get("velocity", 0)) == pytest.approx(a.no_load_speed)
        bounds = [float(limit.get(end, 0)) for end in ("lower", "upper")]
        assert bounds == pytest.approx(list(made.range))


def test_mujoco_sees_the_same_shapes_in_the_urdf(model: draft.Model, tmp_path: Path) -> None:
    path = model.save(tmp_path / "out", ("urdf",)) / "robot.urdf"
    read = mujoco.MjModel.from_xml_path(str(path))
    collide = [i for i in range(model.mujoco.ngeom) if model.mujoco.geom_conaffinity[i]]
    # Each is there once to be seen, and those that meet the floor once more.
    assert read.ngeom == model.mujoco.ngeom + len(collide)
    assert read.nmesh == 1


def test_the_sidecar_has_what_urdf_cannot_say(model: draft.Model, tmp_path: Path) -> None:
    folder = model.save(tmp_path / "out", ("urdf", "mjcf"))
    table = json.loads((folder / "actuators.json").read_text())
    scene = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    assert list(table["joints"]) == list(model.design.joints)
    for i in range(scene.nu):
        entry = table["joints"][scene.actuator(i).name]
        dof = scene.jnt_dofadr[scene.actuator_trnid[i, 0]]
        assert entry["kp"] == pytest.approx(scene.actuator_gainprm[i, 0])
        assert entry["kd"] == pytest.approx(-scene.actuator_biasprm[i, 2])
        assert entry["armature"] == pytest.approx(scene.dof_armature[dof])
        assert entry["friction_loss"] == pytest.approx(scene.dof_frictionloss[dof])
        assert entry["damping"] == pytest.approx(scene.dof_damping[dof])
        assert entry["peak_torque"] == pytest.approx(scene.actuator_forcerange[i, 1])


def test_a_passive_slide_has_no_drive_in_the_sidecar() -> None:
    table = urdf.actuators(robot(telescope()).resolve())
    assert table["joints"]["piston"]["class"] is None
    assert "kp" not in table["joints"]["piston"]
    assert table["joints"]["piston"]["type"] == "prismatic"


@pytest.mark.parametrize("pitch", [0.0, 0.7, math.pi / 2, -math.pi / 2, 3.0])
def test_roll_pitch_and_yaw_give_the_rotation_again(pitch: float) -> None:
    from draft.geometry import from_rpy

    turn = np.array(from_rpy(0.4, pitch, -1.1), dtype=float)
    again = np.array(from_rpy(*rpy(turn)), dtype=float)
    assert again == pytest.approx(turn, abs=1e-9)


def test_the_trunks_mesh_is_closed_and_weighs_what_it_should(model: draft.Model) -> None:
    trunk = model.design.trunk
    stl, obj = urdf.stl(trunk.loft), sdf.meshes(model.design)["meshes/trunk.obj"].encode()
    for content, kind in ((stl, "stl"), (obj, "obj")):
        read = trimesh.load(io.BytesIO(content), file_type=kind)
        assert read.is_watertight
        assert read.volume * float(trunk.density) == pytest.approx(float(trunk.mass), rel=1e-5)


def standing(model: draft.Model) -> mujoco.MjData:
    scene = model.scene()
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    mujoco.mj_kinematics(scene, data)
    return data


def test_the_glb_has_every_geom_where_mujoco_has_it(model: draft.Model, tmp_path: Path) -> None:
    folder = model.save(tmp_path / "out", ("glb",))
    read: Any = trimesh.load_scene(folder / "robot.glb")
    data = standing(model)
    up = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    trunk = f"{model.design.bodies[0].name}_trunk"
    assert {*read.graph.nodes_geometry} == {
        model.mujoco.geom(i).name for i in range(model.mujoco.ngeom)
    }
    for i in range(model.mujoco.ngeom):
        name = model.mujoco.geom(i).name
        place, geometry = read.graph[name]
        mesh = read.geometry[geometry]
        assert mesh.is_watertight or mesh.merge_vertices(merge_norm=True) or mesh.is_watertight
        assert mesh.volume > 0
        here = data.body(model.design.bodies[0].name) if name == trunk else data.geom(name)
        frame = here.xmat.reshape(3, 3)
        assert up @ place[:3, :3] == pytest.approx(frame, abs=1e-6)
        assert up @ place[:3, 3] == pytest.approx(here.xpos, abs=1e-6)
        if name != trunk:
            half = model.mujoco.geom_aabb[i][3:]
            assert mesh.bounds == pytest.approx(np.array([-half, half]), abs=1e-6)
        else:
            vertices = model.design.trunk.loft.vertices
            box = np.array([vertices.min(axis=0), vertices.max(axis=0)])
            assert mesh.bounds == pytest.approx(box, abs=1e-6)
    # It stands on the floor: glTF's y is up.
    assert read.bounds[0][1] == pytest.approx(0.0, abs=1e-3)


def test_joints_are_nodes_that_can_be_turned(model: draft.Model, tmp_path: Path) -> None:
    folder = model.save(tmp_path / "out", ("glb",))
    raw = (folder / "robot.glb").read_bytes()
    length = int.from_bytes(raw[12:16], "little")
    nodes = json.loads(raw[20 : 20 + length])["nodes"]
    by_name = {node["name"]: node for node in nodes}
    assert len(by_name) == len(nodes)
    for name in model.design.joints:
        assert by_name[name]["extras"]["axis"] == pytest.approx(model.mujoco.joint(name).axis)


def test_an_export_is_of_one_design_and_keeps_what_is_not_drafts(tmp_path: Path) -> None:
    hopper = built("hopper", None)
    folder = hopper.save(tmp_path / "out", ("urdf", "glb", "mjcf"))
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*")}
    assert names == {
        *("robot.xml", "scene.xml", "design.yaml", "report.json", "robot.urdf"),
        *("actuators.json", "meshes", "meshes/trunk.stl", "robot.glb"),
    }
    hopper.save(folder, ("glb",))
    assert {p.name for p in folder.iterdir()} == {"design.yaml", "report.json", "robot.glb"}
    hopper.save(folder, ("urdf",))
    (folder / "meshes" / "mine.stl").write_text("precious")
    with pytest.raises(draft.DraftError, match=r"not a folder of a Draft model .*meshes/mine\.stl"):
        hopper.save(folder)
    assert (folder / "meshes" / "mine.stl").read_text() == "precious"


def test_catalogue_parts_are_named_in_the_sidecar() -> None:
    table = urdf.actuators(draft.load("quadruped").resolve("cheetah"))
    assert {entry["like"] for entry in table["joints"].values()} <= {*catalogue(), None}
