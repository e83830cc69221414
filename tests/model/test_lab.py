"""Configurations for mjlab and Isaac Lab: what they build is the robot of Draft.

mjlab builds its entity. Isaac Lab needs a GPU and Isaac Sim, so that its classes are stood in for
by records with the fields of its release 2.3.2 (the wheel `isaaclab` 2.3.2.post1), which take no
others; its robot is what Pinocchio and others read of the same URDF.
"""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import MISSING, dataclass, field, make_dataclass
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import mujoco
import pytest

import draft
from draft.model.scene import DAMPING, STIFFNESS
from draft.values import scalar
from tests.helpers import robot as robot_of
from tests.model.shipped import SHIPPED, built
from tests.model.test_coupling import coupled_hand
from tests.model.test_slides import telescope

# Fields of Isaac Lab 2.3.2 by class; True for those that have no default.
_ACTUATOR = {
    "class_type": False,
    "joint_names_expr": True,
    "effort_limit": False,
    "velocity_limit": False,
    "effort_limit_sim": False,
    "velocity_limit_sim": False,
    "stiffness": True,
    "damping": True,
    "armature": False,
    "friction": False,
    "dynamic_friction": False,
    "viscous_friction": False,
}
_FIELDS: dict[str, dict[str, bool]] = {
    "DCMotorCfg": _ACTUATOR | {"saturation_effort": True},
    "InitialStateCfg": dict.fromkeys(
        ("pos", "rot", "lin_vel", "ang_vel", "joint_pos", "joint_vel"), False
    ),
    "ArticulationCfg": {
        "prim_path": False,  # Missing until a scene replaces it.
        "actuators": True,
        **dict.fromkeys(
            (
                *("class_type", "spawn", "init_state", "collision_group", "debug_vis"),
                *("articulation_root_prim_path", "soft_joint_pos_limit_factor"),
                "actuator_value_resolution_debug_print",
            ),
            False,
        ),
    },
    "PDGainsCfg": {"stiffness": True, "damping": False},
    "JointDriveCfg": dict.fromkeys(("drive_type", "target_type", "gains"), False),
    "UrdfFileCfg": {
        "asset_path": True,
        "fix_base": True,
        **dict.fromkeys(
            (
                *("func", "visible", "semantic_tags", "copy_from_source", "mass_props"),
                *("rigid_props", "collision_props", "activate_contact_sensors", "scale"),
                *("articulation_props", "fixed_tendons_props", "spatial_tendons_props"),
                *("joint_drive_props", "visual_material_path", "visual_material", "usd_dir"),
                *("usd_file_name", "force_usd_conversion", "make_instanceable"),
                *("root_link_name", "link_density", "merge_fixed_joints", "joint_drive"),
                *("convert_mimic_joints_to_normal_joints", "collision_from_visuals"),
                *("collider_type", "self_collision", "replace_cylinders_with_capsules"),
            ),
            False,
        ),
    },
}
OTHERS = {"coupled hand": coupled_hand, "telescope": lambda: robot_of(telescope())}


@dataclass
class Motor:
    """Numbers of the motor of a joint."""

    stiffness: float
    damping: float
    effort_limit: float
    saturation_effort: float
    velocity_limit: float


