"""Structure alone says what a robot is: its limbs, not its names, its masses or its file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.description import mjcf, urdf
from draft.description.description import Description
from draft.description.xmlfile import read_text
from draft.imports.drives import leg_length
from draft.imports.limbs import Limbs, find_limbs, upright
from tests.commands import printed
from tests.imports.written import bolt, imported, joint, link, quadruped, translated, written

Point = Sequence[float]
DOWN = ((0, 0, -0.3), (0, 0, -0.3))


def limb(name: str, parent: str, at: Point, ways: Sequence[Point] = DOWN, limit: str = "") -> str:
    """A limb of one hinge more than it has ways, the last of them to a tip without a joint."""
    lines: list[str] = []
    places = [at, *ways[:-1]]
    limit = limit or 'lower="-1" upper="1.5" effort="30" velocity="20"'
    for i, place in enumerate(places):
        child = f"{name}{i}"
        lines += [link(child), joint(f"j{child}", parent, child, place, limit=limit)]
        parent = child
    lines += [
        f'<link name="{name}_tip"/>',
        bolt(f"{name}_end", parent, f"{name}_tip", " ".join(map(str, ways[-1]))),
    ]
    return "\n".join(lines)


def robot(*parts: str) -> str:
    return "\n".join(['<robot name="unnamed">', link("base"), *parts, "</robot>"])


def turned(text: str) -> tuple[Description, str]:
    """A description with its z axis up, and what was turned."""
    root = read_text(text, "r.urdf")
    return upright(urdf.from_xml(root) if root.tag == "robot" else mjcf.from_xml(root))


def found(text: str, wanted: str | None = None) -> Limbs:
    return find_limbs(turned(text)[0], wanted)


def legs(*places: tuple[float, float], ways: Sequence[Point] = DOWN) -> list[str]:
    return [limb(f"l{i}", "base", (x, y, 0), ways) for i, (x, y) in enumerate(places)]


BIPED, FOUR = ((0, 0.1), (0, -0.1)), ((0.3, 0.1), (0.3, -0.1), (-0.3, 0.1), (-0.3, -0.1))
SIX = (*FOUR, (0, 0.12), (0, -0.12))
LEFT = ((0.1, 0, 0), (0.3, 0, 0))
ARMS = (limb("a", "base", (0, 0.2, 0.4)), limb("b", "base", (0, -0.2, 0.4)))
TUCKED, CASTER = ((0, 0, -0.3), (0, 0, 0.3)), ((0, 0, -0.02), (0, 0, -0.05))
UP = ((0, 0, 0.3), (0, 0, 0.3), (0.2, 0, 0))
TWO, FOURS = "two limbs reach the ground", "four limbs reach the ground"
NONE = "no limb reaches the ground"
FLAT = [
    limb(f"l{i}", "base", (x, y, 0), ((0, math.copysign(0.1, y), 0),) * 2).replace(
        'axis xyz="0 1 0"', 'axis xyz="1 0 0"'
    )
    for i, (x, y) in enumerate(SIX)
]
REAR = (
    link("rear"),
    joint("spine", "base", "rear", (-0.3, 0, 0), "0 0 1"),
    limb("x", "rear", (-0.3, 0.1, 0)),
    limb("y", "rear", (-0.3, -0.1, 0)),
)
RODS = [limb(f"rod{i}", f"l{i}0", (0.03, 0, 0), ((0, 0, -0.5), (0, 0, -0.1))) for i in range(2)]
FINGERS = [limb(f"f{y}", "base", (0.1, y, 0), LEFT) for y in (0.04, 0, -0.04)]
THUMB = limb("thumb", "base", (0, 0.05, 0), ((0.05, 0.05, 0), (0.2, 0, 0)))
CASTERS = [limb(f"c{i}", "base", (x, y, 0), CASTER) for i, (x, y) in enumerate(FOUR)]
HIND = [limb(f"h{y}", "base", (-0.3, y, 0), TUCKED) for y in (0.1, -0.1)]
RAISED = [limb(f"a{y}", "base", (0, y, 0.4), UP) for y in (0.2, -0.2)]
ARM = limb("arm", "base", (0.2, 0, 0.1), UP)
# What a robot is made of, its population, legs and arms, and the beginning of the reason.
KINDS: dict[str, tuple[str, str, int, int, str]] = {
    "a biped": (robot(*legs(*BIPED)), "humanoid", 2, 0, TWO),
    "a humanoid": (
        robot(*legs(*BIPED), *RAISED), "humanoid", 2, 2, f"{TWO}, 2 others do not"
    ),
    "a quadruped": (robot(*legs(*FOUR)), "quadruped", 4, 0, FOURS),
    "a quadruped with an arm": (
        robot(*legs(*FOUR), ARM), "quadruped", 4, 1, f"{FOURS}, 1 other does not"
    ),
    "a hexapod": (
        robot(*legs(*SIX)),
        "quadruped",
        6,
        0,
        "6 limbs reach the ground: the trends of quadrupeds are the nearest",
    ),
    "a hexapod that lies flat at zero": (
        robot(*FLAT), "quadruped", 6, 0, "6 limbs reach the ground"
    ),
    "a quadruped whose hind legs are tucked at zero": (
        robot(*legs(*FOUR[:2]), *HIND), "quadruped", 4, 0, FOURS
    ),
    "a quadruped with a spine": (robot(*legs(*FOUR[:2]), *REAR), "quadruped", 4, 0, FOURS),
    "a biped with a rod beside each shank": (
        robot(*legs(*BIPED), *RODS), "humanoid", 2, 0, TWO
    ),
    "an arm": (robot(limb("arm", "base", (0, 0, 0.1), UP)), "humanoid", 0, 1, NONE),
    "an arm that hangs": (robot(limb("arm", "base", (0, 0, -0.1))), "humanoid", 0, 0, NONE),
    "two arms on a stand": (robot(*ARMS), "humanoid", 0, 0, NONE),
    "a hand": (robot(*FINGERS, THUMB), "humanoid", 0, 0, NONE),
    "a cart on casters with an arm": (
        robot(*CASTERS, limb("arm", "base", (0, 0, 0.8), UP)), "humanoid", 0, 1, NONE
    ),
    "nothing that moves": (robot(), "humanoid", 0, 0, NONE),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_a_robot_is_what_its_limbs_are(kind: str) -> None:
    text, population, count, arms, reason = KINDS[kind]
    limbs = found(text)
    assert (limbs.population, limbs.legs, limbs.arms) == (population, count, arms)
    assert limbs.reason.startswith(reason)


def test_a_robot_of_three_legs_is_nearest_to_quadrupeds() -> None:
    limbs = found(robot(*legs(*FOUR[:2], (-0.3, 0))))
    assert (limbs.population, limbs.legs) == ("quadruped", 3)


def test_a_hopper_has_a_leg_where_its_base_is_free() -> None:
    leg = '<body name="{}" pos="0 0 {}"><inertial pos="0 0 -.1" mass="1"/><joint/>'
    text = (
        '<mujoco><worldbody><body name="trunk" pos="0 0 1">{}<inertial pos="0 0 0" mass="1"/>'
        f'{leg.format("a", 0)}{leg.format("b", -0.3)}<geom size=".03" pos="0 0 -.3"/></body></body>'
        "</body></worldbody></mujoco>"
    )
    assert found(text.format("<freejoint/>")).legs == 1
    slides = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
    assert found(text.format(slides)).legs == 1
    assert found(text.format("")).legs == 0


BESIDE = ((0, -0.3, 0), (0, -0.3, 0))


# A leg of hip, knee and ankle, whose foot ends at so much along x and along y.
def toes(x: float, y: float = 0.0) -> tuple[Point, ...]:
    return ((0, 0, -0.3), (0, 0, -0.3), (x, y, -0.04))


TURNED = {
    "y axis points up": robot(
        limb("l", "base", (0, 0, -0.1), BESIDE), limb("r", "base", (0, 0, 0.1), BESIDE)
    ),
    "y axis points forward": robot(*legs((0.1, 0), (-0.1, 0))),
    "-x axis points forward": robot(*legs(*BIPED, ways=toes(-0.2))),
}


@pytest.mark.parametrize("axis", TURNED)
def test_a_biped_with_other_axes_is_turned(axis: str) -> None:
    assert turned(TURNED[axis])[1] == axis
    assert found(TURNED[axis]).legs == 2


@pytest.mark.parametrize("forward", [1, -1])
def test_toes_of_a_biped_that_faces_sideways_tell_where_is_ahead(forward: int) -> None:
    made, axis = turned(robot(*legs((0.1, 0), (-0.1, 0), ways=toes(0.0, 0.2 * forward))))
    assert axis == "y axis points forward"
    assert np.array(made.turned) @ [0, forward, 0] == pytest.approx([1, 0, 0])


def test_shanks_that_end_behind_their_knees_are_no_toes() -> None:
    assert turned(robot(*legs(*BIPED, ways=((0, 0, -0.3), (-0.15, 0, -0.3)))))[1] == ""


def test_a_stated_population_holds_and_is_said() -> None:
    limbs = found(robot(*legs(*FOUR)), "humanoid")
    assert limbs.population == "humanoid"
    assert limbs.reason == ("stated by `population`; by its structure: four limbs reach the ground")


@pytest.mark.parametrize("name", ["torso.urdf", "unitree_g1.urdf", "ankle_arm.urdf", "spot.urdf"])
def test_the_files_name_decides_nothing(name: str) -> None:
    named, plain = imported(quadruped(), name, "out"), imported(quadruped(), "r.urdf", "plain")
    assert named.spec.population == "quadruped"
    assert Path("out/tree.yaml").read_text() == Path("plain/tree.yaml").read_text()
    assert named.joints == plain.joints


def test_a_hexapod_is_built_and_stands() -> None:
    """Six legs of yaw, pitch and knee, whose names share nothing but their numbers."""
    limit = 'lower="-1.2" upper="1.2" effort="8" velocity="12"'
    parts = [link("base", 3.0)]
    for i, (x, y) in enumerate(SIX):
        side = math.copysign(1, y)
        names = [f"m{3 * i + k}" for k in range(3)]
        parts += [link(name, 0.2) for name in names]
        parts += [
            joint(f"s{3 * i}", "base", names[0], (x, y, 0), "0 0 1", limit),
            joint(f"s{3 * i + 1}", names[0], names[1], (0, 0.06 * side, 0), "1 0 0", limit),
            joint(f"s{3 * i + 2}", names[1], names[2], (0, 0.1 * side, 0), "1 0 0", limit),
            f'<link name="tip{i}"/>',
            bolt(f"end{i}", names[2], f"tip{i}", f"0 {0.02 * side} -0.15"),
        ]
    made = imported("\n".join(['<robot name="six">', *parts, "</robot>"]))
    assert (made.limbs.legs, made.spec.population) == (6, "quadruped")
    assert len(set(made.joints.values())) == 18
    folder = made.spec.resolve().build().save(Path("model"))
    scene = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    height = float(data.qpos[2])
    mujoco.mj_step(scene, data, 1000)
    assert data.qpos[2] == pytest.approx(height, rel=0.2)
    assert data.xmat[1][8] > 0.98


def test_a_robot_without_legs_gets_no_verdict() -> None:
    written(robot(limb("arm", "base", (0, 0, 0.1), UP)), "seven.urdf")
    said = "no limb reaches the ground; the structure trends do not apply"
    named = "--population", "humanoid"  # Else it is taken for a machine on a fixed base.
    assert said in printed("import", "seven.urdf", "--out", "seven", *named)
    out = printed("check", "seven", code=1)
    assert said in out
    assert "not judged" in out
    assert "accepted" not in out


def test_the_knee_of_a_leg_of_many_hinges_is_nearest_to_its_middle() -> None:
    """Two hinges at the hip, a knee, and an ankle of two."""
    ways = ((0, 0, -0.05), (0, 0, -0.3), (0, 0, -0.3), (0, 0, -0.03), (0, 0, -0.05))
    files = translated(robot(*legs(*FOUR, ways=ways)))
    limb = [body for body in files.reduced.root.all() if body.name.startswith("l0")]
    assert [body.role for body in limb] == ["abduction", "flexion", "knee", "ankle", "ankle"]
    assert leg_length(files.reduced) == pytest.approx(0.6)


@pytest.mark.parametrize("forward", [1, -1])
def test_a_fixed_mjcf_whose_y_axis_points_up_and_whose_z_points_forward_is_turned(
    forward: int,
) -> None:
    """As in motion capture: legs along -y, left and right along x, toes along z."""
    text = "".join(
        f'''<body name="hip{x}" pos="{x} -.05 0"><joint name="hip{x}" axis="1 0 0"/>
        <geom size=".04"/><body name="shank{x}" pos="0 -.4 0"><joint name="knee{x}" axis="1 0 0"/>
        <geom size=".04"/><body name="foot{x}" pos="0 -.4 0"><joint name="ankle{x}" axis="1 0 0"/>
        <geom type="box" size=".03 .02 .08" pos="0 0 {0.06 * forward}"/></body></body></body>'''
        for x in (0.1, -0.1)
    )
    body = f'<body name="root"><geom type="box" size=".1 .1 .05"/>{text}</body>'
    made, axis = turned(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    assert axis == "y axis points up"
    assert np.array(made.turned) @ [0, 1, 0] == pytest.approx([0, 0, 1])
    assert np.array(made.turned) @ [0, 0, forward] == pytest.approx([1, 0, 0])
    assert find_limbs(made).legs == 2


SIDES = (0.2, -0.2)


def test_a_middle_limb_between_two_arms_is_a_neck() -> None:
    """A neck of four hinges is no arm; an arm of six on a trunk without others is one."""
    ways = ((0, 0, 0.03), (0, 0, 0.1), (0, 0, 0.03), (0, 0, 0.1))
    arms = [limb(f"a{i}", "base", (0, y, 0.4), ((0, 0, -0.15),) * 3) for i, y in enumerate(SIDES)]
    files = translated(robot(*legs(*BIPED), *arms, limb("n", "base", (0, 0, 0.5), ways)))
    bodies = files.reduced.root.all()
    assert {body.role for body in bodies if body.name.startswith("n")} == {"neck"}


def test_the_spine_of_a_torso_without_legs_carries_all_of_it() -> None:
    """A spine's 150 N m are plausible, though nothing but a plate is on its other side."""
    arms = [limb(f"a{i}", "chest", (0, y, 0.4), ((0.2, 0, 0),) * 3) for i, y in enumerate(SIDES)]
    limit = 'lower="-1" upper="1" effort="150" velocity="5"'
    spine = [link("chest"), joint("spine", "base", "chest", (0, 0, 0.1), limit=limit)]
    files = translated(robot(*spine, *arms))
    assert not files.limbs.legs
    assert files.drives["spine"].torque_from == "declared"


