"""Controller that runs a policy in plain MuJoCo: observations, actions and torques."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from draft.errors import DraftError
from draft.learn.policy.matching import ANGLES, OF_JOINTS
from draft.learn.policy.policy import DESIGN, Policy
from draft.learn.policy.trim import START
from draft.learn.task.recipes import LAPTOP

_OFFSET = LAPTOP.config.episodes.joints  # Largest offset of a joint at the start [rad].
Array = NDArray[np.float64]
_HIDDEN = 5  # Group of the robot's geoms, which a height scan ignores.


class Controller:
    """Controller of the robot of a MuJoCo model with a policy.

    The model is that of `robot.xml` or `scene.xml`, or has the same joints and sensors. Torques are
    applied directly to the joints, within the torque-speed line, at every physics step; the
    model's own servos are switched off, and its time step is set to that of the training.

    Attributes:
        advance: physics step with the torques in `qfrc_applied`; that of MuJoCo by default.
    """

    def __init__(self, policy: Policy, model: mujoco.MjModel) -> None:
        """Find the robot in a model.

        Args:
            policy: the policy.
            model: the model; its `opt` is changed as described above.

        Raises:
            DraftError: it lacks a joint, a sensor or a floating base, or the policy has an
                observation that a controller cannot compute.
        """
        self.policy, self.model = policy, model
        self.advance: Callable[[mujoco.MjModel, mujoco.MjData], None] = mujoco.mj_step
        unknown = [name for name, _ in policy.terms if name not in _TERMS]
        if unknown:
            cause = f"the policy observes {', '.join(unknown)}, which a controller cannot compute"
            remedy = f"use one that observes only {', '.join(sorted(_TERMS))}"
            raise DraftError(cause, remedy)
        joints = [_joint(model, name) for name in policy.joints]
        self._q, self._v = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        base = model.jnt_bodyid[0] if model.njnt else 0
        if not model.njnt or model.jnt_type[0] != mujoco.mjtJoint.mjJNT_FREE:
            remedy = "use a model that Draft built"
            raise DraftError("the model's first joint is not a free joint", remedy)
        self._trunk = int(base)
        self._sensors = [_sensor(model, name) for name in ("imu_lin_vel", "imu_ang_vel")]
        model.opt.timestep = policy.timestep
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
        self._decimation = round(policy.control_period / policy.timestep)
        self._action = np.zeros(len(policy.joints))
        self._past: list[Mapping[str, Array]] = []  # Terms of the last steps.
        self._trim = START  # State of the policy's trim.
        self._since = 0
        # Rays use a copy in which the robot's own geoms have a group of their own.
        self._sight = copy.copy(model)
        own = model.body_rootid[model.geom_bodyid] == model.body_rootid[self._trunk]
        self._sight.geom_group[own] = _HIDDEN
        self._seen = np.ones(6, np.uint8)
        self._seen[_HIDDEN] = 0

    @property
    def positions(self) -> NDArray[np.int32]:
        """Addresses of the joints in `qpos`, in the order of the policy, shape (joints,)."""
        return self._q

    @property
    def dofs(self) -> NDArray[np.int32]:
        """Addresses of the joints in `qvel`, in the order of the policy, shape (joints,)."""
        return self._v

    def resume(self, other: Controller) -> None:
        """Continue where another controller of the same joints stopped."""
        self._action, self._since = other._action.copy(), other._since
        self._past, self._trim = list(other._past), other._trim

    def reset(self, data: mujoco.MjData, seed: int = 0) -> None:
        """Put the robot near its home pose, at the model's first keyframe if it has one.

        In a symmetric state, a mirror-symmetric policy would always move left and right legs
        alike, and fall. Joints therefore start with offsets from the home angles, as in training.

        Args:
            data: state of the model.
            seed: seed of the offsets.
        """
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, data, 0)
        else:
            mujoco.mj_resetData(self.model, data)
        data.qpos[self._q] = self.policy.home + start_offsets(self.policy, seed)
        self._action, self._past = np.zeros_like(self._action), []
        self._trim = START
        self._since = 0
        mujoco.mj_forward(self.model, data)

    def step(self, data: mujoco.MjData, command: ArrayLike) -> None:
        """Advance by one physics step; the policy acts at its control rate.

        Args:
            data: state of the model.
            command: vx and vy [m/s] and wz [rad/s] in the trunk's frame.

        Raises:
            DraftError: the simulation or the policy gives values that are not finite.
        """
        if self._since == 0:
            parts = self._parts(data, command)
            self._action = self.policy(self._joined(parts)).astype(float)
            steps = [*self._past, parts]
            self._past = steps[max(0, len(steps) + 1 - max(self.policy.history)) :]
            moving = np.append(parts["base_lin_vel"][:2], parts["base_ang_vel"][2])
            self._trim = self.policy.trim.next(
                self._trim, command, moving, self.policy.control_period
            )
            if not np.isfinite(self._action).all():
                cause = "the policy or the simulation gives values that are not finite"
                raise DraftError(cause, "restart from another state")
        self._since = (self._since + 1) % self._decimation
        data.qfrc_applied[self._v] = self.policy.torque(
            self._action, data.qpos[self._q], data.qvel[self._v]
        )
        self.advance(self.model, data)

    def observe(self, data: mujoco.MjData, command: ArrayLike) -> NDArray[np.float32]:
        """Return the observation of the policy, without noise.

        Args:
            data: state of the model; its derived quantities are updated.
            command: vx and vy [m/s] and wz [rad/s] in the trunk's frame.

        Returns:
            Terms of `Policy.terms` in order, shape (n,).
        """
        return self._joined(self._parts(data, command))

    def _joined(self, parts: Mapping[str, Array]) -> NDArray[np.float32]:
        """Observation of the terms of now and those of the steps before; at first of now alone."""
        found, most = [], max(self.policy.history)
        steps = [*self._past, parts]
        steps = [*steps[:1] * (most - len(steps)), *steps]
        for (name, _), count in zip(self.policy.terms, self.policy.history, strict=True):
            found += [one[name] for one in steps[-count:]]
        return np.concatenate(found).astype(np.float32)

    def _parts(self, data: mujoco.MjData, command: ArrayLike) -> Mapping[str, Array]:
        """Terms of now."""
        mujoco.mj_forward(self.model, data)
        turn = data.xmat[self._trunk].reshape(3, 3)
        sign = self.policy.sign
        linear, angular = (data.sensordata[at : at + 3] for at in self._sensors)
        parts: dict[str, Array] = {
            "base_lin_vel": linear.copy(),
            "base_ang_vel": angular.copy(),
            "projected_gravity": self.policy.trim.gravity(-turn[2], self._trim),
            ANGLES: (sign * (data.qpos[self._q] - self.policy.home))[~self.policy.rolls],
            "joint_vel": sign * data.qvel[self._v],
            "actions": self._action,
            "command": self.policy.trim.command(command, self._trim),
            DESIGN: self.policy.features,
        }
        if len(self.policy.scan_points):
            parts["height_scan"] = self._scan(data, turn) / self.policy.scan_range
        return parts

    def velocity(self, data: mujoco.MjData) -> Array:
        """Velocity of the trunk in its own frame, as last observed [m/s], shape (3,)."""
        return data.sensordata[self._sensors[0] : self._sensors[0] + 3]

    def _scan(self, data: mujoco.MjData, turn: Array) -> Array:
        """Height of the trunk above the points of the scan [m], shape (points,)."""
        reach = self.policy.scan_range
        heading = turn[:2, 0] / max(float(np.linalg.norm(turn[:2, 0])), 1e-6)
        sideways = np.array([-heading[1], heading[0]])
        trunk = data.xpos[self._trunk]
        points = trunk[:2] + self.policy.scan_points @ np.stack((heading, sideways))
        down, hit = np.array([0.0, 0.0, -1.0]), np.zeros(1, np.int32)
        heights = np.full(len(points), reach)
        for i, point in enumerate(points):
            # From above, as steps can be higher than the trunk.
            start = np.array([*point, trunk[2] + reach])
            distance = mujoco.mj_ray(self._sight, data, start, down, self._seen, True, -1, hit)
            if distance >= 0:
                heights[i] = min(distance - reach, reach)
        return heights


# Observation terms that a controller can compute.
_TERMS = frozenset(
    {
        "base_lin_vel",
        "base_ang_vel",
        "projected_gravity",
        *OF_JOINTS,
        "command",
        "height_scan",
        DESIGN,
    }
)


def start_offsets(policy: Policy, seed: int) -> Array:
    """Offsets of the joints at the start [rad], shape (joints,)."""
    drawn = np.random.default_rng(seed).uniform(-_OFFSET, _OFFSET, len(policy.joints))
    return policy.sign * drawn


def _joint(model: mujoco.MjModel, name: str) -> int:
    """Index of a joint."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if index < 0:
        raise _missing("joint", name, [model.joint(i).name for i in range(model.njnt)])
    return index


def _sensor(model: mujoco.MjModel, name: str) -> int:
    """Address of a sensor's values in `sensordata`."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name)
    if index < 0:
        raise _missing("sensor", name, [model.sensor(i).name for i in range(model.nsensor)])
    return int(model.sensor_adr[index])


def _missing(kind: str, name: str, available: Sequence[str]) -> DraftError:
    cause = f"the model has no {kind} '{name}'"
    known = ", ".join(one for one in available if one) or "none"
    return DraftError(cause, f"{kind}s: {known}")
