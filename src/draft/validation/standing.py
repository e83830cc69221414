"""Load that a standing robot holds, from its MuJoCo model in the crouch.

It is `draft.metrics.payload_rated` and `payload_peak` for masses of any origin.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.design import Design
from draft.design.legs import GRAVITY, crouch, legs
from draft.learn.bodies.legged import LeggedRobot
from draft.values import Array, scalar


@dataclass(frozen=True)
class Standing:
    """Static loads of the joints of the legs in the crouch.

    Attributes:
        torque: torque that holds each joint with the robot alone [N m], shape (joints,).
        per_mass: change of it per mass on the trunk [N m/kg], shape (joints,).
        peak, rated: limits of each joint's motor [N m], shape (joints,).
        loss: heat per torque squared [W/(N m)^2], shape (joints,).
    """

    torque: Array
    per_mass: Array
    peak: Array
    rated: Array
    loss: Array

    def payload(self, limit: Array) -> float:
        """Mass on the trunk at which the first joint reaches its limit [kg]."""
        loaded = np.abs(self.per_mass) > 0
        towards = np.sign(self.per_mass[loaded]) * self.torque[loaded]
        return float(np.min((limit[loaded] - towards) / np.abs(self.per_mass[loaded])))

    @property
    def heat(self) -> float:
        """Heat of the motors with the robot alone [W]."""
        return float(self.loss @ self.torque**2)


def standing(member: LeggedRobot, design: Design) -> Standing:
    """Static loads of a robot, in the crouch and with the motors of a design.

    Args:
        member: the robot; its masses count.
        design: its design; crouch, limits and losses are taken from it.
    """
    model = mujoco.MjModel.from_xml_string(member.xml)
    data = mujoco.MjData(model)
    data.qpos[3] = 1.0
    kinds = legs(design)
    driven = {}
    for leg in kinds:
        for joint in leg.joints:
            for name in joint.names:
                if joint.actuator is not None:
                    driven[name] = joint.actuator
    for name, angle in crouch(design).items():
        data.qpos[model.joint(name).qposadr[0]] = scalar(angle)
    mujoco.mj_forward(model, data)
    mass = float(model.body_mass.sum())
    lift = np.zeros(model.nv)
    for foot in (foot for leg in kinds for foot in leg.feet):
        link = design.bodies[foot]
        body = model.body(link.name).id
        tip = data.xmat[body].reshape(3, 3) @ [scalar(x) for x in link.link.tip]
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, data.xpos[body] + tip, body)
        lift += jacobian[2] / len(member.feet)
    at = [model.joint(name).dofadr[0] for name in driven]
    motors = list(driven.values())
    column = {
        name: np.array([scalar(getattr(motor, name)) for motor in motors])
        for name in ("peak_torque", "rated_torque", "copper_loss")
    }
    return Standing(
        torque=data.qfrc_bias[at] - mass * GRAVITY * lift[at],
        per_mass=-GRAVITY * lift[at],
        peak=column["peak_torque"],
        rated=column["rated_torque"],
        loss=column["copper_loss"],
    )
