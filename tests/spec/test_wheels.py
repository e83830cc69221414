"""The joint of a wheel has no range, and no other joint is without one."""

from __future__ import annotations

import math

import numpy as np
import pytest

import draft
from draft.errors import DraftError
from tests.fixed import ARM, ARM_TREE
from tests.helpers import leg, parameter, robot, wheeled

ROLL = {"name": "roll", "axis": "y", "actuator": "wheel"}
DISC = {"radius": 0.09, "width": 0.04, "axis": "y", "mass": 0.6, "site": "foot"}


def refused(error: pytest.ExceptionInfo[DraftError]) -> tuple[str, str, str]:
    """File, cause and remedy of the only problem of an error, which has a line and a column."""
    (problem,) = error.value.problems
    assert problem.where is not None
    assert problem.where.line
    assert problem.where.column
    return problem.where.file, problem.cause, problem.remedy


def test_a_wheel_turns_without_end_and_its_poses_are_of_one_turn() -> None:
    joints = wheeled().resolve().joints
    wheels = {name: joint for name, joint in joints.items() if joint.rolls}
    assert [*wheels] == ["FL_roll", "FR_roll", "RL_roll", "RR_roll"]
    for joint in wheels.values():
        assert joint.kind == "continuous"
        assert joint.range == (-math.pi, math.pi)
        assert joint.home == 0.0
        assert joint.axis == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("key", "value", "remedy"),
    [
        ("range", [-3, 3], "a wheel turns without end: remove it"),
        ("type", "continuous", "a wheel turns without end: remove it"),
        ("home", 0.3, "a wheel is the same at every angle: remove it"),
    ],
)
def test_a_wheel_with_limits_or_a_home_is_refused(key: str, value: object, remedy: str) -> None:
    with pytest.raises(DraftError) as error:
        wheeled({"joint": ROLL | {key: value}})
    cause = f"unknown key '{key}' in chains.leg[3].joint"
    assert refused(error) == ("tree.yaml", cause, remedy)


@pytest.mark.parametrize(("key", "value"), [("range", [-3, 3]), ("home", 0.3)])
def test_one_use_of_a_chain_gives_a_wheel_no_limits_and_no_home(key: str, value: object) -> None:
    use = {"chain": "leg", "at": [0, 0, -0.05], "joints": {"roll": {key: value}}}
    with pytest.raises(DraftError) as error:
        wheeled(children=[use])
    assert refused(error)[1] == f"joint 'roll' of a wheel has no '{key}' to change"


def test_one_use_of_a_chain_may_reverse_a_wheel() -> None:
    use = {"chain": "leg", "at": [0, 0, -0.05], "joints": {"roll": {"reverse": True}}}
    joints = wheeled(children=[use]).resolve().joints
    assert joints["roll"].axis == (0.0, -1.0, 0.0)


def test_a_joint_of_another_link_needs_a_range_and_hears_of_wheels() -> None:
    with pytest.raises(DraftError) as error:
        robot(leg(shank={"joint": {"name": "knee", "axis": "y", "actuator": "leg"}}))
    assert refused(error) == (
        "tree.yaml",
        "'range' is missing in chains.leg[2].joint",
        "add 'range: ...'; only the joint of a link of 'type: wheel', and one that 'follows' "
        "another, have none",
    )


def test_a_wheel_lies_along_its_joint() -> None:
    for axis in ("y", "-y", [0, 2, 0]):
        wheeled({"wheel": DISC | {"axis": axis}}).resolve()
    with pytest.raises(DraftError) as error:
        wheeled({"wheel": DISC | {"axis": "x"}}).resolve()
    file, cause, _ = refused(error)
    assert file == "tree.yaml"
    assert cause.startswith("sine of the angle between the axes of wheel 'rim' and joint 'roll'")


def test_designs_whose_wheels_are_askew_are_marked() -> None:
    spec = wheeled(
        {"wheel": DISC | {"axis": ["askew", 1, 0]}}, parameters={"askew": parameter(0.0)}
    )
    many = spec.resolve({"askew": np.array([0.0, 0.5])})
    assert many.findings[0].id == "not_physical"
    assert np.asarray(many.findings[0].mask).tolist() == [False, True]


def test_a_wheel_that_a_fixed_base_would_stand_on_is_refused() -> None:
    with pytest.raises(DraftError) as error:
        fixed(site=True)
    file, cause, remedy = refused(error)
    assert file == "tree.yaml"
    assert cause == "'rim' ends in a foot, and the base 'base' is fixed"
    assert remedy == "give the robot a trunk, 'type: root' and root.yaml, or remove 'site'"
    assert fixed(site=False).resolve().joints["spin"].rolls


def fixed(site: bool) -> draft.Spec:
    """An arm with a wheel as its tool."""
    disc = f"{{radius: 0.05, width: 0.02, axis: x, mass: 0.2{', site: foot' * site}}}"
    head, _, _ = ARM_TREE.partition("    - name: tool\n")
    tool = (
        "    - name: rim\n      type: wheel\n"
        "      joint: {name: spin, axis: x, actuator: small}\n"
        f"      wheel: {disc}\n"
    )
    return draft.Spec.parse({**ARM, "tree.yaml": head + tool})