def headed(*antennas: str) -> str:
    """A biped whose head, on a neck of two hinges, carries antennas of one hinge or one slide."""
    text = link("neck", 0.3) + joint("neck_yaw", "torso", "neck", (0, 0, 0.3), "0 0 1")
    text += link("head", 2.0) + joint("neck_pitch", "neck", "head", (0, 0, 0.1))
    for side, y in (("left", 0.06), ("right", -0.06)):
        for i, kind in enumerate(antennas):
            above = f"{side}_antenna_{i - 1}" if i else "head"
            own = f"{side}_antenna_{i}"
            limit = 'lower="-0.05" upper="0.05" effort="30" velocity="1"'
            made = joint(f"{own}_joint", above, own, (0, 0 if i else y, 0.1), "0 0 1", limit, kind)
            text += link(own, 0.02) + made
    return text


@pytest.mark.parametrize(
    "antennas", [("revolute",), ("revolute", "revolute"), ("prismatic",) * 3], ids=str
)
def test_a_head_with_antennas_is_not_the_trunk(antennas: tuple[str, ...]) -> None:
    text = link("torso", 8.0)
    for side, y in (("left", 0.1), ("right", -0.1)):
        for name, above, at in (
            ("hip", "torso", (0, y, -0.1)),
            ("knee", f"{side}_hip", (0, 0, -0.3)),
            ("ankle", f"{side}_knee", (0, 0, -0.3)),
        ):
            own = f"{side}_{name}"
            text += link(own) + joint(f"{own}_joint", above, own, at)
    reduced = translated(f'<robot name="walker">{text}{headed(*antennas)}</robot>').reduced
    assert reduced.root.name == "torso"
    roles = {body.joint.name: body.role for body in reduced.root.all() if body.joint}
    assert roles["neck_yaw"] == roles["neck_pitch"] == "neck"
