"""Robot in mjlab: its unchanged MJCF, driven through mjlab's DC-motor actuators.

One simulation may hold several designs of one topology, one per world: every number of a design is
then a row of a tensor, and world i has design i modulo the number of designs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import mujoco
import numpy as np
import torch
from mjlab.actuator import DcMotorActuatorCfg
from mjlab.entity import Entity, EntityArticulationInfoCfg, EntityCfg
from mjlab.utils.spec_config import CollisionCfg
from numpy.typing import ArrayLike

from draft.design.legs import GRAVITY
from draft.learn.bodies.features import family_features
from draft.learn.bodies.legged import REFERENCE_LEG, LeggedRobot
from draft.learn.bodies.payload import model_spec
from draft.learn.bodies.slots import described, servo_torque
from draft.learn.task.config import Config
from draft.learn.task.constants import Scaled
from draft.learn.task.groups import Actuation


@dataclass
class RobotCfg(EntityCfg):
    """Configuration of one quadruped, or of several of one topology.

    Attributes:
        members: numbers of each design.
        actuation: gains and limits.
        first: index of the first world among those of all processes.
        by_slots: whether the features of a design are those of the slots of all legs.
    """

    members: tuple[LeggedRobot, ...] = ()
    actuation: Actuation = field(default_factory=Actuation)
    first: int = 0
    by_slots: bool = False

    def build(self) -> Robot:
        """Build the entity."""
        return Robot(self)


class Robot(Entity):
    """Quadrupeds of all worlds, and their numbers as tensors.

    Attributes:
        member: index of each world's design, shape (worlds,).
        host_member: the same on the host.
        leg_scale: s = L / 0.48 m, shape (worlds,).
        height: trunk's origin above the ground in the home pose [m], shape (worlds,).
        top_speed: estimated top speed [m/s], shape (worlds,).
        foot_sites: indices of the feet among its sites.
        home: joint angles of the home pose [rad], shape (worlds, joints).
        ranges: joint ranges [rad], shape (worlds, joints, 2).
        redrawn: whether a world was given another design than that which it began with.
        no_load_speed: no-load speed of each joint [rad/s], shape (worlds, joints).
        peak_torque: peak torque of each joint [N m], shape (worlds, joints).
        stall_torque: torque at standstill without the current limit [N m], shape (worlds, joints).
        copper_loss: heat per torque squared [W/(N m)^2], shape (worlds, joints).
        weight: weight of the design, without what the task adds [N], shape (worlds,).
        design: features of the design, shape (worlds, features); see `draft.learn.bodies.features`.
        sign: sign of each joint in its slot, shape (worlds, joints); ones without slots.
        servo_torque: torque that the gains of each joint are for [N m], shape (worlds, joints); see
            `draft.learn.bodies.slots.servo_torque`.
        wheels: indices of the joints that drive wheels, shape (wheels,).
    """

    cfg: RobotCfg
    leg_scale: torch.Tensor
    height: torch.Tensor
    top_speed: torch.Tensor
    peak_torque: torch.Tensor
    stall_torque: torch.Tensor
    no_load_speed: torch.Tensor
    copper_loss: torch.Tensor
    weight: torch.Tensor
    design: torch.Tensor
    home: torch.Tensor
    ranges: torch.Tensor
    sign: torch.Tensor
    servo_torque: torch.Tensor

    def initialize(self, mj_model: mujoco.MjModel, model: Any, data: Any, device: str) -> None:
        """Allocate the state, and give every world the numbers of its design."""
        super().initialize(mj_model, model, data, device)
        members = self.cfg.members
        self.host_member = (self.cfg.first + np.arange(data.nworld)) % len(members)
        self.member = torch.as_tensor(self.host_member, device=device)
        for name, values in self._of_designs(members, device).items():
            setattr(self, name, values[self.member])
        self.redrawn = False
        self.wheels = torch.as_tensor(np.flatnonzero(members[0].rolls), device=device)
        self._motors = torch.ones_like(self.peak_torque)
        self.foot_sites = self.find_sites(members[0].feet, preserve_order=True)[0]
        self._set_gains()
        self._set_state()

    def assume(self, worlds: torch.Tensor, members: Sequence[LeggedRobot]) -> None:
        """Give some worlds the numbers of other designs.

        Args:
            worlds: indices of the worlds, shape (k,).
            members: their designs, k of the same topology.
        """
        self.redrawn = True
        for name, values in self._of_designs(members, worlds.device).items():
            getattr(self, name)[worlds] = values
        self._set_gains()
        self._set_state()

    def _of_designs(
        self, members: Sequence[LeggedRobot], device: str | torch.device
    ) -> dict[str, torch.Tensor]:
        support = self.cfg.actuation.support
        servos: list[ArrayLike] = [one.peak_torque for one in members]
        if self.cfg.by_slots or support:
            slots, features = zip(*described(members), strict=True)
            servos = [servo_torque(*one, support) for one in zip(members, slots, strict=True)]
            if self.cfg.by_slots:
                return _numbers(members, features, [one.signs for one in slots], servos, device)
        signs = [(1.0,) * len(one.joints) for one in members]
        return _numbers(members, family_features(tuple(members)), signs, servos, device)

    def unit_logarithms(self) -> torch.Tensor:
        """Logarithms of sqrt(g L) and sqrt(L / g) of each world's design, shape (worlds, 2)."""
        length = self.leg_scale * REFERENCE_LEG
        return 0.5 * torch.stack(((GRAVITY * length).log(), (length / GRAVITY).log()), dim=1)

    def set_motors(self, factors: torch.Tensor) -> None:
        """Multiply the torque of each motor at any command, also its limits.

        Args:
            factors: shape (worlds, joints); `peak_torque` and `stall_torque` stay nominal.
        """
        self._motors = factors
        self._set_gains()

    def numbers(self) -> dict[str, torch.Tensor]:
        """The numbers of each world's design by name, to save them."""
        return {name: getattr(self, name) for name in NUMBERS}

    def restore(self, numbers: Mapping[str, torch.Tensor]) -> None:
        """Restore saved numbers of each world's design.

        Raises:
            KeyError, RuntimeError: they are not those of these worlds.
        """
        # Earlier states knew straight lines only, and no term of theirs needed masses or heat.
        own = ("weight", "copper_loss", *["sign"] * (not self.cfg.by_slots))
        usual = {name: getattr(self, name) for name in own}
        usual |= dict.fromkeys(("stall_torque", "servo_torque"), numbers["peak_torque"])
        numbers = {**usual, **numbers}
        self.redrawn = True
        for name in NUMBERS:
            getattr(self, name).copy_(numbers[name])
        self._set_gains()
        self._set_state()

    def _set_state(self) -> None:
        """Set the default state and the limits of each world, in place."""
        state = self.data
        state.default_root_state[:, 2] = self.height
        state.default_joint_pos[:] = self.home
        ranges = self.ranges
        middle, half = ranges.mean(-1, keepdim=True), (ranges[..., 1:] - ranges[..., :1]) / 2
        sides = torch.tensor([-1.0, 1.0], device=ranges.device)
        state.joint_pos_limits[:] = ranges
        state.default_joint_pos_limits[:] = ranges
        state.soft_joint_pos_limits[:] = middle + self.cfg.actuation.soft_limits * half * sides

    def scaled(self, number: Scaled) -> torch.Tensor:
        """Return a number at the scale of each world's design, shape (worlds,)."""
        return number.at(self.leg_scale)

    def _set_gains(self) -> None:
        """Set gains and torque-speed lines of each world, in place: mjlab fuses these tensors."""
        stiffness, damping = self.cfg.actuation.stiffness, self.cfg.actuation.damping
        turned = torch.ones_like(self.peak_torque)
        turned[:, self.wheels] = 0.0
        for actuator in self.actuators:
            joints = actuator.target_ids
            factors = self._motors[:, joints]
            torque = factors * self.peak_torque[:, joints]
            stall = factors * self.stall_torque[:, joints]
            servo = factors * self.servo_torque[:, joints]
            values = {
                "stiffness": stiffness * servo * turned[:, joints],
                "damping": damping * servo,
                "force_limit": torque,
                "saturation_effort": stall,
                "velocity_limit_motor": self.no_load_speed[:, joints],
            }
            for name, value in values.items():
                getattr(actuator, name)[:] = value
            for name in ("stiffness", "damping", "force_limit"):
                getattr(actuator, f"default_{name}")[:] = values[name]


