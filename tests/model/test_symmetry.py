"""Left and right are mirror images: in mass, in inertia and in motion."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from tests.helpers import leg, parameter, robot
from tests.model.shipped import built
from tests.model.test_masses import inertia

# Robot, mirror plane, and what a prefix on one side is on the other.
MIRRORS = [
    ("quadruped", "y", {"FL_": "FR_", "RL_": "RR_"}),
    ("quadruped", "x", {"FL_": "RL_", "FR_": "RR_"}),
    ("humanoid", "y", {"left_": "right_"}),
]
CASES = [
    pytest.param(name, plane, sides, label, id=f"{name}-{label or 'default'}-{plane}")
    for name, plane, sides in MIRRORS
    for label in (None, *draft.load(name).designs)
]
PLANES = {"x": np.diag([-1.0, 1.0, 1.0]), "y": np.diag([1.0, -1.0, 1.0])}
# Turning about the mirror's normal looks the same in it, turning about the others reversed.
SENSE = {"x": np.array([1.0, -1.0, -1.0]), "y": np.array([-1.0, 1.0, -1.0])}


def _other(name: str, sides: dict[str, str]) -> str:
    """Name of the mirror image of a body, joint or site; those in the middle are their own."""
    for one, two in (sides | {two: one for one, two in sides.items()}).items():
        if name.startswith(one):
            return two + name.removeprefix(one)
    return name


@pytest.mark.parametrize(("name", "plane", "sides", "label"), CASES)
def test_both_sides_weigh_the_same_and_mirror_each_others_inertia(
    name: str, plane: str, sides: dict[str, str], label: str | None
) -> None:
    model, mirror = built(name, label).mujoco, PLANES[plane]
    for i in range(1, model.nbody):
        one = model.body(i)
        two = model.body(_other(one.name, sides))
        assert two.mass == pytest.approx(one.mass, rel=1e-9)
        assert two.subtreemass == pytest.approx(one.subtreemass, rel=1e-9)
        assert two.ipos == pytest.approx(mirror @ one.ipos, abs=1e-9)
        reflected = mirror @ inertia(model, one.name) @ mirror
        bound = 1e-9 * np.abs(reflected).max()
        assert inertia(model, two.name) == pytest.approx(reflected, abs=bound)


def _mirrored_angles(
    model: mujoco.MjModel, angles: np.ndarray, plane: str, sides: dict[str, str]
) -> np.ndarray:
    """Joint angles that move a robot as its reflection: about two of the axes they change sign."""
    result = np.zeros(model.nq)
    result[3] = 1
    for j in range(1, model.njnt):
        joint = model.joint(j)
        sign = float(joint.axis @ SENSE[plane])
        assert abs(sign) == 1, "an axis along x, y or z"
        image = model.joint(_other(joint.name, sides))
        result[image.qposadr[0]] = sign * angles[j - 1]
    return result


@pytest.mark.parametrize(("name", "plane", "sides", "label"), CASES)
@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_mirrored_angles_put_every_body_at_its_mirror_image(
    name: str, plane: str, sides: dict[str, str], label: str | None, seed: int
) -> None:
    model, mirror = built(name, label).mujoco, PLANES[plane]
    low, high = model.jnt_range[1:].T
    # Beyond the ranges too: they need not be mirror images of each other.
    angles = np.random.default_rng(seed).uniform(np.minimum(low, -1), np.maximum(high, 1))
    one, two = mujoco.MjData(model), mujoco.MjData(model)
    one.qpos[:] = [0, 0, 0, 1, 0, 0, 0, *angles]
    two.qpos[:] = _mirrored_angles(model, angles, plane, sides)
    mujoco.mj_kinematics(model, one)
    mujoco.mj_kinematics(model, two)
    for i in range(1, model.nbody):
        body = model.body(i).name
        here, there = one.body(body), two.body(_other(body, sides))
        assert there.xpos == pytest.approx(mirror @ here.xpos, abs=1e-9)
        turned = mirror @ here.xmat.reshape(3, 3) @ mirror
        assert there.xmat.reshape(3, 3) == pytest.approx(turned, abs=1e-9)


@pytest.mark.parametrize(("name", "plane", "sides", "label"), CASES)
def test_one_sign_means_one_motion_on_every_copy_of_a_joint(
    name: str, plane: str, sides: dict[str, str], label: str | None
) -> None:
    model = built(name, label).mujoco
    for j in range(1, model.njnt):
        one = model.joint(j)
        two = model.joint(_other(one.name, sides))
        assert list(two.axis) == list(one.axis)
        assert list(two.range) == list(one.range)


def test_the_halves_of_a_humanoid_lie_on_their_own_sides() -> None:
    model = built("humanoid", None).mujoco
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for i in range(1, model.nbody):
        name, y = model.body(i).name, data.xipos[i, 1]
        if name.startswith(("left_", "right_")):
            assert (y > 0) == name.startswith("left_")
        else:
            assert y == pytest.approx(0, abs=1e-9)


CANTED = robot(
    leg(
        thigh={
            "rpy": [0.1, -0.2, 0.4],
            "joint": {"name": "hip", "axis": ["a", "b", "c"], "range": [-1, 1], "actuator": "leg"},
            "link": {"axis": [0.1, 0.2, -1], "length": 0.3, "segment": "thigh"},
            "motor": {"actuator": "leg", "axis": [0.2, 1, 0.1], "shift": [0.01, 0.02, 0.03]},
        }
    ),
    children=[
        {"chain": "leg", "prefix": "L_", "at": [0.1, 0.2, -0.2], "rpy": [0.3, 0.1, -0.2]},
        {
            "chain": "leg",
            "prefix": "R_",
            "at": [0.1, 0.2, -0.2],
            "rpy": [0.3, 0.1, -0.2],
            "mirror": "y",
        },
    ],
    parameters={"a": parameter(0.0), "b": parameter(0.87), "c": parameter(0.5)},
    allow=["actuator_overlap"],
)
components = st.floats(-1, 1).filter(lambda x: abs(x) > 0.05)


@settings(max_examples=15)
@given(st.tuples(components, components, components), st.floats(-1, 1), st.floats(-1, 1))
def test_canted_joints_keep_to_their_side_in_the_mirror(
    axis: tuple[float, float, float], hip: float, knee: float
) -> None:
    model = CANTED.resolve(dict(zip("abc", axis, strict=True))).build().mujoco
    left, right = model.joint("L_hip").axis, model.joint("R_hip").axis
    mirror = PLANES["y"]
    assert left @ right >= 0  # of the reflected axis and its opposite, the one on the same side
    assert abs(left @ mirror @ right) == pytest.approx(1)
    # A reflected turn goes the other way about the reflected axis.
    sense = -1.0 if left @ mirror @ right > 0 else 1.0
    data = mujoco.MjData(model)
    angles = {"L_hip": hip, "L_knee": knee, "R_hip": sense * hip, "R_knee": knee}
    for name, angle in angles.items():
        data.joint(name).qpos[0] = angle
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    mujoco.mj_kinematics(model, data)
    for body in ("housing", "thigh", "shank"):
        one, two = data.body(f"L_{body}"), data.body(f"R_{body}")
        assert two.xpos == pytest.approx(mirror @ one.xpos, abs=1e-8)
        assert two.xipos == pytest.approx(mirror @ one.xipos, abs=1e-8)
        turned = mirror @ one.xmat.reshape(3, 3) @ mirror
        assert two.xmat.reshape(3, 3) == pytest.approx(turned, abs=1e-8)
        reflected = mirror @ inertia(model, f"L_{body}") @ mirror
        assert inertia(model, f"R_{body}") == pytest.approx(reflected, abs=1e-9)
