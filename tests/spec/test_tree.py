"""From a tree as written to bodies: chains, prefixes, mirrors, and names that must fit."""

from __future__ import annotations

import difflib
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import pytest

import draft
from draft.errors import Problem, SpecError
from draft.spec.check import drives
from tests.written import edit, write_robot

LEG_USE = "    - {chain: leg, at: [0, 0, -0.2]}\n"


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A sound robot in the folder `robot` of the working directory."""
    monkeypatch.chdir(tmp_path)
    return write_robot(Path("robot"))


def hang(robot: Path, *children: str) -> None:
    """Replace what the trunk carries."""
    edit(robot, "tree.yaml", LEG_USE, "".join(f"    - {child}\n" for child in children))


def names(spec: draft.Spec) -> list[str]:
    return [body.name for body in spec.bodies]


def problems(robot: Path) -> tuple[Problem, ...]:
    """What is wrong with a robot."""
    with pytest.raises(SpecError) as caught:
        draft.load(robot)
    return caught.value.problems


def only_problem(robot: Path) -> Problem:
    (problem,) = problems(robot)
    return problem


def test_a_chain_hangs_each_link_on_the_one_before(robot: Path) -> None:
    spec = draft.load(robot)
    assert names(spec) == ["trunk", "housing", "thigh", "shank"]
    assert [body.parent for body in spec.bodies] == [None, 0, 1, 2]


def test_a_prefix_stands_before_every_name(robot: Path) -> None:
    hang(robot, "{chain: leg, prefix: L_}", "{chain: leg, prefix: R_}")
    spec = draft.load(robot)
    assert names(spec)[1:4] == ["L_housing", "L_thigh", "L_shank"]
    assert names(spec)[4:] == ["R_housing", "R_thigh", "R_shank"]
    assert [body.parent for body in spec.bodies] == [None, 0, 1, 2, 0, 4, 5]
    assert list(spec.resolve().joints) == ["L_hip", "L_knee", "R_hip", "R_knee"]


def test_copies_of_a_chain_share_their_links(robot: Path) -> None:
    hang(robot, "{chain: leg, prefix: L_}", "{chain: leg, prefix: R_, mirror: y}")
    bodies = draft.load(robot).bodies
    assert all(bodies[i].link is bodies[i + 3].link for i in (1, 2, 3))


@pytest.mark.parametrize(
    ("mirror", "signs"), [("x", (-1, 1, 1)), ("y", (1, -1, 1)), ("xy", (-1, -1, 1))]
)
def test_a_mirror_gives_its_signs_to_the_whole_chain(
    robot: Path, mirror: str, signs: tuple[int, int, int]
) -> None:
    hang(robot, f"{{chain: leg, at: [0.1, 0.2, 0.3], mirror: {mirror}}}")
    spec = draft.load(robot)
    assert [body.signs for body in spec.bodies[1:]] == [signs] * 3
    assert spec.bodies[0].signs == (1, 1, 1)
    position = spec.resolve().bodies[1].position
    assert position == pytest.approx((0.1 * signs[0], 0.2 * signs[1], 0.3))


def test_mirrors_of_nested_chains_multiply(robot: Path) -> None:
    nested = "  arm:\n    - {name: rib, children: [{chain: leg, prefix: a_, mirror: x}]}\ntree:\n"
    edit(robot, "tree.yaml", "tree:\n", nested)
    hang(robot, "{chain: arm, prefix: L_}", "{chain: arm, prefix: R_, mirror: xy}")
    signs = {body.name: body.signs for body in draft.load(robot).bodies}
    assert signs["L_rib"] == (1, 1, 1)
    assert signs["L_a_thigh"] == (-1, 1, 1)
    assert signs["R_rib"] == (-1, -1, 1)
    assert signs["R_a_thigh"] == (1, -1, 1)


def test_a_chain_may_end_in_another_chain(robot: Path) -> None:
    edit(robot, "tree.yaml", "tree:\n", "  limb:\n    - {name: rib}\n    - {chain: leg}\ntree:\n")
    hang(robot, "{chain: limb}")
    spec = draft.load(robot)
    assert names(spec) == ["trunk", "rib", "housing", "thigh", "shank"]
    assert [body.parent for body in spec.bodies] == [None, 0, 1, 2, 3]


def test_at_of_a_use_wins_over_at_of_the_chains_first_link(robot: Path) -> None:
    edit(robot, "tree.yaml", "- name: housing\n", "- name: housing\n      at: [0.5, 0, 0]\n")
    hang(robot, "{chain: leg, prefix: A_}", "{chain: leg, prefix: B_, at: [0, 0.7, 0]}")
    bodies = {body.name: body for body in draft.load(robot).resolve().bodies}
    assert bodies["A_housing"].position == (0.5, 0.0, 0.0)
    assert bodies["B_housing"].position == (0.0, 0.7, 0.0)


@pytest.mark.parametrize(
    ("use", "position", "turned"),
    [
        ("", (0.5, 0, 0), True),
        (", at: [0, 0.7, 0]", (0, 0.7, 0), True),
        (", rpy: [0, 0, 0]", (0.5, 0, 0), False),
        (", at: [0, 0.7, 0], rpy: [0, 0, 0]", (0, 0.7, 0), False),
    ],
)
@pytest.mark.parametrize("nested", [False, True], ids=["plain", "nested"])
def test_what_a_use_does_not_place_its_first_link_does(
    robot: Path, use: str, position: tuple[float, ...], turned: bool, nested: bool
) -> None:
    own = "- name: housing\n      at: [0.5, 0, 0]\n      rpy: [0, 0, deg(90)]\n"
    edit(robot, "tree.yaml", "- name: housing\n", own)
    edit(robot, "tree.yaml", "tree:\n", "  limb:\n    - {chain: leg}\ntree:\n")
    hang(robot, f"{{chain: {'limb' if nested else 'leg'}{use}}}")
    housing = draft.load(robot).resolve().bodies[1]
    assert housing.position == position
    assert housing.rotation is not None
    assert housing.rotation[0][0] == pytest.approx(0.0 if turned else 1.0)


def test_without_at_a_link_stands_at_its_parents_tip(robot: Path) -> None:
    bodies = draft.load(robot).resolve().bodies
    assert bodies[3].position == pytest.approx((0, 0, -0.30))


def test_a_passive_joint_needs_no_motor(robot: Path) -> None:
    edit(robot, "tree.yaml", "      motor: {actuator: leg, axis: y}\n", "")
    edit(robot, "tree.yaml", "range: [-2.0, 2.0], actuator: leg}", "range: [-2.0, 2.0]}")
    assert drives(draft.load(robot)) == {1: 2}


def test_a_motor_drives_the_next_joint_of_its_class(robot: Path) -> None:
    hang(robot, "{chain: leg, prefix: L_}", "{chain: leg, prefix: R_}")
    assert drives(draft.load(robot)) == {1: 2, 2: 3, 4: 5, 5: 6}


def test_more_bodies_than_a_robot_has_are_refused(robot: Path) -> None:
    levels = "".join(
        f"  c{i}:\n    - {{name: n{i}, children: [{{chain: c{i + 1}, prefix: a}}, "
        f"{{chain: c{i + 1}, prefix: b}}]}}\n"
        for i in range(14)
    )
    edit(robot, "tree.yaml", "tree:\n", levels + "  c14:\n    - {name: end}\ntree:\n")
    hang(robot, "{chain: c0}")
    assert only_problem(robot).cause == "more than 500 bodies"


def test_chains_inside_chains_are_bounded(robot: Path) -> None:
    levels = "".join(f"  c{i}:\n    - {{chain: c{i + 1}}}\n" for i in range(1500))
    edit(robot, "tree.yaml", "tree:\n", levels + "  c1500:\n    - {name: end}\ntree:\n")
    hang(robot, "{chain: c0}")
    problem = only_problem(robot)
    assert problem.cause == "more than 64 nested chains"
    assert str(problem.where) == "robot/tree.yaml:141:15"


@pytest.mark.parametrize(("count", "refused"), [(197, False), (198, True), (1200, True)])
def test_the_depth_of_a_tree_is_bounded(robot: Path, count: int, refused: bool) -> None:
    links = "".join(f"    - name: rib{i}\n" for i in range(count))
    edit(robot, "tree.yaml", "    - name: housing\n", links + "    - name: housing\n")
    if not refused:
        assert draft.load(robot).resolve().build().mujoco.nbody == count + 5
        return
    problem = only_problem(robot)
    assert problem.cause == "more than 200 links in series"
    assert problem.where is not None


def test_of_thousands_of_unknown_names_the_first_few_are_shown_at_once(
    robot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compared: list[str] = []

    def noted(name: str, *arguments: Any, **options: Any) -> list[str]:
        compared.append(name)
        return get_close_matches(name, *arguments, **options)

    monkeypatch.setattr(difflib, "get_close_matches", noted)
    many = "".join(f"  p{i}: {{value: 2 * q{i}, unit: m, doc: A.}}\n" for i in range(3000))
    edit(robot, "parameters.yaml", "actuators:\n", many + "actuators:\n")
    found = problems(robot)
    assert len(found) == 13
    assert found[0].cause == "unknown name 'q0' in '2 * q0'"
    assert found[0].remedy == "parameters and actuators: 3005, none of them like it"
    assert found[-1] == Problem("and more", None, "correct these first")
    # To compare one with all others takes a fifth of a second, which would be minutes for all.
    assert set(compared) == {f"q{i}" for i in range(13)}
    assert len(compared) <= 26


def test_of_hundreds_of_unknown_actuators_the_first_few_are_shown(robot: Path) -> None:
    hang(robot, *(f"{{name: n{i}, motor: {{actuator: a{i}, axis: x}}}}" for i in range(400)))
    assert [p.cause for p in problems(robot)][-1] == "and more"
    assert len(problems(robot)) == 13


@pytest.mark.parametrize("named", [False, True], ids=["in_the_folder", "elsewhere"])
def test_of_thousands_of_unknown_keys_of_a_design_the_first_few_are_shown(
    robot: Path, named: bool
) -> None:
    spec = draft.load(robot)
    file = robot.parent / "far.yaml" if named else robot / "designs/far.yaml"
    values = "".join(f"  q{i}: 1\n" for i in range(3000))
    file.write_text(f"doc: Far.\nvalues:\n{values}")
    with pytest.raises(SpecError) as caught:
        spec.resolve(file) if named else draft.load(robot)
    assert len(caught.value.problems) == 13


def test_of_a_long_circle_the_ends_are_shown(robot: Path) -> None:
    many = "".join(f"  p{i}: {{value: p{(i + 1) % 99}, unit: m, doc: A.}}\n" for i in range(99))
    edit(robot, "parameters.yaml", "actuators:\n", many + "actuators:\n")
    cause = only_problem(robot).cause
    assert cause.count(" -> ") == 15
    assert " -> ... -> " in cause


def test_a_chain_that_is_not_used_may_be_there(robot: Path) -> None:
    edit(robot, "tree.yaml", "tree:\n", "  spare:\n    - {name: rib}\ntree:\n")
    assert names(draft.load(robot)) == ["trunk", "housing", "thigh", "shank"]


def test_a_robot_without_limbs_is_a_trunk(robot: Path) -> None:
    (robot / "tree.yaml").write_text("tree: {name: box}\n")
    spec = draft.load(robot)
    assert names(spec) == ["box"]
    assert spec.resolve().build().mujoco.nbody == 2


CHANGED = """{chain: leg, prefix: R_, mirror: y, joints: {hip: {range: [-0.5, 0.2], reverse: true},
      knee: {home: 0.3}}}"""


def test_a_use_may_change_the_joints_of_its_chain(robot: Path) -> None:
    hang(robot, "{chain: leg, prefix: L_}", CHANGED)
    bodies = {body.name: body for body in draft.load(robot).resolve().bodies}
    left, right = bodies["L_thigh"], bodies["R_thigh"]
    assert left.joint is not None
    assert right.joint is not None
    assert left.joint.range == (-1.0, 1.0)
    assert right.joint.range == (-0.5, 0.2)
    assert left.joint_axis == pytest.approx((1, 0, 0))
    assert right.joint_axis == pytest.approx((-1, 0, 0))
    assert right.mass == left.mass
    knee = bodies["R_shank"].joint
    assert knee is not None
    assert knee.home == 0.3
