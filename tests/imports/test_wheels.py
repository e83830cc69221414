"""What turns without end stays so, and what rolls is a wheel: never a plate of a foot."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.values import scalar
from tests.imports.test_limbs import BIPED, FOUR, limb, robot
from tests.imports.written import imported, joint, link

TURNS = 'effort="9" velocity="30"'


def rolling(places: tuple[tuple[float, float], ...]) -> str:
    """A robot with a wheel of radius 0.1 m at the end of each leg, which no name calls so."""
    shape = (
        '<collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" '
        'length="0.05"/></geometry></collision></link>'
    )
    parts: list[str] = []
    for i, (x, y) in enumerate(places):
        parts += [
            limb(f"l{i}", "base", (x, y, 0), ((0, 0, -0.3), (0, 0, -0.3), (0, 0, 0))),
            link(f"disc{i}").replace("</link>", shape),
            joint(f"turn{i}", f"l{i}2", f"disc{i}", (0, 0, 0), limit=TURNS, kind="continuous"),
        ]
    return robot(*parts).replace('_tip"', '_cap"')


def walking() -> str:
    """A robot of four legs."""
    return robot(*(limb(f"l{i}", "base", (x, y, 0)) for i, (x, y) in enumerate(FOUR)))


@pytest.mark.parametrize("places", [BIPED, FOUR])
def test_a_wheel_is_a_cylinder_that_turns_without_end_and_stands_on_its_rim(
    places: tuple[tuple[float, float], ...],
) -> None:
    found = imported(rolling(places))
    text = Path("mine/tree.yaml").read_text()
    assert "type: wheel" in text
    assert "plate" not in text
    design = found.spec.resolve()
    model = design.build().mujoco
    wheels = [i for i in range(model.ngeom) if model.geom(i).name.endswith("_end")]
    assert len(wheels) == len(places)
    for i in wheels:
        assert model.geom_type[i] == mujoco.mjtGeom.mjGEOM_CYLINDER
        assert model.geom_size[i][:2] == pytest.approx([0.1, 0.025], abs=1e-3)
    turning = [name for theirs, name in found.joints.items() if theirs.startswith("turn")]
    assert not any(model.jnt_limited[model.joint(name).id] for name in turning)
    assert scalar(design.lowest()) == pytest.approx(0.7, abs=0.02)


def test_a_range_that_a_maker_gives_a_wheel_is_left_out_with_a_note() -> None:
    text = rolling(FOUR).replace('type="continuous"', 'type="revolute"')
    found = imported(text.replace(TURNS, f'lower="-30" upper="30" {TURNS}'))
    said = [note.cause for note in found.notes if "has a range" in note.cause]
    assert said
    assert said[0].startswith("wheel 'disc0' has a range: it is imported as one without end")
    assert not [n for n in imported(rolling(FOUR), out="other").notes if "has a range" in n.cause]


def test_a_wheel_rolls() -> None:
    # Wheels that roll hold no foot below its hip: the legs' servos must, and need three times the
    # torque of feet on the floor.
    strong = rolling(FOUR).replace('effort="30"', 'effort="90"')
    imported(strong).spec.resolve().build().save(Path("model"))
    scene = mujoco.MjModel.from_xml_path("model/scene.xml")
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    wheels = [i for i in range(scene.nu) if not scene.jnt_limited[scene.actuator_trnid[i, 0]]]
    for _ in range(1500):
        data.ctrl[wheels] = 2.0
        mujoco.mj_step(scene, data)
    assert data.qpos[0] > 0.2  # 3 s at 2 rad/s on wheels of 0.1 m: 0.6 m
    assert data.qpos[2] > 0.5


def test_a_joint_without_limits_is_continuous_in_the_model_and_in_its_urdf() -> None:
    found = imported(
        walking().replace('name="jl00" type="revolute"', 'name="jl00" type="continuous"')
    )
    design = found.spec.resolve()
    assert [joint.kind for joint in design.joints.values()].count("continuous") == 1
    model = design.build()
    free = model.mujoco.joint(found.joints["jl00"]).id
    assert np.flatnonzero(model.mujoco.jnt_limited == 0).tolist() == [0, free]
    folder = model.save(Path("model"), formats=("mjcf", "urdf"))
    urdf = (folder / "robot.urdf").read_text()
    assert urdf.count('type="continuous"') == 1
    again = imported(urdf, out="again").spec.resolve()
    assert [joint.kind for joint in again.joints.values()].count("continuous") == 1


def test_a_knee_that_turns_without_end_is_no_wheel() -> None:
    imported(walking().replace('"revolute"', '"continuous"'))
    assert "wheel" not in Path("mine/tree.yaml").read_text()


def test_a_caster_is_a_wheel_and_no_leg() -> None:
    text = rolling(FOUR).replace('name="base"', 'name="base" ', 1)
    wheel = joint("roll", "base", "rim", (0.5, 0, -0.3), limit=TURNS, kind="continuous")
    found = imported(text.replace("</robot>", link("rim") + wheel + "</robot>"))
    assert found.limbs.legs == 4
    tree = Path("mine/tree.yaml").read_text()
    assert tree.count("type: wheel") == 2
    assert tree.count("site: foot") == 1
