"""`draft learn`, called as a shell would call it."""

from __future__ import annotations

import json

import pytest
from pytest_regressions.file_regression import FileRegressionFixture

from draft.cli import main
from draft.learn.config import Config


def shown(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """What `draft learn show` prints."""
    assert main(["learn", "show", *words]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return "\n".join(line.rstrip() for line in out.splitlines()) + "\n"


def test_every_number_is_shown_with_its_source(
    capsys: pytest.CaptureFixture[str], file_regression: FileRegressionFixture
) -> None:
    file_regression.check(shown(capsys, "giraffe"))


def test_without_a_design_there_is_one_value(capsys: pytest.CaptureFixture[str]) -> None:
    out = shown(capsys)
    assert out.count("\n") > len(Config().rows())
    assert "s = " not in out.replace("s = L", "")
    assert "rewards.height " in out


def test_as_json_every_number_has_its_value_at_the_designs_scale(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = json.loads(shown(capsys, "giraffe", "--json"))
    assert (found["design"], found["stage"]) == ("quadruped:giraffe", None)
    assert found["scale"] == pytest.approx(1.3 / 0.48)
    names = {f"{g}.{n}" for g, numbers in Config().as_dict().items() for n in numbers}
    assert set(found["numbers"]) == names
    assert found["numbers"]["rewards.height"] == {
        "value": 0.43,
        "scaled": pytest.approx(0.43 * 1.3 / 0.48),
        "unit": "m",
        "source": "paper",
        "doc": "height asked for",
    }
    root = (1.3 / 0.48) ** 0.5
    pushes = found["numbers"]["episodes.push_linear"]["scaled"]
    assert pushes == pytest.approx([0.5 * root, 0.5 * root, 0.4 * root])
    assert found["numbers"]["ground.rows"]["scaled"] == 10


@pytest.mark.parametrize("stage", ["base", "velocity", "terrain", "push"])
def test_a_stage_leaves_out_what_is_of_others_only(
    capsys: pytest.CaptureFixture[str], stage: str
) -> None:
    found = json.loads(shown(capsys, "--stage", stage, "--json"))["numbers"]
    groups = {name.split(".")[0] for name in found}
    assert groups & {"velocity", "terrain", "push"} == {stage} - {"base"}
    assert {"rewards", "commands", "episodes", "learning"} < groups
    assert [n for n in found if "iterations_" in n] == [f"learning.iterations_{stage}"]


def test_changed_numbers_are_shown_changed(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--set", "rewards.height=0.5", "push.ramp=[[0, 1], [10, 3.5]]", "learning.mirror=true")
    found = json.loads(shown(capsys, *words, "--json"))["numbers"]
    assert found["rewards.height"]["value"] == 0.5
    assert found["push.ramp"]["value"] == [[0, 1.0], [10, 3.5]]
    assert found["learning.mirror"]["value"] is True
    line = next(one for one in shown(capsys, *words).splitlines() if "push.ramp" in one)
    assert "[[0, 1], [10, 3.5]]" in line


def test_hoppers_have_no_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["learn", "show", "hopper"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: hopper cannot be trained: a leg has 2 hinges, not three\n")
