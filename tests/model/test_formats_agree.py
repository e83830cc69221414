"""All formats are one robot: each is read by a library of its own, and their numbers are compared.

MuJoCo reads MJCF, Pinocchio reads URDF, Drake reads SDFormat, OpenUSD reads USD. No reader shares
code with Draft.
"""

# pyright: reportAttributeAccessIssue=false
# (Compiled modules carry no types.)
from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

import draft
from draft.model.urdf import LEAST_MASS
from draft.values import scalar
from tests.helpers import robot as robot_of
from tests.model.own_parts import everything
from tests.model.shipped import SHIPPED, built
from tests.model.test_coupling import coupled_hand
from tests.model.test_slides import telescope

Array = np.ndarray
COUPLED = "coupled hand"
SLIDE = "telescope"
PARTS = "own parts"
ROBOTS = [*SHIPPED, (COUPLED, None), (SLIDE, None), (PARTS, None)]
# Files have ten significant digits; MuJoCo keeps the vertices of a mesh in single precision.
CLOSE, COARSE = 1e-7, 1e-6
# Rounding to single precision, as a share. UsdPhysics has it for nearly all numbers, of which only
# ends of ranges, of up to some radians, need more than the bounds above.
SINGLE = 2.0**-24


@dataclass
class Body:
    """Mass [kg], centre of mass [m] and inertia about it [kg m2] in the world, in the home pose."""

    mass: float
    center: Array
    inertia: Array


@dataclass
class Joint:
    """Axis, and of a hinge a point on it, in the world in the home pose; limits in SI units."""

    axis: Array
    point: Array | None
    range: tuple[float, float] | None
    torque: float
    speed: float | None
    follows: tuple[str, float, float] | None = None


@dataclass
class Robot:
    bodies: dict[str, Body] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    rounding: float = 0.0  # Of the ends of ranges, as a share.

    def total(self) -> Body:
        """The whole as one body."""
        parts = [part for part in self.bodies.values() if part.mass > LEAST_MASS]
        mass = sum(part.mass for part in parts)
        center = sum((part.mass * part.center for part in parts), np.zeros(3)) / mass
        inertia = np.zeros((3, 3))
        for part in parts:
            arm = part.center - center
            inertia += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return Body(mass, center, inertia)


def by_mujoco(folder: Path, home: dict[str, float], floating: bool) -> Robot:
    """MJCF as MuJoCo reads it; torques and speeds are those of the motors of its scene."""
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(model)
    data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0) if floating else data.qpos[:7]
    for name, value in home.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    robot = Robot()
    for i in range(1, model.nbody):
        axes = data.ximat[i].reshape(3, 3)
        inertia = axes @ np.diag(model.body_inertia[i]) @ axes.T
        robot.bodies[model.body(i).name] = Body(model.body_mass[i], data.xipos[i], inertia)
    coupled = {
        model.joint(model.eq_obj1id[i]).name: (
            model.joint(model.eq_obj2id[i]).name,
            model.eq_data[i, 1],
            model.eq_data[i, 0],
        )
        for i in range(model.neq)
    }
    for name in home:
        one = model.joint(name)
        torque, speed = 0.0, None
        if name in (model.actuator(i).name for i in range(model.nu)):
            torque, speed = model.numeric(f"{name}_dc_motor").data[:2]
            assert torque == pytest.approx(model.actuator(name).forcerange[1], rel=CLOSE)
        limits = tuple(one.range) if model.jnt_limited[one.id] else None
        hinge = model.jnt_type[one.id] == mujoco.mjtJoint.mjJNT_HINGE
        point = data.xanchor[one.id] if hinge else None
        follows = coupled.get(name)
        robot.joints[name] = Joint(data.xaxis[one.id], point, limits, torque, speed, follows)
    return robot


