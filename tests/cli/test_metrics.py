"""`draft metrics`, called as a shell would call it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from draft.cli import main
from draft.metrics import LEARNED, METRICS


def test_without_a_robot_every_metric_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    for metric in (*METRICS.values(), *LEARNED.values()):
        for words in (metric.name, metric.doc, metric.formula, metric.source):
            assert words in out


def test_the_list_is_json_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == [*METRICS, *LEARNED]
    assert rows[0] | {"unit": "kg", "needs": "design"} == rows[0]


def test_a_robot_has_numbers_and_a_margin_for_each_joint(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["metrics", "quadruped", "--design", "bear"]) == 0
    out = capsys.readouterr().out
    assert "quadruped (bear): accepted" in out
    assert all(name in out for name in METRICS)
    assert out.count("knee") >= 4


def test_numbers_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", "hopper", "--set", "thigh_length=0.3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found) == {"name", "design", "metrics", "torque_margins"}
    assert list(found["metrics"]) == list(METRICS)
    assert found["metrics"]["leg_length"] == pytest.approx(0.5)
    assert found["metrics"]["accepted"] is True
    assert set(found["torque_margins"]) == {"hip", "knee"}


def test_a_refused_design_has_what_needs_no_model(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["metrics", "quadruped", "--set", "actuators.leg.peak_torque=600"]
    assert main(asked) == 1
    assert "metrics that need a compiled model are omitted" in capsys.readouterr().out
    assert main([*asked, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["metrics"]
    assert found["accepted"] is False
    assert found["payload_peak"] > 0
    assert found["foot_inertia"] is None


def test_joints_that_hold_nothing_say_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", "humanoid"]) == 0
    assert "no load" in capsys.readouterr().out
    assert main(["metrics", "humanoid", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["torque_margins"]["left_hip_yaw"] is None


@pytest.mark.parametrize("option", [["--design", "bear"], ["--set", "thigh_length=0.3"]])
def test_numbers_without_a_robot_are_an_error(
    option: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["metrics", *option]) == 2
    assert capsys.readouterr().err == (
        "error: --design, --set, --payload and --learned need a robot\n"
        "  name one: draft metrics quadruped --design bear\n"
    )


def test_show_tells_what_a_robot_carries_and_how_long_it_stands(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["show", "quadruped:cheetah"]) == 0
    lines = capsys.readouterr().out.splitlines()
    (rated,) = [line.split() for line in lines if line.startswith("rated torque")]
    assert rated[2] == "24.78"
    for words in ("payload for an hour", "payload for ten seconds", "battery, usual for its mass"):
        (line,) = [line for line in lines if line.startswith(words)]
        assert " .. " in line
    assert any(line.startswith("standing on it") for line in lines)


@pytest.mark.parametrize(
    ("words", "law", "error"),
    [
        (
            ["quadruped:cheetah"],
            "trunk by median structural mass / volume",
            "quadrupeds err by 1.18",
        ),
        (
            ["calibrated"],
            "trunk by calibrated: density = 306.7 V^-0.5 L^1.93",
            "quadrupeds err by 1.14",
        ),
        (["stated"], "trunk by its stated density", ""),
    ],
)
def test_show_tells_which_law_the_trunk_weighs_by(
    words: list[str],
    law: str,
    error: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("calibrated", "stated"):
        assert main(["new", name, "--like", "quadruped"]) == 0
    parameters = Path("calibrated/parameters.yaml")
    text = parameters.read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith("structure: paper")]
    parameters.write_text("\n".join(kept), encoding="utf-8")
    root = Path("stated/root.yaml")
    text = root.read_text(encoding="utf-8")
    root.write_text(text.replace("density: population", "density: 400"), encoding="utf-8")
    assert main(["show", *words]) == 0
    out = capsys.readouterr().out
    assert law in out
    assert error in out