@pytest.fixture(scope="module", params=[*SHIPPED, *OTHERS], ids=str)
def exported(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[draft.Model, Path]:
    if request.param in OTHERS:
        model = OTHERS[request.param]().resolve().build()
    else:
        model = built(*request.param)
    folder = tmp_path_factory.mktemp("robot") / "out"
    return model, model.save(folder, ("mjlab", "isaaclab"))


def load(file: Path) -> Any:
    """Module of a file, which is read from where it lies."""
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def motors(model: draft.Model) -> dict[str, Motor]:
    """Motors of the design by joint, computed from its own quantities."""
    found = {}
    for name, joint in model.design.joints.items():
        if (drive := model.design.drive(joint)) is not None:
            peak, speed = scalar(drive.peak_torque), scalar(drive.no_load_speed)
            corner = scalar(drive.corner_speed)
            found[name] = Motor(
                0.0 if joint.rolls else STIFFNESS * peak,
                DAMPING * peak,
                peak,
                peak / (1 - corner / speed),
                speed,
            )
    return found


def close(found: Any, expected: Motor) -> None:
    for name, value in vars(expected).items():
        assert getattr(found, name) == pytest.approx(value, rel=1e-8), name


def test_mjlab_builds_the_robot_of_the_model(exported: tuple[draft.Model, Path]) -> None:
    pytest.importorskip("mjlab")
    model, folder = exported
    design, ours = model.design, model.mujoco
    module = load(folder / "mjlab_robot.py")
    entity = module.robot_cfg().build()
    assert list(entity.joint_names) == list(design.joints)
    assert entity.is_fixed_base == (not design.floating)
    theirs = entity.compile()
    assert theirs.body_mass.sum() == pytest.approx(ours.body_mass.sum(), rel=1e-9)
    for i in range(1, ours.nbody):
        body = theirs.body(ours.body(i).name)
        assert body.mass[0] == pytest.approx(ours.body_mass[i], rel=1e-9)
        assert body.inertia == pytest.approx(ours.body_inertia[i], rel=1e-7, abs=1e-12)
    for name in design.joints:
        mine, one = ours.joint(name), theirs.joint(name)
        mine_dof, dof = mine.dofadr[0], one.dofadr[0]
        for number in ("dof_armature", "dof_damping", "dof_frictionloss"):
            assert getattr(theirs, number)[dof] == pytest.approx(getattr(ours, number)[mine_dof])
        assert one.range == pytest.approx(mine.range)
    expected = motors(model)
    driven = {}
    for actuator in entity.actuators:
        for name in actuator.target_names:
            driven[name] = actuator.cfg
    assert driven.keys() == expected.keys()
    for name, motor in expected.items():
        close(driven[name], motor)
    # The order of commands is that of the joints.
    assert [theirs.actuator(i).name for i in range(theirs.nu)] == list(expected)


def test_a_robot_in_mjlab_begins_in_its_home_pose_on_the_floor(
    exported: tuple[draft.Model, Path],
) -> None:
    pytest.importorskip("mjlab")
    model, folder = exported
    theirs = load(folder / "mjlab_robot.py").robot_cfg().build().compile()
    data = mujoco.MjData(theirs)
    mujoco.mj_resetDataKeyframe(theirs, data, 0)
    for name, joint in model.design.joints.items():
        assert data.joint(name).qpos[0] == pytest.approx(scalar(joint.home), abs=1e-9)
    if model.design.floating:
        home = scalar(model.design.lowest(home=True))
        assert data.qpos[2] == pytest.approx(home, rel=1e-9)


def record(name: str, **inner: Any) -> Any:
    """Class with the fields of one of Isaac Lab's, and classes within it."""
    rows = [
        (key, Any, field(default=MISSING if needed else None, kw_only=True))
        for key, needed in _FIELDS[name].items()
    ]
    return make_dataclass(name, rows, namespace=inner)


@pytest.fixture
def isaac_lab(monkeypatch: pytest.MonkeyPatch) -> None:
    drive = record("JointDriveCfg", PDGainsCfg=record("PDGainsCfg"))
    state = record("InitialStateCfg")
    modules = {
        "isaaclab": {},
        "isaaclab.sim": {"UrdfFileCfg": record("UrdfFileCfg", JointDriveCfg=drive)},
        "isaaclab.actuators": {"DCMotorCfg": record("DCMotorCfg")},
        "isaaclab.assets": {"ArticulationCfg": record("ArticulationCfg", InitialStateCfg=state)},
    }
    for name, contents in modules.items():
        module = ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)
        if "." in name:
            setattr(sys.modules["isaaclab"], name.partition(".")[2], module)


@pytest.mark.usefixtures("isaac_lab")
def test_the_configuration_for_isaac_lab_has_its_fields_and_our_numbers(
    exported: tuple[draft.Model, Path],
) -> None:
    model, folder = exported
    design = model.design
    found = load(folder / "isaaclab_robot.py").ROBOT_CFG
    assert Path(found.spawn.asset_path) == folder / "robot.urdf"
    assert Path(found.spawn.asset_path).is_file()
    assert found.spawn.fix_base == (not design.floating)
    assert found.init_state.joint_pos == pytest.approx(
        {name: scalar(joint.home) for name, joint in design.joints.items()}, abs=1e-9
    )
    expected, driven = motors(model), {}
    for group in found.actuators.values():
        for name in group.joint_names_expr:
            assert name not in driven
            driven[name] = group
    assert driven.keys() == expected.keys()
    for name, motor in expected.items():
        close(driven[name], motor)
        dof = model.mujoco.joint(name).dofadr[0]
        joint = SimpleNamespace(
            armature=model.mujoco.dof_armature[dof],
            friction=model.mujoco.dof_frictionloss[dof],
            dynamic_friction=model.mujoco.dof_frictionloss[dof],
            viscous_friction=model.mujoco.dof_damping[dof],
        )
        for field_, value in vars(joint).items():
            assert getattr(driven[name], field_) == pytest.approx(value, rel=1e-7), field_


def test_a_motor_with_a_corner_has_a_stall_torque_above_its_peak(tmp_path: Path) -> None:
    pytest.importorskip("mjlab")
    robot = draft.load("quadruped").resolve({"actuators.leg.corner_speed": 20.0})
    module = load(robot.build().save(tmp_path / "out", ("mjlab",)) / "mjlab_robot.py")
    (motor,) = module.ACTUATORS
    assert motor.saturation_effort > motor.effort_limit
    # Half way between the corner and the no-load speed there is half of the peak torque.
    half = (20.0 + motor.velocity_limit) / 2
    there = motor.saturation_effort * (1 - half / motor.velocity_limit)
    assert there == pytest.approx(motor.effort_limit / 2)