def by_pinocchio(folder: Path, home: dict[str, float], floating: bool) -> Robot:
    """URDF as Pinocchio reads it, which keeps the inertia of each link with its frame."""
    pinocchio = pytest.importorskip("pinocchio")
    base = (pinocchio.JointModelFreeFlyer(),) if floating else ()
    model = pinocchio.buildModelFromUrdf(str(folder / "robot.urdf"), *base)
    linked = pinocchio.buildModelFromUrdf(str(folder / "robot.urdf"), *base, mimic=True)
    data, q = model.createData(), pinocchio.neutral(model)
    for name, value in home.items():
        one = model.joints[model.getJointId(name)]
        turn = [value] if one.nq == 1 else [math.cos(value), math.sin(value)]
        q[one.idx_q : one.idx_q + one.nq] = turn
    pinocchio.framesForwardKinematics(model, data, q)
    robot = Robot()
    kinds = pinocchio.FrameType
    fixed = [one for one in model.frames if one.type == kinds.FIXED_JOINT]
    for frame in model.frames:
        if frame.type != kinds.BODY or frame.name == "world":
            continue
        # Of what is fixed to a link, Pinocchio adds the inertia to that of the joint.
        above = model.frames[frame.parentFrame]
        welds = [above] if above.type == kinds.FIXED_JOINT else fixed
        parts = [
            one.placement.act(one.inertia).toDynamicParameters()
            for one in welds
            if one.parentJoint == frame.parentJoint
        ]
        own = sum(parts, np.zeros(10))
        if above.type == kinds.JOINT:
            own = model.inertias[frame.parentJoint].toDynamicParameters() - own
        place = data.oMi[frame.parentJoint]
        weighs = pinocchio.Inertia.FromDynamicParameters
        moved = place.act(weighs(own) if own[0] > 0 else pinocchio.Inertia.Zero())
        robot.bodies[frame.name] = Body(moved.mass, moved.lever, moved.inertia)
    pairs = dict(zip(linked.mimicking_joints, linked.mimicked_joints, strict=True))
    pinocchio.computeJointJacobians(model, data, q)
    world = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for name in home:
        number, other = model.getJointId(name), linked.getJointId(name)
        one, place = model.joints[number], data.oMi[number]
        axis = pinocchio.getJointJacobian(model, data, number, world)[:, one.idx_v]
        turning = np.linalg.norm(axis[3:]) > 0.5
        span = model.lowerPositionLimit, model.upperPositionLimit
        limits = (span[0][one.idx_q], span[1][one.idx_q]) if one.nq == 1 else None
        follows = None
        if other in pairs:
            held = linked.joints[other].extract()
            follows = (linked.names[pairs[other]], held.scaling, held.offset)
        robot.joints[name] = Joint(
            axis[3:] if turning else axis[:3],
            place.translation if turning else None,
            limits,
            float(model.upperEffortLimit[one.idx_v]),
            float(model.upperVelocityLimit[one.idx_v]),
            follows,
        )
    return robot


def follows_in_sdf(folder: Path) -> dict[str, tuple[str, float, float]]:
    """Couplings of the file, which Drake counts but does not show."""
    found = {}
    for one in ElementTree.parse(folder / "robot.sdf").iter("joint"):
        if (mimic := one.find("axis/mimic")) is not None:
            numbers = (float(mimic.findtext(tag, "nan")) for tag in ("multiplier", "offset"))
            names = (str(at.get(key)) for at, key in ((one, "name"), (mimic, "joint")))
            name, leader = (text.removesuffix("_joint") for text in names)
            found[name] = (leader, *numbers)
    return found


