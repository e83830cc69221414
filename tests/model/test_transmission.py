"""Transmissions: torque, speed and inertia of an actuator as its joint sees them, and its place."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

import draft
from draft.errors import DraftError
from draft.metrics import of_design
from draft.model.batch import build_batch
from draft.spec.check import drives
from draft.values import scalar
from tests import fixed

FREE = "joint: {name: distal, axis: y, range: [-0.2, 1.6], home: 0.3, actuator: servo}"
MOTOR = "      motor: {actuator: servo, axis: y, shift: [0, 0.03, 0]}\n"
NUMBERS = """\
parameters:
  ratio: {value: 1.5, unit: "1", range: [0.1, 20], doc: Turns of the servo per turn of the joint.}
  share: {value: 0.8, unit: "1", range: [0.01, 2], doc: Efficiency of the tendon.}
"""


def wired_hand(transmission: str, remote: bool = True) -> draft.Spec:
    """The hand of the tests, whose last joints are driven through a transmission.

    Args:
        transmission: text of the transmission.
        remote: whether the motors of the last joints are in the palm, beside those of the first.
    """
    joint = FREE.replace("}", f", transmission: {transmission}}}")
    tree = fixed.HAND_TREE.replace(FREE, joint)
    if remote:
        winch = "    - {name: winch, at: [-0.04, 0, 0], motor: {actuator: servo, axis: y}}\n"
        knuckle = "    - name: knuckle\n"
        tree = tree.replace(MOTOR, "").replace(
            knuckle, winch + knuckle.replace("name", "at: [0.04, 0, 0]\n      name")
        )
    numbers = fixed.HAND_PARAMETERS.replace("parameters: {}\n", NUMBERS)
    return draft.Spec.parse({"parameters.yaml": numbers, "tree.yaml": tree})


REMOTE = "{motor: winch, ratio: ratio, efficiency: share}"


def test_the_joint_sees_the_actuator_through_the_transmission() -> None:
    design = wired_hand(REMOTE).resolve()
    servo = design.actuators["servo"]
    found = design.drive(design.joints["index_distal"])
    assert found is not None
    assert found.peak_torque == pytest.approx(1.5 * 0.8 * servo.peak_torque)
    assert found.rated_torque == pytest.approx(1.5 * 0.8 * servo.rated_torque)
    assert found.no_load_speed == pytest.approx(servo.no_load_speed / 1.5)
    assert found.armature == pytest.approx(1.5**2 * servo.armature)
    assert found.mass == servo.mass
    assert design.drive(design.joints["index_proximal"]) is servo
    # Power and heat per output power do not depend on a ratio without losses.
    lossless = design.actuators["servo"].through(3.0, 1.0)
    assert lossless.copper_loss * 9 == pytest.approx(servo.copper_loss)
    line = lossless.peak_torque * lossless.no_load_speed
    assert line == pytest.approx(servo.peak_torque * servo.no_load_speed)


def test_the_mass_is_where_the_motor_is() -> None:
    near, far = (wired_hand("{ratio: 1}", remote=x).resolve() for x in (False, True))
    masses = [design.body_masses() for design in (near, far)]
    servo = near.actuators["servo"].mass
    assert scalar(near.mass) == pytest.approx(scalar(far.mass))
    assert masses[1]["index_winch"] == pytest.approx(servo)
    lighter = scalar(masses[0]["index_proximal"]) - scalar(masses[1]["index_proximal"])
    assert lighter == pytest.approx(servo)


def test_the_named_motor_drives_the_joint_and_leaves_the_nearer_one_to_another() -> None:
    spec = wired_hand(REMOTE)
    pairs = {spec.bodies[a].name: spec.bodies[b].name for a, b in drives(spec).items()}
    assert pairs["index_winch"] == "index_distal"
    assert pairs["index_knuckle"] == "index_proximal"


def test_a_remote_drive_has_the_mass_matrix_of_a_tendon_of_mujoco() -> None:
    """The rotors on tendons with the ratio as their coefficient, instead of armatures."""
    model = wired_hand(REMOTE).resolve().build()
    servo = scalar(model.design.actuators["servo"].armature)
    element = mujoco.MjSpec.from_string(model.xml)
    for joint in element.joints:
        if not joint.name.endswith("_distal"):
            continue
        joint.armature = 0.0
        element.add_tendon(name=joint.name, armature=servo).wrap_joint(joint.name, 1.5)
    wired, matrices = element.compile(), []
    rng = np.random.default_rng(0)
    pose = rng.uniform(0, 1, wired.nv)
    for compiled in (model.mujoco, wired):
        data = mujoco.MjData(compiled)
        data.qpos[:] = pose
        mujoco.mj_forward(compiled, data)
        full = np.empty((compiled.nv, compiled.nv))
        mujoco.mj_fullM(compiled, data, full)
        matrices.append(full)
    assert matrices[0] == pytest.approx(matrices[1], rel=1e-6, abs=1e-15)


def test_scene_and_exports_have_the_torque_and_speed_of_the_joint(tmp_path: Path) -> None:
    model = wired_hand(REMOTE).resolve().build()
    servo = model.design.actuators["servo"]
    peak, speed = 1.2 * scalar(servo.peak_torque), scalar(servo.no_load_speed) / 1.5
    scene = model.scene()
    assert scene.actuator("index_distal").forcerange == pytest.approx([-peak, peak])
    assert scene.numeric("index_distal_dc_motor").data == pytest.approx([peak, speed])
    folder = model.save(tmp_path / "out", ("urdf", "mjcf"))
    joint = json.loads((folder / "actuators.json").read_text())["joints"]["index_distal"]
    assert joint["peak_torque"] == pytest.approx(peak)
    assert joint["transmission"] == {"ratio": 1.5, "efficiency": 0.8}
    assert f'effort="{peak:.10g}" velocity="{speed:.10g}"' in (folder / "robot.urdf").read_text()


def test_a_stronger_transmission_presses_harder_and_moves_slower() -> None:
    many = wired_hand(REMOTE).resolve({"ratio": np.array([0.2, 1.0]), "share": np.ones(2)})
    found = of_design(many, ["tip_speed", "fingertip_force"])
    assert found["tip_speed"][0] > found["tip_speed"][1]  # type: ignore[index]
    assert found["fingertip_force"][0] < found["fingertip_force"][1]  # type: ignore[index]


def test_models_of_a_batch_are_those_compiled_alone() -> None:
    design = wired_hand(REMOTE).resolve({"ratio": np.array([0.7, 3.0])})
    batch = build_batch(design)
    for place in range(2):
        alone, model = design[place].build().mujoco, batch.model(place)
        assert model.dof_armature == pytest.approx(alone.dof_armature)
        assert model.jnt_actfrcrange == pytest.approx(alone.jnt_actfrcrange)


@pytest.mark.parametrize(
    ("transmission", "cause", "remedy"),
    [
        (
            "{motor: wnch}",
            "the motor of joint 'index_distal' is on 'wnch', which does not exist",
            "did you mean 'winch'?",
        ),
        (
            "{motor: thumb_winch}",
            "the motor of joint 'index_distal' is on 'thumb_winch', which is not between it and "
            "the base",
            "name one of palm, index_winch, index_knuckle, index_proximal",
        ),
        (
            "{motor: palm}",
            "the motor of joint 'index_distal' is on 'palm', which has no motor of 'servo'",
            "add 'motor: {actuator: servo, axis: ...}' to it",
        ),
        ("{ratio: 0}", "ratio of distal", ""),
        ("{efficiency: 1.2}", "efficiency of distal", ""),
        ("{ratio: 2, loss: 0.1}", "unknown key 'loss'", ""),
    ],
)
def test_what_cannot_drive_the_joint_is_refused(transmission: str, cause: str, remedy: str) -> None:
    with pytest.raises(DraftError) as error:
        wired_hand(transmission).resolve()
    problem = error.value.problems[0]
    assert problem.cause.startswith(cause)
    assert remedy in problem.remedy
    assert problem.where is not None
    assert problem.where.file == "tree.yaml"
    assert problem.where.line
    assert problem.where.column


def test_a_passive_joint_has_no_transmission() -> None:
    passive = FREE.replace(", actuator: servo", ", transmission: {ratio: 2}")
    files = {
        "parameters.yaml": fixed.HAND_PARAMETERS,
        "tree.yaml": fixed.HAND_TREE.replace(FREE, passive).replace(MOTOR, ""),
    }
    with pytest.raises(DraftError) as error:
        draft.Spec.parse(files)
    assert error.value.problems[0].cause == "joint 'distal' has a transmission and no actuator"