NUMBERS = (
    *("leg_scale", "height", "top_speed", "peak_torque", "stall_torque", "no_load_speed", "design"),
    *("home", "ranges", "weight", "copper_loss", "sign", "servo_torque"),
)


def _numbers(
    members: Sequence[LeggedRobot],
    features: Sequence[ArrayLike],
    signs: Sequence[ArrayLike],
    servos: Sequence[ArrayLike],
    device: str | torch.device,
) -> dict[str, torch.Tensor]:
    """Numbers of designs by name, shape (designs, ...)."""
    columns: dict[str, ArrayLike] = {
        "leg_scale": [m.scale for m in members],
        "height": [m.height for m in members],
        "top_speed": [m.top_speed for m in members],
        "peak_torque": [m.peak_torque for m in members],
        "stall_torque": [m.stall_torque for m in members],
        "no_load_speed": [m.no_load_speed for m in members],
        "copper_loss": [m.copper_loss for m in members],
        "weight": [GRAVITY * m.mass for m in members],
        "design": np.array(features),
        "sign": np.array(signs),
        "servo_torque": np.array(servos),
        "home": [m.home for m in members],
        "ranges": [m.ranges for m in members],
    }
    return {
        name: torch.tensor(np.asarray(values), dtype=torch.float32, device=device)
        for name, values in columns.items()
    }