def by_drake(folder: Path, home: dict[str, float], floating: bool) -> Robot:
    """SDFormat as Drake reads it, by the parser of Gazebo, with shapes that can touch."""
    pytest.importorskip("pydrake.multibody.parsing", reason="drake has no wheel for this system")
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation
    from pydrake.multibody.tree import RevoluteJoint
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant: Any = AddMultibodyPlantSceneGraph(builder, 0.001)[0]

    def joint_of(name: str) -> Any:
        """Joint; one that has the name of a link has another name in SDFormat."""
        return plant.GetJointByName(f"{name}_joint" if plant.HasBodyNamed(name) else name)

    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)  # for mimic
    (instance,) = Parser(plant).AddModels(folder / "robot.sdf")
    plant.Finalize()
    for name, value in home.items():
        joint_of(name).set_default_positions([value])
    context = plant.CreateDefaultContext()
    bodies = [plant.get_body(i) for i in plant.GetBodyIndices(instance)]
    if floating:
        from pydrake.math import RigidTransform

        plant.SetFreeBodyPose(context, bodies[0], RigidTransform())
    robot = Robot()
    for body in bodies:
        pose = plant.EvalBodyPoseInWorld(context, body)
        turn = pose.rotation().matrix()
        own = body.CalcSpatialInertiaInBodyFrame(context)
        center = own.get_com()
        inertia = own.Shift(center).CalcRotationalInertia().CopyToFullMatrix3()
        place = pose.translation() + turn @ center
        robot.bodies[body.name()] = Body(own.get_mass(), place, turn @ inertia @ turn.T)
    drives = {
        plant.get_joint_actuator(i).joint().name(): plant.get_joint_actuator(i)
        for i in plant.GetJointActuatorIndices()
    }
    coupled = follows_in_sdf(folder)
    assert plant.num_constraints() == len(coupled)
    for name in home:
        joint = joint_of(name)
        frame = joint.frame_on_parent().CalcPoseInWorld(context)
        hinge = isinstance(joint, RevoluteJoint)
        axis = joint.revolute_axis() if hinge else joint.translation_axis()
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        robot.joints[name] = Joint(
            frame.rotation().matrix() @ axis,
            frame.translation() if hinge else None,
            (low, high) if np.isfinite(low) else None,
            drives[joint.name()].effort_limit() if joint.name() in drives else 0.0,
            joint.velocity_upper_limits()[0] if joint.name() in drives else None,
            coupled.get(name),
        )
    return robot


def pose(place: Any, turn: Any) -> Array:
    """Homogeneous matrix of a place and a quaternion of OpenUSD."""
    w, (x, y, z) = turn.GetReal(), turn.GetImaginary()
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, np.array([w, x, y, z]) / np.linalg.norm([w, x, y, z]))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = flat.reshape(3, 3), place
    return matrix


def by_usd(folder: Path, home: dict[str, float], floating: bool) -> Robot:
    """USD as OpenUSD reads it: bodies are placed by their joints alone, angles are in degrees."""
    pytest.importorskip("pxr.UsdPhysics", reason="the extra `usd` is not installed")
    from pxr import Usd, UsdPhysics

    stage = Usd.Stage.Open(str(folder / "robot.usda"))
    prims = [*stage.Traverse()]
    links = {one.GetPath(): one for one in prims if one.HasAPI(UsdPhysics.RigidBodyAPI)}
    names = {path: one.GetDisplayName() or one.GetName() for path, one in links.items()}
    joints = [UsdPhysics.Joint(one) for one in prims if one.IsA(UsdPhysics.Joint)]
    to = {joint.GetBody1Rel().GetTargets()[0]: joint for joint in joints}
    assert len(to) == len(joints) == len(links) - floating
    robot, placed = Robot(rounding=SINGLE), {}

    def name_of(joint: Any) -> str:
        """Name of a joint; one that has the name of a link has another name here."""
        name = joint.GetDisplayName() or joint.GetName()
        own = name.removesuffix("_joint")
        return own if own in names.values() else name

    def place(path: Any) -> Array:
        """Pose of a body; what is not one is the world."""
        if path not in placed:
            placed[path] = follow(to[path]) if path in to else np.eye(4)
        return placed[path]

    def follow(joint: Any) -> Array:
        """Pose of the body behind a joint, which is noted."""
        prim, (above,) = joint.GetPrim(), joint.GetBody0Rel().GetTargets()
        frame = place(above) @ pose(joint.GetLocalPos0Attr().Get(), joint.GetLocalRot0Attr().Get())
        own = pose(joint.GetLocalPos1Attr().Get(), joint.GetLocalRot1Attr().Get())
        if prim.IsA(UsdPhysics.FixedJoint):
            return frame @ np.linalg.inv(own)
        hinge = prim.IsA(UsdPhysics.RevoluteJoint)
        unit = math.radians(1) if hinge else 1.0
        typed = (UsdPhysics.RevoluteJoint if hinge else UsdPhysics.PrismaticJoint)(prim)
        name = name_of(prim)
        axis = np.eye(3)["XYZ".index(typed.GetAxisAttr().Get())]
        low, high = typed.GetLowerLimitAttr().Get(), typed.GetUpperLimitAttr().Get()
        drive = UsdPhysics.DriveAPI.Get(prim, "angular" if hinge else "linear")
        follows = None
        if prim.HasAPI("NewtonMimicAPI"):
            (leader,) = prim.GetRelationship("newton:mimicJoint").GetTargets()
            ratio, offset = (prim.GetAttribute(f"newton:mimicCoef{i}").Get() for i in (1, 0))
            follows = (name_of(stage.GetPrimAtPath(leader)), ratio, offset * unit)
        robot.joints[name] = Joint(
            frame[:3, :3] @ axis,
            frame[:3, 3] if hinge else None,
            (low * unit, high * unit) if np.isfinite(low) else None,
            drive.GetMaxForceAttr().Get() if drive else 0.0,
            prim.GetAttribute("newton:velocityLimit").Get() * unit if drive else None,
            follows,
        )
        move, value = np.eye(4), home[name]
        if hinge:
            flat, turn = np.empty(9), np.empty(4)
            mujoco.mju_axisAngle2Quat(turn, axis, value)
            mujoco.mju_quat2Mat(flat, turn)
            move[:3, :3] = flat.reshape(3, 3)
        else:
            move[:3, 3] = value * axis
        return frame @ move @ np.linalg.inv(own)

    for path, one in links.items():
        mass, at = UsdPhysics.MassAPI(one), place(path)
        turn = at[:3, :3] @ pose((0, 0, 0), mass.GetPrincipalAxesAttr().Get())[:3, :3]
        robot.bodies[names[path]] = Body(
            mass.GetMassAttr().Get(),
            at[:3, 3] + at[:3, :3] @ np.array(mass.GetCenterOfMassAttr().Get()),
            turn @ np.diag(mass.GetDiagonalInertiaAttr().Get()) @ turn.T,
        )
    return robot


