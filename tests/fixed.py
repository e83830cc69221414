"""Robots on fixed bases for tests, each of two files: an arm of six joints, and a hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco

import draft

ARM_PARAMETERS = """\
name: tester_arm
doc: Six joints in series on a pedestal, for tests.
population: humanoid
parameters:
  upper_arm_length: {value: 0.40, unit: m, range: [0.2, 0.8], doc: Shoulder to elbow.}
  forearm_length: {value: 0.35, unit: m, range: [0.2, 0.8], doc: Elbow to wrist.}
  pedestal_height: {value: 0.15, unit: m, range: [0.05, 0.5], doc: Floor to shoulder.}
  pedestal_mass: {value: 5, unit: kg, range: [0, 50], doc: Mass of the pedestal.}
actuators:
  large: {peak_torque: 150, no_load_speed: 4, gear_ratio: 100, mass: 2.0}
  small: {peak_torque: 40, no_load_speed: 6, gear_ratio: 100, mass: 0.7}
"""
ARM_TREE = """\
tree:
  name: base
  type: fixed
  pedestal: {size: [0.2, 0.2, pedestal_height], mass: pedestal_mass}
  children:
    - {chain: arm, at: [0, 0, pedestal_height + large.length / 2]}
chains:
  arm:
    - name: foundation
      motor: {actuator: large, axis: z}
    - name: shoulder
      joint: {name: pan, axis: z, range: [-3, 3], actuator: large}
      link: {axis: z, length: 0.15, mass: 0.8}
      motor: {actuator: large, axis: y}
    - name: upper_arm
      joint: {name: lift, axis: y, range: [-2, 2], home: 0.6, actuator: large}
      link: {axis: z, length: upper_arm_length, mass: 2.0}
      motor: {actuator: large, axis: y}
    - name: forearm
      joint: {name: elbow, axis: y, range: [-2.6, 2.6], home: 0.9, actuator: large}
      link: {axis: z, length: forearm_length, mass: 1.2}
      motor: {actuator: small, axis: y}
    - name: wrist
      joint: {name: pitch, axis: y, range: [-2, 2], home: 0.4, actuator: small}
      link: {axis: z, length: 0.12, mass: 0.3}
      motor: {actuator: small, axis: z}
    - name: roll
      joint: {name: roll, axis: z, range: [-3, 3], actuator: small}
      link: {axis: z, length: 0.1, mass: 0.2}
      motor: {actuator: small, axis: x}
    - name: tool
      type: box
      joint: {name: yaw, axis: x, range: [-2, 2], home: 0.2, actuator: small}
      box: {size: [0.05, 0.08, 0.1], mass: 0.5, shift: [0, 0, 0.06], site: grasp}
"""
FINGER = """\
  finger:
    - name: knuckle
      motor: {actuator: servo, axis: y}
    - name: proximal
      joint: {name: proximal, axis: y, range: [-0.2, 1.6], home: 0.3, actuator: servo}
      link: {axis: x, length: 0.05, mass: 0.03}
      motor: {actuator: servo, axis: y, shift: [0, 0.03, 0]}
    - name: distal
      type: sphere
      joint: {name: distal, axis: y, range: [-0.2, 1.6], home: 0.3, actuator: servo}
      link: {axis: x, length: 0.04, mass: 0.02}
      sphere: {radius: 0.012, mass: 0.01, site: tip}
"""
HAND_PARAMETERS = """\
name: tester_hand
population: humanoid
parameters: {}
actuators:
  servo: {peak_torque: 1.0, no_load_speed: 8, gear_ratio: 200, mass: 0.05}
"""
HAND_TREE = f"""\
tree:
  name: palm
  type: fixed
  at: [0, 0, 0.3]
  rpy: [0.2, -0.4, 1.0]
  pedestal: {{radius: 0.05, height: 0.03}}
  children:
    - {{chain: finger, prefix: index_, at: [0.08, 0.12, 0.05]}}
    - {{chain: finger, prefix: middle_, at: [0.08, 0, 0.05]}}
    - {{chain: finger, prefix: ring_, at: [0.08, -0.12, 0.05]}}
    - {{chain: finger, prefix: thumb_, at: [-0.08, 0, 0.05], rpy: [0, 0, pi]}}
