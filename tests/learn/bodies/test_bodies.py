"""Designs for one policy: named ones, or drawn ones that pass."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np
import pytest
import yaml

import draft
from draft.errors import DraftError
from draft.learn.bodies import legged_batch as many
from draft.learn.bodies.designs import family, joined, open_bodies
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.bodies.legged_batch import legged_robots
from draft.model.folder import design_text, design_texts
from tests.learn.small import member

VARY = ("thigh_length=0.2:0.4", "actuators.leg.peak_torque=40:200:log")


def test_designs_are_taken_as_they_are_named() -> None:
    bodies = open_bodies(["cheetah", "bear", "cheetah"])
    labels = [yaml.safe_load(text)["doc"].split(", ")[1] for text in bodies.texts]
    assert labels == ["cheetah", "bear", "cheetah"]
    first, second, third = bodies.members
    names = [member.name for member in bodies.members]
    assert names == ["quadruped:cheetah-1", "quadruped:bear", "quadruped:cheetah-2"]
    assert first.xml == third.xml != second.xml
    assert bodies.note == ""
    # A single design keeps its name, and values win.
    (alone,) = open_bodies(["cheetah"], values={"thigh_length": 0.27}).members
    assert alone.leg_length == pytest.approx(0.27 + 0.23)
    assert alone.peak_torque == pytest.approx([72] * 12)
    assert member().name == open_bodies(["cheetah"]).members[0].name == "quadruped:cheetah"


def test_bodies_are_drawn_until_enough_pass() -> None:
    pytest.importorskip("scipy")
    bodies = open_bodies(["cheetah"], VARY, 12, seed=3)
    found = bodies.members
    assert len(bodies.texts) == len(found) == len({member.name for member in found}) == 12
    for text, one in zip(bodies.texts, found, strict=True):
        design = bodies.spec.resolve(yaml.safe_load(text)["values"])
        assert design.accepted
        assert design.build().xml == one.xml
        assert 0.43 <= one.leg_length <= 0.63
        assert 40 <= one.peak_torque[0] <= 200
        # What is not varied is that of the named design.
        assert design.parameters["trunk_length"] == pytest.approx(0.52)
    assert len({member.leg_length for member in found}) == 12
    drawn = int(bodies.note.split("12 bodies of ")[1].split()[0])
    assert f"{drawn - 12} did not pass: " in bodies.note
    assert drawn > 12


def test_the_same_seed_draws_the_same_bodies_and_more_only_add_to_them() -> None:
    pytest.importorskip("scipy")
    few = [member.xml for member in open_bodies(["cheetah"], VARY, 4, seed=1).members]
    more = [member.xml for member in open_bodies(["cheetah"], VARY, 9, seed=1).members]
    assert more[:4] == few
    assert [member.xml for member in open_bodies(["cheetah"], VARY, 4, seed=2).members] != few


@pytest.mark.parametrize(
    ("references", "vary", "count", "values", "message"),
    [
        ([], (), None, {}, "no design is named"),
        (["chetah"], (), None, {}, "names no robot or design"),
        (["hopper"], (), None, {}, "hopper cannot be trained"),
        (["hopper"], ("thigh_length=0.2:0.3",), 2, {}, "hopper cannot be trained"),
        (["cheetah", "hopper"], (), None, {}, "design 2 of the family, hopper:default"),
        (["cheetah"], (), 8, {}, "`bodies` draws designs, but nothing is varied"),
        (["cheetah"], VARY, None, {}, "`bodies` is missing"),
        (["cheetah", "bear"], VARY, 8, {}, "`vary` varies one design, but 2 are named"),
        (["cheetah"], ("thigh_lenght=0.2:0.4",), 8, {}, "'thigh_lenght' is not a parameter"),
        (["cheetah"], ("thigh_length=0.4:0.2",), 8, {}, "range 0.4:0.2 is empty"),
        (["cheetah"], VARY, 8, {"thigh_length": 0.3}, "given by `values` and by `vary`"),
    ],
)
def test_bad_input_is_reported(
    references: list[str],
    vary: tuple[str, ...],
    count: int,
    values: dict[str, float],
    message: str,
) -> None:
    with pytest.raises(DraftError, match=message):
        open_bodies(references, vary, count, values)


def test_too_few_that_pass_are_reported_with_the_reasons() -> None:
    pytest.importorskip("scipy")
    # Hips so near the trunk that its motors overlap.
    with pytest.raises(DraftError, match=r"only 0 of 1024 drawn bodies pass, not 3") as caught:
        open_bodies(["cheetah"], ("hip_offset=0.03:0.035",), 3)
    assert "1024 actuator_overlap; narrow the ranges of `vary`" in str(caught.value)


def test_many_designs_at_once_are_members_one_by_one() -> None:
    spec = draft.load("quadruped")
    batch = spec.resolve("cheetah", {"thigh_length": np.array([0.22, 0.25])})
    found = family([batch])
    assert [member.leg_length for member in found] == pytest.approx([0.45, 0.48])
    (alone,) = family([spec.resolve("cheetah", {"thigh_length": 0.22})])
    assert found[0].xml == alone.xml


def test_every_refused_design_of_a_family_is_reported_up_to_five() -> None:
    spec = draft.load("quadruped")
    offsets = np.linspace(0.03, 0.033, 7)
    batch = spec.resolve("cheetah", {"hip_offset": offsets})
    with pytest.raises(DraftError) as caught:
        family([spec.resolve("cheetah"), batch])
    said = [problem.cause for problem in caught.value.problems]
    assert [words.split(",")[0] for words in said[:5]] == [
        f"design {number} of the family" for number in range(2, 7)
    ]
    assert "overlap" in said[0]
    assert said[5:] == ["and 2 more of 8 designs"]


def test_a_family_has_a_design_and_numbered_names_avoid_those_that_are_taken() -> None:
    with pytest.raises(DraftError, match="a family needs a design"):
        joined([])
    other = replace(member(), name="quadruped:cheetah-1")
    names = [one.name for one in joined([member(), other, member()])]
    assert names == ["quadruped:cheetah-2", "quadruped:cheetah-1", "quadruped:cheetah-3"]


def test_many_quadrupeds_are_those_that_are_read_alone() -> None:
    rng = np.random.default_rng(0)
    values = {"thigh_length": rng.uniform(0.2, 0.3, 60), "trunk_length": rng.uniform(0.4, 0.6, 60)}
    values["actuators.leg.peak_torque"] = rng.uniform(40, 400, 60)
    design = draft.load("quadruped").resolve(values)
    rows = np.flatnonzero(design.accepted)[:12]
    found = legged_robots(design, rows)
    assert list(found) == rows.tolist()
    for row, one in found.items():
        assert isinstance(one, LeggedRobot)
        alone = legged_robot(design[row]).as_dict()
        for name, value in one.as_dict().items():
            if name in ("home", "height", "top_speed", "mass", "leg_length", "foot_radius"):
                assert value == pytest.approx(alone[name], rel=1e-12)
            else:
                assert value == alone[name], name
        (text,) = design_texts(design, np.array([row]))
        assert_alike(yaml.safe_load(text), yaml.safe_load(design_text(design[row])))


def test_many_robots_on_wheels_are_those_that_are_read_alone() -> None:
    rng = np.random.default_rng(0)
    values = {
        "wheel_radius": rng.uniform(0.08, 0.1, 20),
        "shank_length": rng.uniform(0.2, 0.24, 20),
    }
    values["actuators.drive.no_load_speed"] = rng.uniform(30, 60, 20)
    design = draft.load("wheeled").resolve(values)
    rows = np.flatnonzero(np.broadcast_to(design.accepted, 20))[:4]
    assert len(rows) == 4
    with mock.patch.object(many, "_alone", wraps=many._alone) as alone:
        found = legged_robots(design, rows)
    assert alone.call_count == 1  # The others are read by arrays.
    for row in rows:
        robot = found[int(row)]
        assert isinstance(robot, LeggedRobot)
        expected = legged_robot(design[int(row)])
        assert robot.rolls == (False, False, False, True) * 4
        assert_alike(robot.as_dict(text=False), expected.as_dict(text=False))
        assert robot.xml == expected.xml


def assert_alike(one: Any, other: Any) -> None:
    """Plain data of the same form, with numbers that agree to rounding."""
    if isinstance(other, dict):
        assert list(one) == list(other)
        for key, value in other.items():
            assert_alike(one[key], value)
    else:
        assert one == (pytest.approx(other, rel=1e-12) if isinstance(other, float) else other)


def test_numbers_of_design_files_are_written_as_yaml_writes_them() -> None:
    spec = draft.load("quadruped")
    for size in (0.2, 1e-7, 1.5e-9, 3.0, 1e8):
        damping = np.array([size, 0.01])
        design = spec.resolve({"actuators.leg.damping": damping})
        (text,) = design_texts(design, np.array([0]))
        alone = design_text(design[0])
        (line,) = [line for line in alone.splitlines() if "leg.damping" in line]
        assert line in text.splitlines()


def test_designs_that_are_not_like_the_first_or_refused_are_read_alone() -> None:
    torques = np.array([3e3, 72.0])
    refused, design = (
        draft.load("quadruped").resolve(values)
        for values in (
            {"actuators.leg.peak_torque": torques},
            {"thigh_length": np.array([0.25, 0.26, 0.24])},
        )
    )
    first, second = legged_robots(refused, np.arange(2)).values()
    assert isinstance(first, DraftError)
    assert "torque" in str(first)
    assert isinstance(second, LeggedRobot)
    found = legged_robots(design, np.arange(3))
    with mock.patch.object(many, "_alike", return_value=np.array([True, False, True])):
        others = legged_robots(design, np.arange(3))
    assert list(found) == list(others) == [0, 1, 2]
    assert found == others
