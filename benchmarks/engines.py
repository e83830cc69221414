"""Engines that take the place of MuJoCo's step under a policy: MuJoCo Warp, and Drake.

Each is a function of a model and its state, as `mujoco.mj_step`: it reads positions, velocities and
`qfrc_applied`, and writes positions and velocities a time step later. What the policy sees, its
torques, kicks and falls are those of `draft play`, so that engines differ in their physics alone.
"""

# pyright: reportAttributeAccessIssue=false
# (Compiled modules carry no types.)
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

Advance = Callable[[mujoco.MjModel, mujoco.MjData], None]
FRICTION = 1.0  # Of the floor, as in MuJoCo by default; SDFormat's default is that of the robot.
STEP = 0.001  # Time step in Drake [s].
_STICK = 0.05  # Speed of a joint above which its dry friction is full in Drake [rad/s].
_BASE = 7, 6  # Positions and velocities of a floating base.
_CONTACTS, _ROWS = 64, 320  # That MuJoCo Warp has room for; a robot on its side has fewer.


def substeps(step: float, contact_time: float | None = None) -> Advance:
    """MuJoCo with a shorter step, and torques that are held for that of the model.

    Args:
        step: time step, a part of that of the model [s].
        contact_time: time constant of all contacts [s]; None for that of the model.
    """

    def advance(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        whole = model.opt.timestep
        if contact_time is not None:
            model.geom_solref[:, 0] = contact_time
        model.opt.timestep = step
        mujoco.mj_step(model, data, round(whole / step))
        model.opt.timestep = whole

    return advance


class Warp:
    """MuJoCo Warp with one world, on the processor if there is no GPU."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Compile the kernels, which takes a minute the first time.

        Args:
            model: robot and ground.
        """
        import mujoco_warp
        import warp

        warp.config.quiet = True
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        self._step = mujoco_warp.step
        self._model: Any = mujoco_warp.put_model(model)
        self._data: Any = mujoco_warp.put_data(model, data, nconmax=_CONTACTS, njmax=_ROWS)

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Advance by the time step of the model."""
        own, state = self._data, ("qpos", "qvel", "qacc_warmstart")
        for name in (*state, "qfrc_applied"):
            getattr(own, name).assign(np.asarray(getattr(data, name), np.float32)[None])
        self._step(self._model, own)
        for name in state:
            getattr(data, name)[:] = getattr(own, name).numpy()[0]
        _moved(model, data)


class Drake:
    """Drake, with a robot from the SDFormat that Draft exports, on a floor.

    Masses, joints, their ranges, damping, armatures and collision shapes are those of the file, and
    so is the dry friction of the joints, which Drake does not know: it is a torque against the
    speed. As in MuJoCo, the robot touches the floor and not itself. Contacts are points, as the
    feet are spheres and no spec says how stiff a foot is; their compliance is Drake's default.

    Attributes:
        plant: the plant, with one robot and a floor.
        context: context of the plant.
    """

    def __init__(self, file: Path, solver: str = "similar", step: float = STEP) -> None:
        """Read a robot.

        Args:
            file: robot.sdf, of a robot with a floating base.
            solver: Drake's approximation of contacts. "similar" is the one that its documentation
                prefers where impacts matter. The default of Drake, "lagged", bounds the friction of
                a foot by the normal force of the step before, which is none when it lands.
            step: time step [s].
        """
        from pydrake.geometry import CollisionFilterDeclaration, GeometrySet, HalfSpace
        from pydrake.math import RigidTransform
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import (
            AddMultibodyPlant,
            CoulombFriction,
            MultibodyPlantConfig,
        )
        from pydrake.systems.framework import DiagramBuilder

        builder = DiagramBuilder()
        settings = MultibodyPlantConfig(
            time_step=step,
            contact_model="point",
            discrete_contact_approximation=solver,
            use_sampled_output_ports=False,  # For forces of the state as it is.
        )
        plant, scene = AddMultibodyPlant(settings, builder)
        (robot,) = Parser(plant).AddModels(file)
        floor = CoulombFriction(FRICTION, FRICTION)
        plant.RegisterCollisionGeometry(
            plant.world_body(), RigidTransform(), HalfSpace(), "floor", floor
        )
        plant.Finalize()
        own = [
            shape
            for body in plant.GetBodyIndices(robot)
            for shape in plant.GetCollisionGeometriesForBody(plant.get_body(body))
        ]
        alone = CollisionFilterDeclaration().ExcludeWithin(GeometrySet(own))
        scene.collision_filter_manager().Apply(alone)
        self.plant: Any = plant
        self._diagram: Any = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self.context: Any = plant.GetMyMutableContextFromRoot(self._root)
        self._step = step
        self._friction = {
            str(joint.get("name")): float(joint.findtext("axis/dynamics/friction", "0"))
            for joint in ElementTree.parse(file).iter("joint")
        }
        self._joints: dict[str, Any] = {}

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Advance by the time step of the model."""
        q, v, friction = self._places(model)
        self._put(data, q, v)
        torques = np.zeros(self.plant.num_velocities())
        for _ in range(round(model.opt.timestep / self._step)):
            speeds = self.plant.GetVelocities(self.context)[v]
            torques[v] = data.qfrc_applied[_BASE[1] :] - friction * np.tanh(speeds / _STICK)
            port = self.plant.get_applied_generalized_force_input_port()
            port.FixValue(self.context, torques)
            after = self._diagram.EvalUniquePeriodicDiscreteUpdate(self._root)
            self._root.SetDiscreteState(after)
        self._take(data, q, v)
        _moved(model, data)

    def floor_forces(self) -> np.ndarray:
        """Forces between the robot and the floor in the world [N], shape (contacts, 3).

        Their signs are those of Drake's order of the two bodies.
        """
        found = self.plant.get_contact_results_output_port().Eval(self.context)
        infos = map(found.point_pair_contact_info, range(found.num_point_pair_contacts()))
        return np.array([info.contact_force() for info in infos]).reshape(-1, 3)

    def _places(self, model: mujoco.MjModel) -> tuple[list[int], list[int], np.ndarray]:
        """Of each joint of a model: places in Drake's positions and velocities, and friction."""
        names = [model.joint(i).name for i in range(1, model.njnt)]
        for name in names:
            if name not in self._joints:
                self._joints[name] = self.plant.GetJointByName(name)
        joints = [self._joints[name] for name in names]
        return (
            [joint.position_start() for joint in joints],
            [joint.velocity_start() for joint in joints],
            np.array([self._friction[name] for name in names]),
        )

    def _put(self, data: mujoco.MjData, q: list[int], v: list[int]) -> None:
        """Take the state from MuJoCo, whose angular velocity is in the trunk's frame."""
        positions, velocities = np.zeros(len(q) + _BASE[0]), np.zeros(len(v) + _BASE[1])
        positions[:7] = *data.qpos[3:7], *data.qpos[:3]
        velocities[:6] = *(_matrix(data.qpos[3:7]) @ data.qvel[3:6]), *data.qvel[:3]
        positions[q], velocities[v] = data.qpos[_BASE[0] :], data.qvel[_BASE[1] :]
        self.plant.SetPositions(self.context, positions)
        self.plant.SetVelocities(self.context, velocities)

    def _take(self, data: mujoco.MjData, q: list[int], v: list[int]) -> None:
        """Give the state to MuJoCo."""
        positions = self.plant.GetPositions(self.context)
        velocities = self.plant.GetVelocities(self.context)
        data.qpos[:7] = *positions[4:7], *positions[:4]
        data.qvel[:3] = velocities[3:6]
        data.qvel[3:6] = _matrix(positions[:4]).T @ velocities[:3]
        data.qpos[_BASE[0] :], data.qvel[_BASE[1] :] = positions[q], velocities[v]


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion (w, x, y, z)."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _moved(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Count the time, and compute the poses by which a fall is seen."""
    data.time += model.opt.timestep
    mujoco.mj_kinematics(model, data)
