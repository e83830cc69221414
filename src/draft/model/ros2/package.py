"""Files of a package for ROS 2, and its folder.

The package has the type `ament_cmake` and installs its folders. `urdf/robot.urdf` is the robot of
`draft export` with a link at each site; `urdf/robot.urdf.xacro` adds ros2_control and Gazebo, whose
hardware and parameters are arguments. Names are those of Draft, which are words of letters, digits
and underscores.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from draft.design.design import Design
from draft.model.folder import check_target, records, write_folder
from draft.model.model import Model
from draft.model.ros2 import control
from draft.model.shapes import matrix
from draft.model.urdf import DECLARATION, meshes, robot_element, rpy
from draft.model.xml import Element
from draft.values import scalar

_LICENSE = "TODO: License declaration"  # As `ros2 pkg create` has it, with the maintainer below.
_DEPENDS = (
    *("ament_index_python", "controller_manager", "forward_command_controller"),
    *("gz_ros2_control", "imu_sensor_broadcaster", "joint_state_broadcaster"),
    *("joint_state_publisher_gui", "launch", "launch_ros", "robot_state_publisher"),
    *("ros2_control", "ros_gz_bridge", "ros_gz_sim", "rviz2", "xacro"),
)
_SCHEMA = (
    '<?xml-model href="http://download.ros.org/schema/package_format3.xsd" '
    'schematypens="http://www.w3.org/2001/XMLSchema"?>\n'
)
_CMAKE = """\
cmake_minimum_required(VERSION 3.8)
project({name})

find_package(ament_cmake REQUIRED)

install(
  DIRECTORY {folders}
  DESTINATION share/${{PROJECT_NAME}}
)

