"""Drives and sensors of a package for ROS 2: ros2_control, Gazebo's sensors, parameters.

Every driven joint takes a torque up to the peak of its motor, and every joint reports position and
velocity. A joint that follows another has no command: its `mimic` is in the URDF. The inertial
sensor is at the site `imu`; each foot has a contact sensor on the shape that meets the floor.
Gazebo makes SDFormat of the URDF, where joints and links share their names.
"""

from __future__ import annotations

from typing import Any

from draft.design.design import Design
from draft.design.parts import Joint
from draft.model.model import Model
from draft.model.scene import TIMESTEP
from draft.model.shapes import shapes
from draft.model.urdf import distinct_name, joint_name
from draft.model.xml import Element
from draft.values import scalar

IMU = "imu"
BROADCASTER, EFFORTS, IMU_BROADCASTER = (
    "joint_state_broadcaster",
    "effort_controller",
    "imu_sensor_broadcaster",
)
RATE = round(1 / TIMESTEP)  # Of controllers and sensors [1/s].
_XYZ = ("x", "y", "z")


def joints(design: Design) -> dict[str, Joint]:
    """Joints by their name in the package, which differs from that of every link."""
    return {distinct_name(design, name): joint for name, joint in design.joints.items()}


def add_control(root: Element, model: Model) -> None:
    """Add the block of ros2_control, whose hardware is an argument of xacro."""
    block = root.add("ros2_control", name=model.design.name, type="system")
    block.add("hardware").put("plugin", "$(arg hardware)")
    for name, joint in joints(model.design).items():
        element = block.add("joint", name=name)
        if (drive := model.design.drive(joint)) is not None:
            command, peak = element.add("command_interface", name="effort"), drive.peak_torque
            command.put("param", -scalar(peak), name="min")
            command.put("param", scalar(peak), name="max")
        state = element.add("state_interface", name="position")
        state.put("param", scalar(joint.home), name="initial_value")
        element.add("state_interface", name="velocity")
    if has_imu(model):
        sensor = block.add("sensor", name=IMU)
        for quantity, axes in (
            ("orientation", (*_XYZ, "w")),
            ("angular_velocity", _XYZ),
            ("linear_acceleration", _XYZ),
        ):
            for axis in axes:
                sensor.add("state_interface", name=f"{quantity}.{axis}")


def add_gazebo(root: Element, model: Model, frames: dict[str, str]) -> None:
    """Add what Gazebo reads besides the URDF.

    Args:
        root: element to add to.
        model: the model.
        frames: links of the sites by name of the site.
    """
    plugin = root.add("gazebo").add(
        "plugin",
        filename="gz_ros2_control-system",
        name="gz_ros2_control::GazeboSimROS2ControlPlugin",
    )
    plugin.put("parameters", "$(arg controllers)")
    for body in model.design.bodies:
        if body.joint is None and body.parent is not None:
            # Else Gazebo makes one link of the two.
            weld = distinct_name(model.design, joint_name(model.design, body))
            welded = root.add("gazebo", reference=weld)
            welded.put("preserveFixedJoint", "true")
    if has_imu(model):
        sensor = root.add("gazebo", reference=frames[IMU]).add("sensor", name=IMU, type="imu")
        sensor.put("always_on", "true")
        sensor.put("update_rate", RATE)
        sensor.put("topic", IMU)
    for name, (body, collision) in feet(model).items():
        sensor = root.add("gazebo", reference=body).add("sensor", name=name, type="contact")
        sensor.put("always_on", "true")
        sensor.put("update_rate", RATE)
        contact = sensor.add("contact")
        contact.put("collision", collision)
        contact.put("topic", _topic(name))


def has_imu(model: Model) -> bool:
    """Whether it has the site of an inertial sensor."""
    return any(model.mujoco.site(i).name == IMU for i in range(model.mujoco.nsite))


def feet(model: Model) -> dict[str, tuple[str, str]]:
    """Body of each foot, and the name that Gazebo gives to its collision, by name of its site."""
    found = {}
    drawn = [shape for shape in shapes(model.mujoco, model.design) if shape.collides]
    for i in model.design.feet:
        own = [shape.name for shape in drawn if shape.body == i + 1]
        sites = [s for s in range(model.mujoco.nsite) if model.mujoco.site_bodyid[s] == i + 1]
        ends = [k for k, name in enumerate(own) if name.endswith("_end")]
        if sites and ends:
            # Gazebo names the collisions of a link after those of the URDF, and counts from the
            # second one on.
            count = f"_{ends[0]}" if ends[0] else ""
            collision = f"{own[ends[0]]}_collision_collision{count}"
            found[model.mujoco.site(sites[0]).name] = (model.design.bodies[i].name, collision)
    return found


def controllers(model: Model, frames: dict[str, str]) -> dict[str, Any]:
    """Parameters of the controllers, for controllers.yaml."""
    design = model.design
    kinds = {BROADCASTER: "joint_state_broadcaster/JointStateBroadcaster"}
    own: dict[str, Any] = {}
    if driven := [name for name, joint in joints(design).items() if design.drive(joint)]:
        kinds[EFFORTS] = "forward_command_controller/ForwardCommandController"
        own[EFFORTS] = {"joints": driven, "interface_name": "effort"}
    if has_imu(model):
        kinds[IMU_BROADCASTER] = "imu_sensor_broadcaster/IMUSensorBroadcaster"
        own[IMU_BROADCASTER] = {"sensor_name": IMU, "frame_id": frames[IMU]}
    manager = {"update_rate": RATE, **{name: {"type": kind} for name, kind in kinds.items()}}
    return {
        name: {"ros__parameters": values}
        for name, values in {"controller_manager": manager, **own}.items()
    }


def bridges(model: Model) -> list[dict[str, str]]:
    """Topics that Gazebo passes on to ROS, for bridge.yaml."""
    contacts = {
        _topic(name): ("ros_gz_interfaces/msg/Contacts", "Contacts") for name in feet(model)
    }
    topics = {"/clock": ("rosgraph_msgs/msg/Clock", "Clock"), **contacts}
    return [
        {
            "ros_topic_name": topic,
            "gz_topic_name": topic,
            "ros_type_name": ros,
            "gz_type_name": f"gz.msgs.{gazebo}",
            "direction": "GZ_TO_ROS",
        }
        for topic, (ros, gazebo) in topics.items()
    ]


def _topic(foot: str) -> str:
    return f"/contacts/{foot}"
