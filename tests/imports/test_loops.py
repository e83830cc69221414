"""Closed loops: linkages are held, their drives move the joints of the limb, and nothing is lost
without a word."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.description.description import Description
from draft.description.read import describe
from draft.imports.limbs import find_limbs
from draft.imports.loops import open_loops
from tests.imports.written import LEGS, bolt, imported, joint, link, notes, translated, written

FREE = 'lower="-2" upper="2" effort="0" velocity="20"'


def four_bar(crank: float = 0.05, knee: str = FREE) -> str:
    """A quadruped whose knees are moved by cranks at the hips through rods.

    The rod and the crank are hung on the thigh; the rod ends on the shank, 50 mm behind the knee.
    """
    lines = [link("body", 8.0)]
    for name, (x, y) in LEGS.items():
        side = 1 if y > 0 else -1
        lines += [link(f"{name}_{part}") for part in ("hip", "thigh", "crank", "rod", "calf")]
        lines += [
            joint(f"{name}_roll", "body", f"{name}_hip", (x, y, 0), "1 0 0"),
            joint(f"{name}_pitch", f"{name}_hip", f"{name}_thigh", (0, 0.08 * side, 0)),
            joint(f"{name}_crank_joint", f"{name}_thigh", f"{name}_crank", (0, 0, 0)),
            joint(f"{name}_knee", f"{name}_thigh", f"{name}_calf", (0, 0, -0.22), limit=knee),
            joint(f"{name}_rod_top", f"{name}_crank", f"{name}_rod", (-crank, 0, 0), limit=FREE),
            joint(f"{name}_rod_end", f"{name}_rod", f"{name}_calf", (0, 0, -0.22), limit=FREE),
            f'<link name="{name}_foot"/>',
            bolt(f"{name}_ball", f"{name}_calf", f"{name}_foot", "0 0 -0.21"),
        ]
    return '<robot name="beast">\n' + "\n".join(lines) + "\n</robot>\n"


def test_a_loop_is_cut_at_the_end_of_its_rod() -> None:
    found = describe(written(four_bar()))
    assert "FL_knee" in found.joints
    assert [loop.name for loop in found.loops] == [f"{name}_rod_end" for name in LEGS]


def test_a_drive_on_a_linkage_moves_the_joint_of_the_limb() -> None:
    files = translated(four_bar())
    assert set(files.drives) == {f"{n}_{j}" for n in LEGS for j in ("roll", "pitch", "knee")}
    knee = files.drives["FL_knee"]
    assert (knee.torque, knee.speed, knee.torque_from) == (30, 20, "declared")
    assert files.knees.place == "hip"
    assert "FL_crank_joint" in files.knees.why
    (told,) = notes(files, "closed loop 'FL_rod_end' between 'FL_rod' and 'FL_calf' is cut")
    assert "the drive of 'FL_crank_joint' moves 'FL_knee' instead" in told


def test_the_limb_keeps_a_drive_of_its_own() -> None:
    files = translated(four_bar(knee='lower="-2" upper="2" effort="45" velocity="15"'))
    assert files.drives["FL_knee"].torque == 45
    told = notes(files, "closed loop 'FL_rod_end'")[0]
    assert "the drive of 'FL_crank_joint' is left out: 'FL_knee' has a drive of its own" in told


def test_a_drive_at_its_dead_centre_is_lost_with_a_word() -> None:
    told = notes(translated(four_bar(crank=0.0)), "closed loop 'FL_rod_end'")[0]
    assert "the drive of 'FL_crank_joint' is left out" in told
    assert "`torque` FL_knee=VALUE" in told


def jacobian_ratio(path: Path, crank: str, knee: str) -> float:
    """Angle of the crank per angle of the knee, by MuJoCo's solver of the closed loop."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rows = data.efc_J.reshape(-1, model.nv)[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    free = np.linalg.svd(rows)[2][np.linalg.matrix_rank(rows, tol=1e-9) :]
    a, b = (model.jnt_dofadr[model.joint(name).id] for name in (crank, knee))
    moving = free[np.argmax(np.abs(free[:, b]))]
    return abs(float(moving[a] / moving[b]))


