"""Configurations of a robot for mjlab and for Isaac Lab: Python files beside its MJCF or URDF.

Motors are the DC motors of both: torque = stiffness (target - angle) - damping speed, within the
peak torque and the line of torque over speed. Gains are those of the servos in `scene.xml`; a
driven wheel has no stiffness, and follows a speed. A joint without a motor has no actuator.
"""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

from draft.design.design import Design
from draft.model.urdf import actuators
from draft.values import scalar

if TYPE_CHECKING:
    from draft.model.model import Model

_MJLAB = '''\
"""{reference} in mjlab: MJCF, motors and home pose.

Written by Draft; write it again rather than edit it. In the configuration of a scene:

    entities={{"robot": robot_cfg()}}
"""

from pathlib import Path

import mujoco
from mjlab.actuator import DcMotorActuatorCfg
from mjlab.entity import EntityArticulationInfoCfg, EntityCfg

# Armatures, friction and ranges of the joints are in the MJCF.
MJCF = Path(__file__).with_name("robot.xml")
HOME = {home}
ACTUATORS = (
{actuators})


def spec() -> mujoco.MjSpec:
    return mujoco.MjSpec.from_file(str(MJCF))


def robot_cfg() -> EntityCfg:
    return EntityCfg(
        spec_fn=spec,
        init_state=EntityCfg.InitialStateCfg(pos=(0.0, 0.0, {height}), joint_pos=dict(HOME)),
        articulation=EntityArticulationInfoCfg(actuators=ACTUATORS),
        sort_actuators=True,
    )
'''
_ISAAC = '''\
"""{reference} in Isaac Lab: URDF, motors and home pose.

Written by Draft for Isaac Lab 2.3 with Isaac Sim 5; write it again rather than edit it. In the
configuration of a scene:

    robot: ArticulationCfg = ROBOT_CFG.replace(prim_path="{{ENV_REGEX_NS}}/Robot")
"""

from pathlib import Path

import isaaclab.sim as sim_utils
from isaaclab.actuators import DCMotorCfg
from isaaclab.assets import ArticulationCfg

HOME = {home}
ROBOT_CFG = ArticulationCfg(
    spawn=sim_utils.UrdfFileCfg(
        asset_path=str(Path(__file__).with_name("robot.urdf")),
        fix_base={fixed},
        merge_fixed_joints=False,
        activate_contact_sensors=True,
        # The actuators below compute the torques.
        joint_drive=sim_utils.UrdfFileCfg.JointDriveCfg(
            gains=sim_utils.UrdfFileCfg.JointDriveCfg.PDGainsCfg(stiffness=0.0, damping=0.0)
        ),
    ),
    init_state=ArticulationCfg.InitialStateCfg(pos=(0.0, 0.0, {height}), joint_pos=HOME),
    actuators={{
{actuators}    }},
)
'''
# Field of a configuration of motors, and key of the table of the actuators.
_MOTOR = {
    "stiffness": "kp",
    "damping": "kd",
    "effort_limit": "peak_torque",
    "saturation_effort": "stall_torque",
    "velocity_limit": "no_load_speed",
}
# What the MJCF has and the URDF has not, or not for Isaac Sim.
_JOINT = {
    "armature": "armature",
    "friction": "friction_loss",
    "dynamic_friction": "friction_loss",
    "viscous_friction": "damping",
}


def mjlab_py(model: Model) -> str:
    """Text of the configuration for mjlab; it refers to `robot.xml` in the same folder."""
    text = ""
    for joints, numbers in _groups(model.design, _MOTOR).values():
        fields = {"target_names_expr": _listed("()", joints, 8)} | numbers
        text += _call("    DcMotorActuatorCfg(", fields, 4)
    return _MJLAB.format(actuators=text, **_words(model.design))


def isaaclab_py(model: Model) -> str:
    """Text of the configuration for Isaac Lab; it refers to `robot.urdf` in the same folder."""
    text = ""
    for name, (joints, numbers) in _groups(model.design, _MOTOR | _JOINT).items():
        fields = {"joint_names_expr": _listed("[]", joints, 12)} | numbers
        text += _call(f'        "{name}": DCMotorCfg(', fields, 8)
    return _ISAAC.format(actuators=text, **_words(model.design))


def _groups(design: Design, fields: dict[str, str]) -> dict[str, tuple[list[str], dict[str, str]]]:
    """Joints whose motors have the same numbers, and these, by the name of their class."""
    found: dict[tuple[str, ...], list[str]] = {}
    for joint, one in actuators(design)["joints"].items():
        if "kp" in one:
            numbers = {"stall_torque": one["peak_torque"], **one}
            key = one["class"], *(_number(scalar(numbers[name])) for name in fields.values())
            found.setdefault(key, []).append(joint)
    groups: dict[str, tuple[list[str], dict[str, str]]] = {}
    for (name, *numbers), joints in found.items():
        count = sum(one[0] == name for one in found)
        label = name if count == 1 else f"{name}_{joints[0]}"
        groups[label] = joints, dict(zip(fields, numbers, strict=True))
    return groups


def _words(design: Design) -> dict[str, str]:
    """What both files say of a design."""
    home = {name: _number(scalar(joint.home)) for name, joint in design.joints.items()}
    rows = "".join(f'    "{name}": {angle},\n' for name, angle in home.items())
    return {
        "reference": design.reference,
        "home": f"{{\n{rows}}}" if rows else "{}",
        "height": _number(scalar(design.lowest(home=True)) if design.floating else 0.0),
        "fixed": str(not design.floating),
    }


def _call(begin: str, fields: dict[str, str], indent: int) -> str:
    space = " " * indent
    rows = "".join(f"{space}    {name}={value},\n" for name, value in fields.items())
    return f"{begin}\n{rows}{space}),\n"


def _listed(brackets: str, names: list[str], indent: int) -> str:
    """Tuple or list of names, on lines of their own."""
    space = " " * indent
    text = " ".join(f'"{name}",' for name in names)
    lines = fill(
        text,
        96,
        initial_indent=f"{space}    ",
        subsequent_indent=f"{space}    ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    return f"{brackets[0]}\n{lines}\n{space}{brackets[1]}"


def _number(value: float) -> str:
    """Number with ten significant digits, as all formats have it."""
    return repr(float(f"{value:.10g}"))