ament_package()
"""
# Folders of the package, each with the files that it may hold.
_FOLDERS = {
    "config": ("bridge.yaml", "controllers.yaml", "home.yaml", "robot.rviz"),
    "launch": ("display.launch.py", "gazebo.launch.py"),
    "meshes": ("trunk.stl", "part.*.stl"),
    "urdf": ("robot.urdf", "robot.urdf.xacro"),
    "worlds": ("floor.sdf",),
}
_BESIDE = ("CMakeLists.txt", "LICENSE", "package.xml", "design.yaml", "report.json")


def save_package(model: Model, folder: Path) -> Path:
    """Write a package for ROS 2, atomically.

    Args:
        model: the model.
        folder: folder of the package. Everything that Draft wrote there before is removed.

    Returns:
        The folder.

    Raises:
        DraftError: the folder holds files that Draft did not write, or cannot be written.
    """
    known = {*_BESIDE, *_FOLDERS}
    known |= {f"{name}/{file}" for name, files in _FOLDERS.items() for file in files}
    check_target(folder, known, "ROS 2 package")
    return write_folder(folder, package_files(model) | records(model))


def package_name(design: Design) -> str:
    """Name of the package: that of the robot and of its named design, by the rules of ROS.

    It has lower-case letters, digits and single underscores, and begins with a letter.
    """
    words = re.sub("_+", "_", design.reference.replace(":", "_").lower()).strip("_")
    return f"{words if words[:1].isalpha() else f'robot_{words}'.rstrip('_')}_description"


def package_files(model: Model) -> dict[str, str | bytes]:
    """Contents of the files, by path in the package."""
    design, name = model.design, package_name(model.design)
    robot = robot_element(model, f"package://{name}/", gazebo=True)
    frames = _add_frames(robot, model)
    parameters = control.controllers(model, frames)
    kinds = parameters["controller_manager"]["ros__parameters"]
    loaded = [key for key, value in kinds.items() if isinstance(value, dict)]
    efforts = [key for key in loaded if key == control.EFFORTS]
    words = {
        "PACKAGE": name,
        "ROBOT": design.name,
        "HEIGHT": f"{scalar(design.lowest(home=True)) if design.floating else 0.0:.6g}",
        "INACTIVE_CONTROLLERS": repr(efforts),
        "ACTIVE_CONTROLLERS": repr([key for key in loaded if key not in efforts]),
    }
    zeros = {key: scalar(joint.home) for key, joint in control.joints(design).items()}
    home = {"/**": {"ros__parameters": {"zeros": zeros}}}
    files: dict[str, str | bytes] = {
        "LICENSE": f"{_LICENSE}\n\nChoose one: put its text here, and its name in package.xml.\n",
        "config/bridge.yaml": _yaml(control.bridges(model)),
        "config/controllers.yaml": _yaml(parameters),
        "config/home.yaml": _yaml(home),
        "config/robot.rviz": _yaml(
            _rviz("world" if not design.floating else design.bodies[0].name)
        ),
        **{f"launch/{file}": _launch(f"{file}.in", words) for file in _FOLDERS["launch"]},
        **meshes(design),
        "package.xml": _manifest(design, name),
        "urdf/robot.urdf": DECLARATION + robot.text(),
        "urdf/robot.urdf.xacro": _xacro(model, frames),
        "worlds/floor.sdf": _own("floor.sdf"),
    }
    folders = sorted({path.split("/")[0] for path in files if "/" in path})
    return files | {"CMakeLists.txt": _CMAKE.format(name=name, folders=" ".join(folders))}


def _add_frames(robot: Element, model: Model) -> dict[str, str]:
    """Add a link without mass at each site; return their names by that of the site."""
    compiled, taken = model.mujoco, {body.name for body in model.design.bodies}
    frames = {}
    for i in range(compiled.nsite):
        link = f"{compiled.site(i).name}_link"
        while link in taken:
            link += "_"
        taken.add(link)
        frames[compiled.site(i).name] = link
        robot.add("link", name=link)
        weld = f"{link}_weld"
        while weld in model.design.joints:
            weld += "_"
        joint = robot.add("joint", name=weld, type="fixed")
        turn = rpy(matrix(compiled.site_quat[i]))
        joint.add("origin", xyz=compiled.site_pos[i], rpy=turn)
        joint.add("parent", link=compiled.body(compiled.site_bodyid[i]).name)
        joint.add("child", link=link)
    return frames


def _xacro(model: Model, frames: dict[str, str]) -> str:
    namespace = {"xmlns:xacro": "http://www.ros.org/wiki/xacro"}
    root = Element("robot", name=model.design.name, **namespace)
    # Without another one, a system that sets its state to the commands.
    root.add("xacro:arg", name="hardware", default="mock_components/GenericSystem")
    root.add("xacro:arg", name="controllers", default="")
    root.add("xacro:include", filename="robot.urdf")
    control.add_control(root, model)
    control.add_gazebo(root, model, frames)
    return DECLARATION + root.text()


def _manifest(design: Design, name: str) -> str:
    root = Element("package", format="3")
    root.put("name", name)
    root.put("version", "0.0.0")
    root.put("description", f"Description of the robot {design.reference}, written by Draft.")
    root.put("maintainer", "user", email="user@todo.todo")
    root.put("license", _LICENSE)
    root.put("buildtool_depend", "ament_cmake")
    for package in _DEPENDS:
        root.put("exec_depend", package)
    root.add("export").put("build_type", "ament_cmake")
    return DECLARATION + _SCHEMA + root.text()


def _rviz(fixed: str) -> dict[str, Any]:
    def display(kind: str, **more: Any) -> dict[str, Any]:
        return {"Class": f"rviz_default_plugins/{kind}", "Name": kind, "Enabled": True, **more}

    topic = {"Value": "/robot_description", "Durability Policy": "Transient Local"}
    robot = {"Description Source": "Topic", "Description Topic": topic}
    view = {"Class": "rviz_default_plugins/Orbit", "Distance": 2.5, "Pitch": 0.3, "Yaw": 0.8}
    return {
        "Panels": [{"Class": "rviz_common/Displays", "Name": "Displays"}],
        "Visualization Manager": {
            "Class": "",
            "Displays": [display("Grid"), display("RobotModel", **robot), display("TF")],
            "Global Options": {"Fixed Frame": fixed, "Frame Rate": 30},
            "Tools": [{"Class": "rviz_default_plugins/MoveCamera"}],
            "Views": {"Current": view},
        },
    }


def _launch(file: str, words: Mapping[str, str]) -> str:
    """Text of a launch file with the words of the robot in the places of those in capitals."""
    return re.sub(r"\b({})\b".format("|".join(words)), lambda found: words[found[0]], _own(file))


def _own(file: str) -> str:
    """Text of a file beside this one."""
    return Path(__file__).with_name(file).read_text(encoding="utf-8")


def _yaml(data: Any) -> str:
    return yaml.safe_dump(data, sort_keys=False)
