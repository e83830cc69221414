"""Capabilities of a real robot: columns, policies of its own, and what cannot be measured."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("mjlab")

import draft
from draft.errors import DraftError
from draft.learn.training.options import SliceOptions
from draft.learn.training.run import open_run
from draft.validation import own
from tests.commands import Command

ROOT = Path(__file__).parents[2]
GO2 = ROOT / "examples/descriptions/unitree_go2/go2.urdf"
QUICK = {"replicas": 1, "seconds": 0.6}


def test_both_columns_have_the_same_capabilities_and_steps_by_the_policy_that_climbs() -> None:
    found = draft.real_robot(GO2, **QUICK)
    assert found.maker.keys() == found.predicted.keys()
    assert {"top_speed", "kick", "step_up", "walking_power", "payload_peak"} <= found.maker.keys()
    assert found.policy == "the family of quadrupeds"
    assert "no published figures of 'go2' ship with Draft" in found.notes


def test_each_column_may_have_a_policy_of_its_own_of_the_same_seed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own, "SliceOptions", partial(SliceOptions, replicas=1))
    found = draft.real_robot(GO2, train=tmp_path, iterations=1, seed=3, **QUICK)
    runs = [open_run(tmp_path / f"go2-{arm}/velocity-3") for arm in ("maker", "predicted")]
    assert [run.plan.seed for run in runs] == [3, 3]
    maker, predicted = (run.plan.members[0] for run in runs)
    assert maker.mass != predicted.mass
    assert maker.joints == predicted.joints
    assert all(run.plan.origin and run.plan.origin.run == "family" for run in runs)
    assert found.policy == str(tmp_path)


def test_a_robot_that_no_policy_drives_is_measured_in_closed_form(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object, **__: object) -> None:
        raise DraftError("no policy", "train one")

    monkeypatch.setattr("draft.validation.compare.open_source", none)
    robot = draft.export(draft.load("humanoid").resolve(), tmp_path) / "robot.urdf"
    found = draft.real_robot(robot, **QUICK)
    assert {"mass", "payload_peak", "jump_height", "standing_power"} == found.maker.keys() - {
        "payload_rated",
        "endurance_standing",
    }
    (why, _) = found.notes
    assert why.startswith("not measured by roll-outs: ")


def test_a_humanoid_is_measured_with_the_policy_of_all_legs(tmp_path: Path) -> None:
    robot = draft.export(draft.load("humanoid").resolve(), tmp_path) / "robot.urdf"
    found = draft.real_robot(robot, **QUICK)
    assert found.policy == "any legs"
    assert "top_speed" in found.maker
    assert not any(note.startswith("not measured by roll-outs") for note in found.notes)


def test_a_robot_that_the_policy_of_all_legs_drives_learns_from_scratch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[object] = []

    def learnt(*_: object, family: bool, **__: object) -> None:
        asked.append(family)
        raise DraftError("asked", "")

    monkeypatch.setattr("draft.validation.compare.own_policy", learnt)
    robot = draft.export(draft.load("humanoid").resolve(), tmp_path) / "robot.urdf"
    for file in (robot, GO2):
        with pytest.raises(DraftError, match="asked"):
            draft.real_robot(file, train=tmp_path, **QUICK)
    assert asked == [False, True]


def test_guessed_torques_are_told(tmp_path: Path) -> None:
    text = GO2.read_text(encoding="utf-8")
    (tmp_path / "odd.urdf").write_text(re.sub(r'effort="[^"]*"', 'effort="1000"', text))
    found = draft.real_robot(tmp_path / "odd.urdf", **QUICK)
    assert any("12 of 12 torques are guesses" in note for note in found.notes)


def test_a_policy_is_given_or_trained(command: Command, tmp_path: Path) -> None:
    words = (GO2, "--capabilities", "--policy", "x.onnx", "--train", tmp_path)
    assert "--train cannot be combined with --policy" in command.refuses("twin", *words)
    told = "--train cannot be combined with a comparison without --capabilities"
    assert told in command.refuses("twin", GO2, "--train", tmp_path)
