"""Playing a policy with a design from Python, in plain MuJoCo."""

from __future__ import annotations

import math
from typing import Any

import pytest

import draft
from draft.learn.policy.play_options import Course
from draft.learn.policy.playback import playback


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"command": (math.nan, 0.0, 0.0)},
            "`command` [nan, 0, 0] is not three numbers from -100 to 100",
        ),
        ({"step": 2.0}, "`step` 2 is not a number from 0 to 0.6 m"),
        ({"kick": -3.0}, "`kick` -3 is not a number from 0 to 100 m/s"),
        ({"seconds": 0.0}, "`seconds` 0 is not a number above 0 and of at most 600 s"),
        ({"seconds": math.nan}, "`seconds` nan is not a number above 0 and of at most 600 s"),
        ({"skill": "dance"}, "there is no skill 'dance'"),
        ({"policy": "none.onnx"}, "cannot read none.onnx"),
    ],
)
def test_bad_arguments_are_one_line_with_what_to_give(
    arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises(draft.DraftError) as raised:
        draft.play("quadruped", **arguments)
    assert message in str(raised.value)
    assert raised.value.problems[0].remedy


def test_a_skill_sets_the_scene_unless_it_is_given() -> None:
    design = draft.load("quadruped").resolve("cheetah")
    climbing, _ = playback(design, "climb")
    assert climbing.policy.stage == "terrain"
    assert climbing.model.ngeom > playback(design, "climb", course=Course(step=0.0))[0].model.ngeom
    assert playback(design, "push", course=Course(kick=0.5))[0].kick == 0.5


def test_a_robot_outside_the_region_is_played_with_a_warning() -> None:
    longer = draft.load("quadruped").resolve({"thigh_length": 0.5})
    _, warning = playback(longer)
    assert "outside the region of the policy" in warning
    assert playback(draft.load("quadruped").resolve())[1] == ""
