"""A package for ROS 2: read by the tools of ROS that can be had without it."""

# pyright: reportAttributeAccessIssue=false
# (Compiled modules carry no types.)
from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import warnings
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
import yaml

import draft
from draft import files as saving
from draft.model.ros2.package import package_name
from draft.values import scalar
from tests.commands import Command
from tests.model.shipped import SHIPPED, built
from tests.model.test_coupling import coupled_hand

COUPLED = "coupled hand"
ROBOTS = [*SHIPPED, (COUPLED, None)]
PLUGIN = "gz_ros2_control/GazeboSimSystem"
LAUNCHED = ("display", "gazebo")


@cache
def model_of(name: str, label: str | None) -> draft.Model:
    return coupled_hand().resolve().build() if name == COUPLED else built(name, label)


@pytest.fixture(scope="module", params=ROBOTS, ids=lambda pair: "-".join(filter(None, pair)))
def package(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[draft.Model, Path]:
    model = model_of(*request.param)
    return model, draft.export_ros2(model, tmp_path_factory.mktemp("ros") / "package")


def tool(*names: str) -> str:
    """Path of the first of some programs, beside Python or on the path; without it, a skip."""
    beside = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    found = next(filter(None, (shutil.which(name, path=beside) for name in names)), None)
    return found or pytest.skip(f"none of {', '.join(names)} is installed")


def expanded(folder: Path) -> ElementTree.Element:
    """The whole description as the launch file of Gazebo has it."""
    xacro = pytest.importorskip("xacro")
    arguments = {"hardware": PLUGIN, "controllers": "/share/controllers.yaml"}
    path = str(folder / "urdf" / "robot.urdf.xacro")
    return ElementTree.fromstring(xacro.process_file(path, mappings=arguments).toxml())


def described(folder: Path) -> Path:
    """File with the whole description."""
    path = folder.parent / "described.urdf"
    path.write_bytes(ElementTree.tostring(expanded(folder)))
    return path


def config(folder: Path, name: str) -> Any:
    return yaml.safe_load((folder / "config" / name).read_text(encoding="utf-8"))


def names(elements: Any) -> list[str]:
    return [str(one.get("name")) for one in elements]


# --- the package ---------------------------------------------------------------------------


def test_the_manifest_is_valid_and_without_a_warning(package: tuple[draft.Model, Path]) -> None:
    reader = pytest.importorskip("catkin_pkg.package")
    model, folder = package
    noted: list[str] = []
    manifest = reader.parse_package(str(folder / "package.xml"), warnings=noted)
    manifest.validate(warnings=noted)
    assert not noted
    assert manifest.name == package_name(model.design)
    assert manifest.package_format == 3
    assert manifest.get_build_type() == "ament_cmake"
    assert manifest.licenses == ["TODO: License declaration"]
    assert (folder / "LICENSE").read_text().startswith("TODO: License declaration\n")


def test_what_is_installed_is_there(package: tuple[draft.Model, Path]) -> None:
    model, folder = package
    text = (folder / "CMakeLists.txt").read_text()
    found = re.search(r"DIRECTORY (.+)\n", text)
    assert found is not None
    assert {*found[1].split()} == {path.name for path in folder.iterdir() if path.is_dir()}
    assert f"project({package_name(model.design)})\n" in text
    assert ("meshes" in found[1]) == model.design.floating


@pytest.mark.parametrize(
    ("robot", "expected"),
    [
        ("quadruped", "quadruped_description"),
        ("Big__Robot_", "big_robot_description"),
        ("_2legs", "robot_2legs_description"),
        ("___", "robot_description"),
    ],
)
def test_the_name_of_a_package_keeps_the_rules_of_ros(robot: str, expected: str) -> None:
    class Named:
        reference = robot

    assert package_name(Named()) == expected  # type: ignore[arg-type]
    assert package_name(draft.load("quadruped").resolve("bear")) == "quadruped_bear_description"


# --- the description -----------------------------------------------------------------------


def test_urdfdom_and_pinocchio_read_the_whole_description(
    package: tuple[draft.Model, Path],
) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    model, folder = package
    path = described(folder)
    done = subprocess.run(
        [tool("check_urdf"), str(path)], capture_output=True, encoding="utf-8", check=False
    )
    assert done.returncode == 0, done.stderr
    assert "Successfully Parsed XML" in done.stdout
    base = pinocchio.JointModelFreeFlyer()
    read = pinocchio.buildModelFromUrdf(str(path), base)
    assert read.njoints == 2 + len(model.design.joints)
    masses = ElementTree.parse(path).getroot().iterfind("link/inertial/mass")
    # A body without mass has 10 mg.
    whole = pytest.approx(float(model.design.mass), rel=1e-6, abs=2e-5)
    assert sum(float(str(one.get("value"))) for one in masses) == whole
    if model.design.floating:
        assert pinocchio.computeTotalMass(read) == whole


def test_every_site_is_a_frame_at_its_place(package: tuple[draft.Model, Path]) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    model, folder = package
    compiled = model.mujoco
    read = pinocchio.buildModelFromUrdf(str(described(folder)))
    data, state = read.createData(), mujoco.MjData(compiled)
    if model.design.floating:
        state.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
    mujoco.mj_kinematics(compiled, state)
    zero = pinocchio.neutral(read)
    pinocchio.framesForwardKinematics(read, data, zero)
    assert compiled.nsite
    for i in range(compiled.nsite):
        place = data.oMf[read.getFrameId(f"{compiled.site(i).name}_link")]
        assert place.translation == pytest.approx(state.site_xpos[i], abs=1e-8)
        assert place.rotation == pytest.approx(state.site_xmat[i].reshape(3, 3), abs=1e-8)


def test_ros2_control_has_the_drives_of_the_design(package: tuple[draft.Model, Path]) -> None:
    model, folder = package
    root = expanded(folder)
    assert root.findtext("ros2_control/hardware/plugin") == PLUGIN
    controlled = {one.get("name"): one for one in root.findall("ros2_control/joint")}
    moving = [one for one in root.findall("joint") if one.get("type") != "fixed"]
    assert [*controlled] == names(moving)
    links = names(root.findall("link"))
    assert len({*links, *names(root.findall("joint"))}) == len(links) + len(root.findall("joint"))
    driven = []
    for (name, made), element in zip(model.design.joints.items(), moving, strict=True):
        assert str(element.get("name")).removesuffix("_joint") == name.removesuffix("_joint")
        control = controlled[element.get("name")]
        assert names(control.findall("state_interface")) == ["position", "velocity"]
        start = control.findtext("state_interface[@name='position']/param[@name='initial_value']")
        assert float(str(start)) == pytest.approx(scalar(made.home))
        drive, mimic = model.design.drive(made), element.find("mimic")
        commands = control.findall("command_interface")
        assert (mimic is not None) == (made.follows is not None)
        assert names(commands) == (["effort"] if drive else [])
        if drive:
            driven.append(element.get("name"))
            bounds = [
                float(str(commands[0].findtext(f"param[@name='{k}']"))) for k in ("min", "max")
            ]
            assert bounds == pytest.approx([-drive.peak_torque, drive.peak_torque])
        if made.follows is not None and mimic is not None:
            assert mimic.get("joint") in driven
            assert float(str(mimic.get("multiplier"))) == pytest.approx(made.follows.ratio)
    assert config(folder, "controllers.yaml")["effort_controller"]["ros__parameters"] == {
        "joints": driven,
        "interface_name": "effort",
    }


def test_feet_and_the_inertial_sensor_are_sensors(package: tuple[draft.Model, Path]) -> None:
    model, folder = package
    root = expanded(folder)
    sensors = [*root.findall("gazebo/sensor")]
    contacts = [one for one in sensors if one.get("type") == "contact"]
    assert len(contacts) == len(model.design.feet)
    bridged = config(folder, "bridge.yaml")
    assert [one["gz_topic_name"] for one in bridged] == [
        "/clock",
        *(one.findtext("contact/topic") for one in contacts),
    ]
    kinds = [one.get("type") for one in sensors]
    has_imu = "imu" in (model.mujoco.site(i).name for i in range(model.mujoco.nsite))
    assert kinds.count("imu") == len(root.findall("ros2_control/sensor")) == int(has_imu)
    if has_imu:
        states = root.findall("ros2_control/sensor[@name='imu']/state_interface")
        assert len(states) == 10
        broadcaster = config(folder, "controllers.yaml")["imu_sensor_broadcaster"]
        frame = broadcaster["ros__parameters"]["frame_id"]
        assert frame in names(root.findall("link"))
    links = names(root.findall("link"))
    joints = names(root.findall("joint"))
    for one in root.findall("gazebo"):
        assert one.get("reference") is None or one.get("reference") in (*links, *joints)


def test_the_parser_of_gazebo_keeps_every_link_and_finds_the_feet(
    package: tuple[draft.Model, Path],
) -> None:
    program = tool("gz", "ign")
    _, folder = package
    path = described(folder)
    done = subprocess.run(
        [program, "sdf", "-p", str(path)], capture_output=True, encoding="utf-8", check=False
    )
    if not done.stdout.lstrip().startswith("<"):
        pytest.skip(f"{program} reads no SDFormat")
    root = ElementTree.fromstring(done.stdout)
    shapes = {one.get("name") for one in root.iter("collision")}
    wanted = {one.text for one in root.iterfind(".//contact/collision")}
    assert wanted <= shapes
    source = ElementTree.parse(path).getroot()
    weighing = [
        one.get("name") for one in source.findall("link") if one.find("inertial") is not None
    ]
    floating = source.find("link[@name='world']") is None
    kept = {one.get("name") for one in root.iter("link")}
    assert kept == {*weighing} if floating else kept <= {*weighing}


# --- launch files and parameters -----------------------------------------------------------


def texts_of(tree: ast.AST) -> set[str]:
    return {
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }


@pytest.mark.parametrize("launched", LAUNCHED)
def test_a_launch_file_compiles_and_names_what_is_there(
    launched: str, package: tuple[draft.Model, Path]
) -> None:
    model, folder = package
    text = (folder / "launch" / f"{launched}.launch.py").read_text(encoding="utf-8")
    with warnings.catch_warnings(action="error"):
        tree = ast.parse(text)
        compile(tree, launched, "exec")
    made = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert made == ["generate_launch_description"]
    manifest = ElementTree.parse(folder / "package.xml").getroot()
    depends = {str(one.text) for one in manifest.findall("exec_depend")}
    imported = {
        str(node.module).split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
    }
    packages = {
        node.value.value
        for node in ast.walk(tree)
        if isinstance(node, ast.keyword)
        and node.arg == "package"
        and isinstance(node.value, ast.Constant)
    }
    assert packages
    assert {*packages, *imported} <= depends
    words = texts_of(tree)
    assert package_name(model.design) in words
    for file in (word for word in words if re.fullmatch(r"robot\.\S+|\w+\.(yaml|sdf)", word)):
        assert list(folder.glob(f"*/{file}")), file


def test_the_launched_controllers_have_parameters(package: tuple[draft.Model, Path]) -> None:
    _, folder = package
    parameters = config(folder, "controllers.yaml")
    manager = parameters["controller_manager"]["ros__parameters"]
    kinds = {name: value["type"] for name, value in manager.items() if isinstance(value, dict)}
    tree = ast.parse((folder / "launch" / "gazebo.launch.py").read_text(encoding="utf-8"))
    lists = {
        node.targets[0].id: ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
    }
    assert {*lists["ACTIVE"], *lists["INACTIVE"]} == {*kinds}
    assert lists["INACTIVE"] == ["effort_controller"]
    assert {*parameters} - {"controller_manager"} <= {*kinds}
    root = ElementTree.parse(folder / "urdf" / "robot.urdf").getroot()
    children = {one.get("link") for one in root.iterfind("joint/child")}
    (base,) = {*names(root.findall("link"))} - children
    assert (
        config(folder, "robot.rviz")["Visualization Manager"]["Global Options"]["Fixed Frame"]
        == base
    )
    zeros = config(folder, "home.yaml")["/**"]["ros__parameters"]["zeros"]
    moving = [one for one in root.findall("joint") if one.get("type") != "fixed"]
    assert [*zeros] == names(moving)


# --- its folder ----------------------------------------------------------------------------


def test_a_package_is_replaced_whole_and_what_is_not_drafts_is_kept(tmp_path: Path) -> None:
    folder = draft.export_ros2(built("hopper", None), tmp_path / "package")
    assert (folder / "meshes" / "trunk.stl").is_file()
    draft.export_ros2(built("arm", None), folder)
    assert not (folder / "meshes").exists()
    assert "project(arm_description)" in (folder / "CMakeLists.txt").read_text()
    (folder / "launch" / "mine.launch.py").write_text("precious")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(draft.DraftError, match=r"not a folder of a ROS 2 package .*mine\.launch"):
        draft.export_ros2(built("hopper", None), folder)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    model = draft.export(built("hopper", None), tmp_path / "model")
    with pytest.raises(draft.DraftError, match="not a folder of a ROS 2 package"):
        draft.export_ros2(built("hopper", None), model)


def test_a_package_that_is_not_finished_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise OSError(28, "full")

    monkeypatch.setattr(saving, "_flush", fails)
    with pytest.raises(draft.DraftError, match="full"):
        draft.export_ros2(built("hopper", None), tmp_path / "package")
    assert not any(tmp_path.iterdir())


def test_the_command_writes_a_package_and_nothing_else(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    told = command.json("export hopper --ros2 ws/src/hopper")
    assert told["out"] == "ws/src/hopper"
    assert [path.name for path in tmp_path.iterdir()] == ["ws"]
    assert (tmp_path / "ws/src/hopper/package.xml").is_file()
    for more in ("--out there", "--format glb"):
        said = command.refuses(f"export hopper --ros2 other {more}")
        assert "omit --out and --format" in said
    assert not (tmp_path / "other").exists()


def test_sdf_and_urdf_of_one_folder_have_a_mesh_each(tmp_path: Path) -> None:
    folder = built("hopper", None).save(tmp_path / "out", ("urdf", "sdf"))
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert found == {
        *("robot.urdf", "robot.sdf", "model.config", "actuators.json", "meshes/trunk.stl"),
        "meshes/trunk.obj",
        *("design.yaml", "report.json"),
    }
    assert np.frombuffer((folder / "meshes/trunk.stl").read_bytes(), np.uint8).size > 84
