"""Joints that follow others by a fixed ratio: models, exports, loads and limbs."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design.legs import GRAVITY, count, held_joints
from draft.design.limbs import home_columns, limbs
from draft.errors import DraftError
from draft.metrics import of_design
from draft.metrics.grasp import grasps
from draft.metrics.impact import pose_inertia
from draft.metrics.stretch import stretched
from draft.model.batch import build_batch, indices
from draft.values import Array, scalar
from tests import fixed
from tests.helpers import ids, leg, robot

FREE = "joint: {name: distal, axis: y, range: [-0.2, 1.6], home: 0.3, actuator: servo}"
COUPLED = "joint: {name: distal, axis: y, follows: {joint: proximal, ratio: share, offset: 0.1}}"
MOTOR = "      motor: {actuator: servo, axis: y, shift: [0, 0.03, 0]}\n"
SHARE = """\
parameters:
  share: {value: 0.8, unit: "1", range: [-3, 3], doc: Motion of the distal joint per proximal one.}
"""


def coupled_hand(joint: str = COUPLED, **uses: str) -> draft.Spec:
    """The hand of the tests, in which the second joint of every finger follows the first.

    Args:
        joint: the second joint.
        uses: further keys of the use of the chain with a prefix, as text.
    """
    tree = fixed.HAND_TREE.replace(FREE, joint).replace(MOTOR, "")
    for prefix, more in uses.items():
        tree = tree.replace(f"prefix: {prefix}_,", f"prefix: {prefix}_, {more},")
    numbers = fixed.HAND_PARAMETERS.replace("parameters: {}\n", SHARE)
    return draft.Spec.parse({"parameters.yaml": numbers, "tree.yaml": tree})


def chain_of(*follows: tuple[int, float, float], last: dict[str, Any] | None = None) -> draft.Spec:
    """Three links with level axes in a row; some joints follow others.

    Args:
        follows: of each joint that follows, its place, and its ratio and offset to the one before.
        last: keys of the last joint, besides name and axis.
    """
    ratios = {k: (ratio, offset) for k, ratio, offset in follows}
    links: list[dict[str, Any]] = [{"name": "housing", "motor": {"actuator": "drive", "axis": "y"}}]
    for k in range(3):
        joint: dict[str, Any] = {"name": f"joint_{k}", "axis": "y"}
        if k in ratios:
            ratio, offset = ratios[k]
            joint["follows"] = {"joint": f"joint_{k - 1}", "ratio": ratio, "offset": offset}
        elif k == 2 and last is not None:
            joint |= last
        else:
            joint |= {"range": [-1, 2], "home": 0.3, "actuator": "drive"}
        link = {"axis": "x", "length": 0.2, "mass": 1.0}
        links.append({"name": f"link_{k}", "joint": joint, "link": link})
        if k < 2 and k + 1 not in ratios and (k + 1 < 2 or last is None):
            links[-1]["motor"] = {"actuator": "drive", "axis": "y"}
    drive = {"peak_torque": 60, "no_load_speed": 8, "gear_ratio": 50, "mass": 0.8}
    parameters: dict[str, Any] = {"parameters": {}, "actuators": {"drive": drive}}
    tree = {"name": "base", "type": "fixed", "at": [0, 0, 2], "children": [{"chain": "limb"}]}
    return draft.Spec.parse(
        {
            "parameters.yaml": {"name": "row", "population": "humanoid", **parameters},
            "tree.yaml": {"chains": {"limb": links}, "tree": tree},
        }
    )


def follow(design: draft.Design, free: dict[str, float]) -> dict[str, float]:
    """Positions of all joints from those that follow none."""
    return {
        name: free[name]
        if joint.follows is None
        else scalar(joint.follows.ratio) * free[joint.follows.joint] + scalar(joint.follows.offset)
        for name, joint in design.joints.items()
    }


def gradient(model: mujoco.MjModel, design: draft.Design, free: dict[str, float]) -> Array:
    """Motion of all joints per motion of those that are free, shape (nv, free), by differences."""
    names, step = [*free], 0.5
    rows = np.zeros((model.nv, len(names)))
    for i, name in enumerate(names):
        ends = [follow(design, free | {name: free[name] + s * step}) for s in (-1, 1)]
        for joint in design.joints:
            dof = model.joint(joint).dofadr[0]
            rows[dof, i] = (ends[1][joint] - ends[0][joint]) / (2 * step)
    return rows


# --- where the joints are ------------------------------------------------------------------


def test_range_and_home_follow_from_those_of_the_other_joint() -> None:
    joints = coupled_hand().resolve().joints
    distal = joints["index_distal"]
    assert distal.range == pytest.approx((-0.2 * 0.8 + 0.1, 1.6 * 0.8 + 0.1))
    assert distal.home == pytest.approx(0.3 * 0.8 + 0.1)
    assert distal.follows is not None
    assert distal.follows.joint == "index_proximal"
    assert distal.actuator is None
    backwards = coupled_hand().resolve({"share": -0.5}).joints["index_distal"]
    assert backwards.range == pytest.approx((-0.7, 0.2))


def test_a_copy_follows_its_own_joint_with_its_own_range() -> None:
    change = "joints: {proximal: {range: [0, 1], home: 0.5}}"
    joints = coupled_hand(ring=change).resolve().joints
    assert joints["ring_distal"].range == pytest.approx((0.1, 0.9))
    assert joints["ring_distal"].home == pytest.approx(0.5)
    assert joints["index_distal"].home == pytest.approx(0.34)


def test_a_joint_that_follows_a_follower_follows_the_first() -> None:
    joints = chain_of((1, 0.5, 0.1), (2, -2.0, 0.3)).resolve().joints
    last = joints["joint_2"].follows
    assert last is not None
    assert (last.joint, last.ratio) == ("joint_0", -1.0)
    assert last.offset == pytest.approx(-2.0 * 0.1 + 0.3)
    assert joints["joint_2"].range == pytest.approx((-1.9, 1.1))


def test_a_full_name_reaches_a_joint_of_another_chain() -> None:
    joint = "joint: {name: distal, axis: y, follows: {joint: thumb_proximal, ratio: 1}}"
    follows = coupled_hand(joint).resolve().joints["index_distal"].follows
    assert follows is not None
    assert follows.joint == "thumb_proximal"


# --- models --------------------------------------------------------------------------------


def test_mujoco_keeps_the_coupling_while_servos_move_the_other_joint() -> None:
    model = coupled_hand().resolve().build()
    scene = model.scene()
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    data.ctrl[:] = 1.2
    for _ in range(1500):
        mujoco.mj_step(scene, data)
    for finger in ("index", "middle", "ring", "thumb"):
        first, last = (data.joint(f"{finger}_{x}").qpos[0] for x in ("proximal", "distal"))
        assert first == pytest.approx(1.2, abs=0.03)
        assert last == pytest.approx(0.8 * first + 0.1, abs=5e-3)


def test_the_home_pose_of_a_coupled_hand_is_held() -> None:
    scene = coupled_hand().resolve().build().scene()
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    for _ in range(500):
        mujoco.mj_step(scene, data)
    assert data.qpos == pytest.approx(scene.key("home").qpos, abs=5e-3)


@settings(max_examples=25, deadline=None)
@given(
    ratios=st.lists(st.floats(-2, 2).filter(lambda x: abs(x) > 0.05), min_size=1, max_size=2),
    angle=st.floats(-1, 1),
    speed=st.floats(0.1, 3),
)
def test_the_energy_of_a_coupled_motion_is_that_of_its_mass_matrix(
    ratios: list[float], angle: float, speed: float
) -> None:
    follows = [(k + 1, round(ratio, 4), 0.1) for k, ratio in enumerate(ratios)]
    model = chain_of(*follows).resolve().build()
    design, compiled = model.design, model.mujoco
    compiled.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    free = {name: angle for name, joint in design.joints.items() if joint.follows is None}
    data = fixed.posed(compiled, follow(design, free))
    moving = gradient(compiled, design, free)
    velocity = speed * np.arange(1.0, len(free) + 1.0)
    data.qvel[:] = moving @ velocity
    mujoco.mj_forward(compiled, data)
    found = pose_inertia(model, follow(design, free), [])
    dofs = [int(compiled.joint(name).dofadr[0]) for name in free]
    inertia = found.inertia[0][np.ix_(dofs, dofs)]
    assert 0.5 * velocity @ inertia @ velocity == pytest.approx(float(data.energy[1]), rel=1e-9)
    assert found.armature[0][dofs] == pytest.approx((moving**2).T @ compiled.dof_armature)


def test_a_coupled_finger_weighs_what_a_tendon_of_mujoco_makes_it_weigh() -> None:
    """Both joints driven by one tendon, whose rotor is in the tendon instead of the joints."""
    model = coupled_hand().resolve({"share": 0.6}).build()
    rotor = 2e-3
    element = mujoco.MjSpec.from_string(model.xml)
    tendon = element.add_tendon(name="wire", armature=rotor)
    for joint, coefficient in (("index_proximal", 0.5), ("index_distal", 0.5 / 0.6)):
        tendon.wrap_joint(joint, coefficient)
    wired = element.compile()
    pose = {name: scalar(joint.home) for name, joint in model.design.joints.items()}
    plain = pose_inertia(model, pose, []).inertia[0]
    data = fixed.posed(wired, pose)
    full = np.empty((wired.nv, wired.nv))
    mujoco.mj_fullM(wired, data, full)
    moving = gradient(wired, model.design, {n: p for n, p in pose.items() if "proximal" in n})
    dof = int(wired.joint("index_proximal").dofadr[0])
    # The tendon is as long as the proximal joint turns: 0.5 + 0.6 x 0.5 / 0.6 = 1.
    assert (moving.T @ full @ moving)[0, 0] == pytest.approx(plain[dof, dof] + rotor, rel=1e-6)


@pytest.mark.parametrize("share", [0.7, -1.3])
def test_pinocchio_reads_the_mimic_joints_with_the_same_mass_matrix(
    share: float, tmp_path: Path
) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    model = coupled_hand().resolve({"share": share}).build()
    folder = model.save(tmp_path / "out", ("urdf",))
    read = pinocchio.buildModelFromUrdf(str(folder / "robot.urdf"), mimic=True)
    assert read.nv == 4
    free = dict(
        zip(
            [f"{x}_proximal" for x in ("index", "middle", "ring", "thumb")],
            (0.2, 0.5, 0.9, 1.1),
            strict=True,
        )
    )
    places = {name: read.joints[read.getJointId(name)].idx_q for name in free}
    q = np.zeros(read.nq)
    for name, place in places.items():
        q[place] = free[name]
    data = read.createData()
    expected = pinocchio.crba(read, data, q)
    expected = np.triu(expected) + np.triu(expected, 1).T
    found = pose_inertia(model, follow(model.design, free), [])
    dofs = [int(model.mujoco.joint(name).dofadr[0]) for name in free]
    order = [places[name] for name in free]
    rotors = np.diag(found.armature[0][dofs])
    inertia = found.inertia[0][np.ix_(dofs, dofs)] - rotors
    assert inertia == pytest.approx(expected[np.ix_(order, order)], rel=1e-6, abs=1e-12)


def test_actuators_json_says_which_joint_follows_which(tmp_path: Path) -> None:
    folder = coupled_hand().resolve().build().save(tmp_path / "out", ("urdf", "mjcf"))
    joints = json.loads((folder / "actuators.json").read_text())["joints"]
    follows = {"joint": "thumb_proximal", "ratio": 0.8, "offset": 0.1}
    assert joints["thumb_distal"]["follows"] == follows
    assert "follows" not in joints["thumb_proximal"]


def test_models_of_a_batch_have_the_couplings_of_those_compiled_alone() -> None:
    design = coupled_hand().resolve({"share": np.array([0.5, 0.9, -0.7])})
    batch = build_batch(design)
    for place in range(3):
        alone, model = design[place].build().mujoco, batch.model(place)
        assert model.eq_data == pytest.approx(alone.eq_data)
        assert model.jnt_range == pytest.approx(alone.jnt_range)


def test_the_couplings_of_a_batch_go_into_a_scene() -> None:
    design = coupled_hand().resolve({"share": np.array([0.5, 0.9])})
    batch, scene = build_batch(design), design[0].build().scene()
    batch.write(1, scene, indices(batch.template, scene))
    assert scene.eq_data == pytest.approx(batch.model(1).eq_data)
    assert scene.equality("thumb_distal").data[1] == pytest.approx(0.9)


# --- loads and limbs -----------------------------------------------------------------------


def test_a_joint_carries_what_its_followers_move() -> None:
    design = coupled_hand().resolve()
    compiled = design.build().mujoco
    pose = {name: scalar(joint.home) for name, joint in design.joints.items()}
    free = {name: p for name, p in pose.items() if "proximal" in name}
    bias = gradient(compiled, design, free).T @ fixed.posed(compiled, pose).qfrc_bias
    found = {joint.names[0]: GRAVITY * scalar(joint.hang) for joint in held_joints(design)}
    assert found == pytest.approx(dict(zip(free, bias, strict=True)), rel=1e-6)


def test_a_slide_that_follows_a_hinge_is_lifted_by_it() -> None:
    last = {"type": "slide", "axis": "z", "follows": {"joint": "joint_1", "ratio": 0.05}}
    design = chain_of(last=last).resolve()
    compiled = design.build().mujoco
    pose = {name: scalar(joint.home) for name, joint in design.joints.items()}
    free = {name: pose[name] for name in ("joint_0", "joint_1")}
    bias = gradient(compiled, design, free).T @ fixed.posed(compiled, pose).qfrc_bias
    found = [GRAVITY * scalar(joint.hang) for joint in held_joints(design)]
    assert found == pytest.approx(list(bias), rel=1e-6)


@pytest.mark.parametrize("share", [0.8, -0.6])
def test_the_tip_of_a_coupled_finger_moves_with_both_joints(share: float) -> None:
    design = coupled_hand().resolve({"share": share})
    compiled = design.build().mujoco
    pose = {name: scalar(joint.home) for name, joint in design.joints.items()}
    data = fixed.posed(compiled, pose)
    moving = gradient(compiled, design, {n: p for n, p in pose.items() if "proximal" in n})
    fingers = ("index", "middle", "ring", "thumb")
    for i, (finger, limb) in enumerate(zip(fingers, limbs(design).fingers, strict=True)):
        jacobian = np.empty((3, compiled.nv))
        mujoco.mj_jacSite(compiled, data, jacobian, None, compiled.site(f"{finger}_tip").id)
        (column,) = home_columns(design, limb)
        assert column.name == f"{finger}_proximal"
        assert np.array(column.arm) == pytest.approx((jacobian @ moving)[:, i], abs=1e-9)


def test_poses_of_a_grasp_keep_the_coupling() -> None:
    """The smallest gap of two fingertips, against a scan of the two free joints in MuJoCo."""
    design = coupled_hand().resolve()
    compiled = design.build().mujoco
    gap = math.inf
    names = [name for name, joint in design.joints.items() if joint.follows is None]
    for a, b in itertools.product(np.linspace(-0.2, 1.6, 60), repeat=2):
        free = dict.fromkeys(names, 0.0) | {"middle_proximal": a, "thumb_proximal": b}
        data = fixed.posed(compiled, follow(design, free))
        away = data.site("middle_tip").xpos - data.site("thumb_tip").xpos
        gap = min(gap, float(np.linalg.norm(away)) - 0.024)
    found = grasps(design)
    assert scalar(found.largest) > scalar(found.smallest) >= max(gap, 0.0) - 2e-3


def test_an_arm_with_a_coupled_elbow_reaches_as_far_as_a_search_finds() -> None:
    design = chain_of((2, -0.7, 0.4)).resolve()
    found = stretched(design)
    assert found is not None
    a, b = (x.ravel() for x in np.meshgrid(np.linspace(-1, 2, 2001), np.linspace(-1, 2, 2001)))
    turns = np.cumsum([a, b, -0.7 * b + 0.4], axis=0)
    best = float(np.abs(0.2 * np.cos(turns).sum(axis=0)).max())
    assert scalar(found.reach) == pytest.approx(best, rel=1e-3)
    assert [load.joint.names[0] for load in found.loads] == ["joint_0", "joint_1"]


def test_the_reach_of_many_coupled_arms_is_that_of_each_alone() -> None:
    spec = coupled_arm()
    shares = np.array([-1.0, 0.3, 1.5])
    found = of_design(spec.resolve({"share": shares}), ["reach", "payload_peak"])
    for i, share in enumerate(shares):
        alone = of_design(spec.resolve({"share": float(share)}), ["reach", "payload_peak"])
        assert {name: x[i] for name, x in found.items()} == pytest.approx(alone, rel=1e-9)  # type: ignore[index]


def coupled_arm() -> draft.Spec:
    """The arm of the tests, whose pitch follows its elbow."""
    free = "joint: {name: pitch, axis: y, range: [-2, 2], home: 0.4, actuator: small}"
    coupled = "joint: {name: pitch, axis: y, follows: {joint: elbow, ratio: share}}"
    forearm = "link: {axis: z, length: forearm_length, mass: 1.2}\n"
    motor = "      motor: {actuator: small, axis: y}\n"
    tree = fixed.ARM_TREE.replace(free, coupled).replace(forearm + motor, forearm)
    share = SHARE.removeprefix("parameters:\n").replace("distal", "wrist")
    numbers = fixed.ARM_PARAMETERS.replace("actuators:\n", f"{share}actuators:\n")
    return draft.Spec.parse({"parameters.yaml": numbers, "tree.yaml": tree})


def test_a_robot_on_legs_with_a_coupled_joint_has_no_legs_that_are_judged() -> None:
    alone = robot().resolve()
    knee = {"joint": {"name": "knee", "axis": "y", "follows": {"joint": "hip", "ratio": -2.0}}}
    coupled = robot(leg(shank=knee, thigh={"motor": None})).resolve()
    assert count(alone) == 1
    assert count(coupled) == 0
    assert "coupled_leg" not in ids(alone)
    (finding,) = (one for one in coupled.findings if one.id == "coupled_leg")
    assert finding.where == "shank"


def test_a_coupled_waist_above_the_legs_leaves_them_judged() -> None:
    legs = [
        {"chain": "leg", "prefix": f"{side}_", "at": [0, y, -0.2]}
        for side, y in (("left", 0.2), ("right", -0.2))
    ]
    follows = {"joint": "lead", "ratio": -0.5}
    waist = {
        "name": "waist",
        "joint": {"name": "waist", "axis": "z", "follows": follows},
        "link": {"axis": "z", "length": 0.05, "mass": 0.5},
        "children": legs,
    }
    lead = {
        "name": "lead",
        "joint": {"name": "lead", "axis": "z", "range": [-1, 1]},
        "link": {"axis": "z", "length": 0.05, "mass": 0.1},
        "children": [waist],
    }
    design = robot(children=[lead]).resolve()
    assert count(design) == 2
    assert "coupled_leg" not in ids(design)


# --- what is refused -----------------------------------------------------------------------


def refusal(joint: str) -> tuple[str, str]:
    """Cause and remedy of the only problem of a hand with a distal joint, which has a place."""
    with pytest.raises(DraftError) as error:
        coupled_hand(joint).resolve()
    problem = error.value.problems[0]
    assert problem.where is not None
    assert problem.where.file == "tree.yaml"
    assert problem.where.line
    assert problem.where.column
    return problem.cause, problem.remedy


@pytest.mark.parametrize(
    ("more", "cause", "remedy"),
    [
        ("range: [0, 1]", "unknown key 'range'", "its range follows from that of the joint"),
        ("home: 0.2", "unknown key 'home'", "its home position follows from that of the joint"),
        ("actuator: servo", "unknown key 'actuator'", "has no drive of its own: remove it"),
        ("limit: 1", "unknown key 'limit'", ""),
    ],
)
def test_what_follows_from_the_other_joint_is_not_stated(
    more: str, cause: str, remedy: str
) -> None:
    joint = f"joint: {{name: distal, axis: y, follows: {{joint: proximal, ratio: 1}}, {more}}}"
    found = refusal(joint)
    assert found[0].startswith(cause)
    assert remedy in found[1]


def test_a_joint_that_follows_no_joint_is_refused() -> None:
    found = refusal("joint: {name: distal, axis: y, follows: {joint: proximl, ratio: 1}}")
    assert found[0] == "joint 'index_distal' follows 'proximl', which does not exist"
    assert found[1].startswith("did you mean 'proximal'?")


def test_a_joint_that_follows_itself_is_refused() -> None:
    found = refusal("joint: {name: distal, axis: y, follows: {joint: distal, ratio: 1}}")
    assert found[0] == "joint 'index_distal' follows itself: index_distal -> index_distal"


def test_a_ratio_of_zero_is_refused() -> None:
    found = refusal("joint: {name: distal, axis: y, follows: {joint: proximal, ratio: 0 * share}}")
    cause = "ratio of distal = '0 * share' is 0: it must not be 0"
    assert found[0].startswith(cause)


def test_one_use_of_a_chain_gives_a_follower_no_range() -> None:
    with pytest.raises(DraftError) as error:
        coupled_hand(ring="joints: {distal: {range: [0, 1]}}")
    cause = "joint 'distal' follows 'proximal' and has no 'range' to change"
    assert error.value.problems[0].cause == cause