def leg(lever: float) -> str:
    """MJCF leg with a crank of 30 mm at the hip, whose rod ends on a lever of the shank."""
    return f"""<mujoco><option><flag gravity="disable"/></option><worldbody>
      <body name="thigh" pos="0 0 1"><geom size=".02"/>
      <body name="crank"><joint name="crank" axis="0 1 0"/><geom size=".01" pos="-.03 0 0"/>
        <body name="rod" pos="-.03 0 0"><joint name="rod" type="ball"/>
          <geom size=".01" pos="0 0 -.1"/></body></body>
      <body name="shank" pos="0 0 -.3"><joint name="knee" axis="0 1 0"/>
        <geom size=".02" pos="0 0 -.3"/></body></body></worldbody>
      <equality><connect name="link" body1="shank" body2="rod" anchor="-{lever} 0 0"/></equality>
      <actuator><motor joint="crank" ctrlrange="-10 10"/></actuator></mujoco>"""


def opened(path: Path) -> Description:
    description = describe(path)
    return open_loops(description, find_limbs(description).ends).description


@pytest.mark.parametrize("lever", [0.03, 0.05, 0.012])
def test_the_torque_of_a_linkage_follows_from_its_levers(lever: float) -> None:
    path = written(leg(lever), "robot.xml")
    knee = opened(path).joints["knee"]
    assert knee.effort == pytest.approx(10 * jacobian_ratio(path, "crank", "knee"), rel=1e-3)
    assert knee.effort == pytest.approx(10 * lever / 0.03, rel=1e-3)
    assert knee.driven


def test_two_cranks_drive_an_ankle_of_two_axes() -> None:
    """Both cranks move the foot up and down, and sideways where they move against each other."""
    cranks = "".join(
        f'<body name="crank{s}" pos="0 {y} .2"><joint name="crank{s}" axis="0 1 0"/>'
        f'<geom size=".01"/><body name="rod{s}" pos="-.04 0 0"><joint name="rod{s}" type="ball"/>'
        '<geom size=".01"/></body></body>'
        for s, y in (("L", 0.03), ("R", -0.03))
    )
    text = f"""<mujoco><worldbody><body name="shank" pos="0 0 1"><geom size=".02"/>{cranks}
      <body name="cross"><joint name="pitch" axis="0 1 0"/><geom size=".01"/>
      <body name="foot"><joint name="roll" axis="1 0 0"/><geom size=".03" pos="0 0 -.2"/></body>
      </body></body></worldbody><equality>
      <connect body1="foot" body2="rodL" anchor="-.04 .03 0"/>
      <connect body1="foot" body2="rodR" anchor="-.04 -.03 0"/></equality><actuator>
      <motor joint="crankL" ctrlrange="-10 10"/><motor joint="crankR" ctrlrange="-10 10"/>
      </actuator></mujoco>"""
    joints = opened(written(text, "robot.xml")).joints
    # Two cranks of 10 N m with levers of 40 mm, on levers of 40 mm and 30 mm.
    assert joints["pitch"].effort == pytest.approx(20, rel=1e-3)
    assert joints["roll"].effort == pytest.approx(15, rel=1e-3)


