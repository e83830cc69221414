"""Numbers of a controller by name: one table for the header, the file of Python and the README."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.policy.policy import Policy
from draft.learn.policy.walk import FALL

_COMMAND_TIMEOUT = 0.5  # [s]
_GRAVITY_ERROR = 0.1  # Of the length of a unit vector.
_MARGIN = 0.1  # Feet on the ground push a joint a little over its end [rad].
_SPEEDS = 1.5  # Speed at which a joint stops, per no-load speed.
_PERIODS = 2  # Control periods that may pass without a measurement or a step.


class Number(NamedTuple):
    """A number of a controller, or one for each joint or each entry.

    Attributes:
        value: the number; of names a tuple of texts.
        unit: its unit; "" for none.
        doc: what it is.
    """

    value: NDArray[np.generic] | float | tuple[str, ...]
    unit: str
    doc: str


def numbers(policy: Policy, member: LeggedRobot) -> dict[str, Number]:
    """Numbers of the controller of a policy.

    Args:
        policy: the policy with the joints of the robot.
        member: the robot.

    Raises:
        DraftError: one is not finite.
    """
    low, high = np.array([member.ranges[member.joints.index(one)] for one in policy.joints]).T
    no_load = policy.no_load_speed
    found = {
        "joint_names": Number(policy.joints, "", "joints in the order of all arrays"),
        "control_period": Number(policy.control_period, "s", "time between two actions"),
        "timestep": Number(policy.timestep, "s", "time between two torques in training"),
        "timeout": Number(
            _PERIODS * policy.control_period,
            "s",
            "longest time since, or until, a measurement or the last step",
        ),
        "command_timeout": Number(
            _COMMAND_TIMEOUT, "s", "time since, or until, a command at which it counts as zero"
        ),
        "tilt": Number(FALL.tilt, "rad", "tilt of the trunk that stops, a fall in training"),
        "gravity_error": Number(_GRAVITY_ERROR, "1", "largest error of gravity's unit length"),
        "margin": Number(_MARGIN, "rad", "angle beyond its range at which a joint stops"),
        "command": Number(
            np.array(policy.commands), "m/s, m/s, rad/s", "largest vx, vy and wz, either way"
        ),
        "sign": Number(policy.sign, "1", "-1 where a joint turns the other way than in training"),
        "rolls": Number(policy.rolls, "", "whether a joint drives a wheel, to a speed"),
        "home": Number(policy.home, "rad", "home pose"),
        "low": Number(low, "rad", "lower end of the range"),
        "high": Number(high, "rad", "upper end of the range"),
        "action_scale": Number(
            policy.action_scale, "rad, rad/s of a wheel", "offset per unit of action"
        ),
        "stiffness": Number(policy.stiffness, "N m/rad", "gain kp"),
        "damping": Number(policy.damping, "N m s/rad", "gain kd"),
        "stop_damping": Number(policy.damping, "N m s/rad", "gain kd of a stop"),
        "peak_torque": Number(policy.peak_torque, "N m", "largest torque at the joint"),
        "stall_torque": Number(
            policy.stall_torque, "N m", "torque at speed zero of the motor's line, without limit"
        ),
        "no_load_speed": Number(no_load, "rad/s", "speed of the joint without a load"),
        "speed_limit": Number(_SPEEDS * no_load, "rad/s", "speed at which a joint stops"),
        "design": Number(policy.features, "1", "features of the body"),
        **_trim(policy),
        **_network(policy),
    }
    for name, number in found.items():
        if name != "joint_names" and not np.isfinite(np.asarray(number.value, float)).all():
            cause = f"{name.replace('_', ' ')} of {policy.file} is not finite"
            raise DraftError(cause, "export the policy again")
    return found


def _trim(policy: Policy) -> dict[str, Number]:
    """Numbers of the trim of a policy that has one."""
    trim = policy.trim
    if not trim:
        return {}
    added = "what is added to the command, and to gravity ahead and to the left"
    return {
        "trim_rate": Number(trim.rate, "1/s, 1/s, 1/s, 1/m, 1/m", f"rates of {added}"),
        "trim_most": Number(trim.most, "m/s, m/s, rad/s, 1, 1", f"largest size of {added}"),
        "trim_ends": Number(trim.ends, "m/s, m/s, rad/s", "largest command that it leads to"),
    }


def _network(policy: Policy) -> dict[str, Number]:
    """Normalisation and layers of the network, in single precision as in its file."""
    mean, divisor, layers = policy.network.layers()
    found = {
        "mean": Number(mean, "", "mean of each entry of the observation"),
        "divisor": Number(divisor, "", "its standard deviation"),
    }
    for i, (weight, bias) in enumerate(layers):
        found[f"weight_{i}"] = Number(weight, "", f"weights of layer {i}")
        found[f"bias_{i}"] = Number(bias, "", f"biases of layer {i}")
    return found
