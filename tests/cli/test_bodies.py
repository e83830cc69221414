"""Which bodies a command works on: named ones, or drawn ones that pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import draft
from draft.cli.bodies import members
from draft.errors import DraftError
from draft.learn.family import family, joined

VARY = ("thigh_length=0.2:0.4", "actuators.leg.peak_torque=40:200:log")


def test_designs_are_taken_as_they_are_named() -> None:
    designs, found = members(["cheetah", "bear", "cheetah"])
    assert [design.label for design in designs] == ["cheetah", "bear", "cheetah"]
    names = [member.name for member in found]
    assert names == ["quadruped:cheetah-1", "quadruped:bear", "quadruped:cheetah-2"]
    assert found[0].xml == found[2].xml != found[1].xml


def test_a_single_design_keeps_its_name_and_values_win() -> None:
    designs, (member,) = members(["cheetah"], values=["thigh_length=0.27"])
    assert member.leg_length == pytest.approx(0.27 + 0.23)
    assert designs[0].actuators["leg"].peak_torque == pytest.approx(72)
    (plain,) = members(["cheetah"])[1]
    assert plain.name == "quadruped:cheetah"


def test_bodies_are_drawn_until_enough_pass(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("scipy")
    designs, found = members(["cheetah"], VARY, 12, seed=3)
    assert len(designs) == len(found) == len({member.name for member in found}) == 12
    for design, member in zip(designs, found, strict=True):
        assert design.accepted
        assert 0.43 <= member.leg_length <= 0.63
        assert 40 <= member.peak_torque[0] <= 200
        # What is not varied is that of the named design.
        assert design.parameters["trunk_length"] == pytest.approx(0.52)
    assert len({member.leg_length for member in found}) == 12
    told = capsys.readouterr().err
    drawn = int(told.split("12 bodies of ")[1].split()[0])
    assert f"{drawn - 12} did not pass: " in told
    assert drawn > 12


def test_the_same_seed_draws_the_same_bodies_and_more_only_add_to_them() -> None:
    pytest.importorskip("scipy")
    few = [member.xml for member in members(["cheetah"], VARY, 4, seed=1)[1]]
    more = [member.xml for member in members(["cheetah"], VARY, 9, seed=1)[1]]
    assert more[:4] == few
    assert [member.xml for member in members(["cheetah"], VARY, 4, seed=2)[1]] != few


@pytest.mark.parametrize(
    ("words", "vary", "bodies", "values", "message"),
    [
        ([], (), None, (), "no design is named"),
        (["chetah"], (), None, (), "neither a shipped robot"),
        (["humanoid"], (), None, (), "humanoid cannot be trained"),
        (["humanoid"], VARY, 2, (), "humanoid cannot be trained"),
        (["cheetah", "humanoid"], (), None, (), "design 2 of the family, humanoid:default"),
        (["cheetah"], (), 8, (), "--bodies draws bodies, and nothing is varied"),
        (["cheetah"], VARY, None, (), "--bodies is missing"),
        (["cheetah"], VARY, 0, (), "--bodies 0 is not from 1 to 4096"),
        (["cheetah"], VARY, 5000, (), "--bodies 5000 is not from 1 to 4096"),
        (["cheetah", "bear"], VARY, 8, (), "--vary varies one design, and 2 are named"),
        (["cheetah"], ("thigh_lenght=0.2:0.4",), 8, (), "'thigh_lenght' is not a parameter"),
        (["cheetah"], ("thigh_length=0.4:0.2",), 8, (), "range 0.4:0.2 is empty"),
        (["cheetah"], VARY, 8, ("thigh_length=0.3",), "given by --set and by --vary"),
        (["cheetah"], (), None, ("thigh_length",), "is not NAME=VALUE"),
    ],
)
def test_bad_input_is_told(
    words: list[str], vary: tuple[str, ...], bodies: int, values: tuple[str, ...], message: str
) -> None:
    with pytest.raises(DraftError, match=message):
        members(words, vary, bodies, values)


def test_a_seed_below_zero_is_told() -> None:
    with pytest.raises(DraftError, match="--seed -1 is not from 0"):
        members(["cheetah"], VARY, 2, seed=-1)


def test_too_few_that_pass_are_told_with_the_reasons() -> None:
    pytest.importorskip("scipy")
    # Hips so near the trunk that its motors overlap.
    with pytest.raises(DraftError, match=r"only 0 of 1024 drawn bodies pass, not 3") as caught:
        members(["cheetah"], ("hip_offset=0.03:0.035",), 3)
    assert "1024 actuator_overlap; narrow what --vary gives" in str(caught.value)


def test_many_designs_at_once_are_members_one_by_one() -> None:
    spec = draft.load("quadruped")
    batch = spec.resolve("cheetah", {"thigh_length": np.array([0.22, 0.25])})
    found = family([batch])
    assert [member.leg_length for member in found] == pytest.approx([0.45, 0.48])
    (alone,) = family([spec.resolve("cheetah", {"thigh_length": 0.22})])
    assert found[0].xml == alone.xml


def test_every_refused_design_of_a_family_is_told_up_to_five() -> None:
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


def test_a_family_has_a_design() -> None:
    with pytest.raises(DraftError, match="a family needs a design"):
        joined([])


def test_numbered_names_avoid_those_that_are_taken() -> None:
    (member,) = members(["cheetah"])[1]
    other = replace(member, name="quadruped:cheetah-1")
    names = [one.name for one in joined([member, other, member])]
    assert names == ["quadruped:cheetah-2", "quadruped:cheetah-1", "quadruped:cheetah-3"]