READERS: list[Callable[[Path, dict[str, float], bool], Robot]] = [by_pinocchio, by_drake, by_usd]
USD = () if importlib.util.find_spec("pxr") is None else ("usd",)


@cache
def model_of(name: str, label: str | None) -> draft.Model:
    if name == COUPLED:
        return coupled_hand().resolve().build()
    if name == PARTS:
        return everything().resolve().build()
    if name == SLIDE:
        return robot_of(telescope()).resolve().build()
    return built(name, label)


@pytest.fixture(scope="module", params=ROBOTS, ids=lambda pair: "-".join(filter(None, pair)))
def exported(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[draft.Model, Path]:
    model = model_of(*request.param)
    return model, model.save(
        tmp_path_factory.mktemp("robot") / "out", ("mjcf", "urdf", "sdf", *USD)
    )


@pytest.mark.parametrize("read", READERS)
def test_every_format_is_the_robot_of_the_mjcf(
    read: Callable[[Path, dict[str, float], bool], Robot], exported: tuple[draft.Model, Path]
) -> None:
    model, folder = exported
    home = {name: scalar(joint.home) for name, joint in model.design.joints.items()}
    ours = by_mujoco(folder, home, model.design.floating)
    found = read(folder, home, model.design.floating)
    assert found.bodies.keys() == ours.bodies.keys()
    whole = ours.total()
    size = np.trace(whole.inertia)
    for name, expected in {**ours.bodies, "": whole}.items():
        body = found.bodies[name] if name else found.total()
        if expected.mass == 0:  # SDFormat has no link without mass
            assert body.mass <= LEAST_MASS, name
            continue
        assert body.mass == pytest.approx(expected.mass, rel=COARSE), name
        assert body.center == pytest.approx(expected.center, abs=COARSE), name
        assert np.abs(body.inertia - expected.inertia).max() < CLOSE * size, name
        own = np.trace(expected.inertia)
        assert np.abs(body.inertia - expected.inertia).max() < 1e-5 * own, name
    for name, expected in ours.joints.items():
        joint = found.joints[name]
        assert joint.axis == pytest.approx(expected.axis, abs=CLOSE), name
        if expected.point is not None:
            assert joint.point == pytest.approx(expected.point, abs=COARSE), name
        assert joint.follows == pytest.approx(expected.follows), name
        assert (joint.range is None) == (expected.range is None), name
        if joint.range is not None:
            span = np.array(expected.range)
            close = CLOSE + found.rounding * np.abs(span)
            assert (np.abs(joint.range - span) <= close).all(), name
        assert joint.torque == pytest.approx(expected.torque, rel=CLOSE), name
        if expected.speed is not None:
            assert joint.speed == pytest.approx(expected.speed, rel=CLOSE), name