def test_bodies_beyond_a_held_joint_are_no_part_of_a_straight_rod() -> None:
    """A shin and a tarsus that a spring's rod couples: knee and ankle are driven, tarsus is not."""
    lines = [link("torso", 10.0)]
    for side, y in (("left", 0.1), ("right", -0.1)):
        names = ("hip", "thigh", "shin", "tarsus", "toe", "bar")
        lines += [link(f"{side}_{part}") for part in names]
        own = dict.fromkeys(("roll", "pitch", "knee"), 'lower="-1" upper="1" effort="60"')
        for name, parent, child, at, axis, limit in (
            ("hip_roll", "torso", f"{side}_hip", (0, y, -0.1), "1 0 0", own["roll"]),
            ("hip_pitch", f"{side}_hip", f"{side}_thigh", (0, 0, -0.05), "0 1 0", own["pitch"]),
            ("knee", f"{side}_thigh", f"{side}_shin", (0.1, 0, -0.3), "0 1 0", own["knee"]),
            ("tarsus", f"{side}_shin", f"{side}_tarsus", (-0.2, 0, -0.25), "0 1 0", FREE),
            ("ankle", f"{side}_tarsus", f"{side}_toe", (0.2, 0, -0.3), "0 1 0", own["knee"]),
            ("bar_top", f"{side}_thigh", f"{side}_bar", (0, 0, 0), "0 1 0", FREE),
            ("bar_end", f"{side}_bar", f"{side}_tarsus", (-0.1, 0, -0.55), "0 1 0", FREE),
        ):
            lines.append(joint(f"{side}_{name}", parent, child, at, axis, f'{limit} velocity="9"'))
    text = '<robot name="bird">\n' + "\n".join(lines) + "\n</robot>\n"
    text = text.replace('velocity="20" velocity="9"', 'velocity="20"')
    found = imported(text)
    design = found.spec.resolve()
    values = design.parameters
    assert values["shank_length"] == pytest.approx(np.hypot(0.2, 0.25), abs=1e-4)
    assert values["shank_bend_length"] == pytest.approx(np.hypot(0.2, 0.3), abs=1e-4)
    assert [loop.name for loop in found.files.reduced.description.loops] == [
        "left_bar_end",
        "right_bar_end",
    ]
    assert design.accepted
    assert notes(found, "left_tarsus' at 0")


def test_the_drive_of_an_ankle_sits_where_its_crank_turns() -> None:
    """The ankle's own drive closes a loop with a crank at the top of the shank."""
    lines: list[str] = []
    for side, y in (("left", 0.1), ("right", -0.1)):
        lines += [
            f'<body name="{side}_hip" pos="0 {y} -.1"><joint name="{side}_hip" axis="1 0 0"/>'
            '<geom size=".03"/>',
            f'<body name="{side}_thigh" pos="0 0 -.05"><joint name="{side}_pitch" axis="0 1 0"/>'
            '<geom size=".03" pos="0 0 -.1"/>',
            f'<body name="{side}_shank" pos="0 0 -.3"><joint name="{side}_knee" axis="0 1 0"/>'
            '<geom size=".03" pos="0 0 -.1"/>',
            f'<body name="{side}_crank" pos="-.02 0 -.05"><joint name="{side}_crank" '
            'axis="0 1 0"/><geom size=".01"/>',
            f'<body name="{side}_bar" pos="-.05 0 0"><joint name="{side}_bar" axis="0 1 0"/>'
            '<geom size=".01"/></body></body>',
            f'<body name="{side}_foot" pos="0 0 -.3"><joint name="{side}_ankle" axis="0 1 0"/>'
            '<geom type="box" size=".1 .03 .02" pos="0 0 -.04"/></body></body></body></body>',
        ]
    motors = "".join(
        f'<motor joint="{side}_{name}" ctrlrange="-60 60"/>'
        for side in ("left", "right")
        for name in ("hip", "pitch", "knee", "ankle")
    )
    close = "".join(
        f'<connect body1="{side}_bar" body2="{side}_foot" anchor="0 0 -.25"/>'
        for side in ("left", "right")
    )
    text = (
        '<mujoco><worldbody><body name="torso" pos="0 0 1"><freejoint/>'
        f'<geom type="box" size=".1 .15 .2" pos="0 0 .1"/>{"".join(lines)}</body></worldbody>'
        f"<equality>{close}</equality><actuator>{motors}</actuator></mujoco>"
    )
    found = imported(text, "robot.xml")
    assert "shift: [-0.02, 0, 0.25]" in Path("mine/tree.yaml").read_text("utf-8")
    assert found.spec.resolve().accepted