def robot(
    members: tuple[LeggedRobot, ...], config: Config, before: int = 0, by_slots: bool = False
) -> RobotCfg:
    """Configuration of the robot.

    Args:
        members: one design, or several of one topology (see `legged.check_family`).
        config: the numbers.
        before: number of worlds in the processes before this one.
        by_slots: whether the features of a design are those of the slots of all legs.
    """
    first = members[0]
    colliding = list(first.foot_geoms)
    if config.physics.upper_legs_collide:
        colliding += [geom for leg in first.upper_legs for geom in leg]
    if config.physics.all_collide:
        model = mujoco.MjModel.from_xml_string(first.xml)
        touches = np.flatnonzero(model.geom_contype | model.geom_conaffinity)
        colliding = list(dict.fromkeys([*colliding, *(model.geom(int(i)).name for i in touches)]))
    feet = dict.fromkeys(first.foot_geoms, 1)
    return RobotCfg(
        members=members,
        actuation=config.actuation,
        first=before,
        by_slots=by_slots,
        spec_fn=partial(model_spec, first),
        init_state=EntityCfg.InitialStateCfg(
            pos=(0.0, 0.0, first.height),
            joint_pos=dict(zip(first.joints, first.home, strict=True)),
        ),
        articulation=EntityArticulationInfoCfg(
            actuators=_actuators(first, config.actuation),
            soft_joint_pos_limit_factor=config.actuation.soft_limits,
        ),
        sort_actuators=True,
        # A foot's own friction and contact parameters are used on all ground.
        collisions=(
            CollisionCfg(
                geom_names_expr=tuple(colliding),
                contype=0,
                conaffinity=1,
                condim=3,
                priority=feet | {".*": 0},
            ),
        ),
    )


def _actuators(first: LeggedRobot, actuation: Actuation) -> tuple[DcMotorActuatorCfg, ...]:
    """One configuration per kind of motor of the first design; worlds get their own numbers."""
    kinds: dict[tuple[float, float, float], list[str]] = {}
    numbers = zip(first.peak_torque, first.stall_torque, first.no_load_speed, strict=True)
    for joint, kind in zip(first.joints, numbers, strict=True):
        kinds.setdefault(kind, []).append(joint)
    return tuple(
        DcMotorActuatorCfg(
            target_names_expr=tuple(joints),
            stiffness=actuation.stiffness * torque,
            damping=actuation.damping * torque,
            effort_limit=torque,
            saturation_effort=stall,
            velocity_limit=speed,
        )
        for (torque, stall, speed), joints in kinds.items()
    )