chains:
{FINGER}"""
ARM = {"parameters.yaml": ARM_PARAMETERS, "tree.yaml": ARM_TREE}
HAND = {"parameters.yaml": HAND_PARAMETERS, "tree.yaml": HAND_TREE}


def arm() -> draft.Spec:
    """Six joints in series on a pedestal."""
    return draft.Spec.parse(ARM)


def hand() -> draft.Spec:
    """Four fingers on a tilted palm, which weighs nothing."""
    return draft.Spec.parse(HAND)


def pendulum(home: float = 0.0, **base: Any) -> draft.Spec:
    """A base without a solid, and one driven link that points along its x axis.

    Args:
        home: angle of the home pose [rad].
        base: further keys of the base.
    """
    joint = {"name": "swing", "axis": "y", "range": [-3, 3], "home": home, "actuator": "leg"}
    link = {
        "name": "arm",
        "joint": joint,
        "link": {"axis": "x", "length": "length", "mass": "mass"},
    }
    children = [{"name": "housing", "motor": {"actuator": "leg", "axis": "y"}, "children": [link]}]
    numbers = {"length": 0.5, "mass": 2.0, "high": 0.7}
    return draft.Spec.parse(
        {
            "parameters.yaml": {
                "name": "pendulum",
                "population": "humanoid",
                "parameters": {
                    name: {"value": value, "unit": "1", "range": [0.01, 20], "doc": "A number."}
                    for name, value in numbers.items()
                },
                "actuators": {"leg": {"peak_torque": 60, "no_load_speed": 20, "gear_ratio": 15}},
            },
            "tree.yaml": {"tree": {"name": "base", "type": "fixed", "children": children, **base}},
        }
    )


ARM_AND_HAND = {
    "parameters.yaml": ARM_PARAMETERS.replace("tester_arm", "tester_arm_and_hand")
    + "  servo: {peak_torque: 1.0, no_load_speed: 8, gear_ratio: 200, mass: 0.05}\n",
    "tree.yaml": ARM_TREE
    + """\
      children:
        - {chain: finger, prefix: left_, at: [0.06, 0, 0.12], rpy: [0, -pi / 2, 0]}
        - {chain: finger, prefix: right_, at: [-0.06, 0, 0.12], rpy: [0, -pi / 2, pi]}
"""
    + FINGER,
}


def arm_and_hand() -> draft.Spec:
    """The arm, with two fingers on its tool."""
    return draft.Spec.parse(ARM_AND_HAND)


def planar(joints: int = 2, low: float = -3.0, high: float = 3.0) -> draft.Spec:
    """Links on parallel level axes, in a row along x at zero; nearly weightless but for `mass`.

    Parameters: `length_K`, `home_K` and `mass_K` of each link.
    """
    numbers = {}
    chain: list[dict[str, Any]] = [{"name": "housing", "motor": {"actuator": "drive", "axis": "y"}}]
    for k in range(joints):
        numbers |= {f"length_{k}": 0.3, f"home_{k}": 0.4, f"mass_{k}": 1.0}
        joint = {"name": f"joint_{k}", "axis": "y", "range": [low, high], "home": f"home_{k}"}
        chain.append(
            {
                "name": f"link_{k}",
                "joint": joint | {"actuator": "drive"},
                "link": {"axis": "x", "length": f"length_{k}", "mass": f"mass_{k}"},
            }
        )
        if k < joints - 1:
            chain[-1]["motor"] = {"actuator": "drive", "axis": "y"}
    drive = {"peak_torque": 60, "no_load_speed": 8, "gear_ratio": 50, "mass": 1e-6}
    tree = {"name": "base", "type": "fixed", "at": [0, 0, 2], "children": [{"chain": "limb"}]}
    return draft.Spec.parse(
        {
            "parameters.yaml": {
                "name": "planar",
                "population": "humanoid",
                "parameters": {
                    name: {"value": value, "unit": "1", "range": [-3, 20], "doc": "A number."}
                    for name, value in numbers.items()
                },
                "actuators": {"drive": drive},
            },
            "tree.yaml": {"chains": {"limb": chain}, "tree": tree},
        }
    )


def servo_finger(long: str, spread: bool = False) -> draft.Spec:
    """Two servos, 40 mm from each other, with a hinge between them about y.

    Args:
        long: direction in which the box of the first one extends, along z to the second one.
        spread: whether the second one is beside the first one at the other end of the range.
    """
    chain = [
        {"name": "housing", "motor": {"actuator": "servo", "axis": "y", "long": long}},
        {
            "name": "first",
            "joint": {
                **{"name": "bend_1", "axis": "y", "actuator": "servo"},
                "range": [0, "pi / 2" if spread else 0.1],
            },
            "link": {"axis": "z", "length": 0.04, "mass": 0.01},
            "motor": {"actuator": "servo", "axis": "y"},
        },
        {
            "name": "second",
            "joint": {"name": "bend_2", "axis": "y", "range": [0, 1], "actuator": "servo"},
            "link": {"axis": "z", "length": 0.04, "mass": 0.01},
        },
    ]
    parameters = {
        **{"name": "servo_finger", "population": "humanoid", "parameters": {}},
        "actuators": {"servo": {"like": "XC330-M288"}},
    }
    tree = {"name": "base", "type": "fixed", "at": [0, 0, 1], "children": [{"chain": "finger"}]}
    files = {
        "parameters.yaml": parameters,
        "tree.yaml": {"chains": {"finger": chain}, "tree": tree},
    }
    return draft.Spec.parse(files)


def posed(model: mujoco.MjModel, positions: Mapping[str, float]) -> mujoco.MjData:
    """Data of a model at rest, with joints at positions [rad or m] by name and others at zero."""
    data = mujoco.MjData(model)
    for name, position in positions.items():
        data.qpos[model.joint(name).qposadr[0]] = position
    mujoco.mj_forward(model, data)
    return data
