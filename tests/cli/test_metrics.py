"""`draft metrics`, and what `draft show` tells of a design's masses, called as a shell would."""

from __future__ import annotations

from pathlib import Path

import pytest

from draft.metrics import LEARNED, METRICS
from tests.commands import Command
from tests.written import edit


def test_without_a_robot_every_metric_is_listed(command: Command) -> None:
    said = command("metrics")
    assert said.err == ""
    for metric in (*METRICS.values(), *LEARNED.values()):
        for words in (metric.name, metric.doc, metric.formula, metric.source):
            assert words in said.out
    rows = command.json("metrics")
    assert [row["name"] for row in rows] == [*METRICS, *LEARNED]
    assert rows[0] | {"unit": "kg", "needs": "design"} == rows[0]


def test_a_robot_has_numbers_and_a_margin_for_each_joint(command: Command) -> None:
    out = command("metrics quadruped --design bear").out
    assert "quadruped (bear): accepted" in out
    own = [name for name, metric in METRICS.items() if metric.base != "wheels"]
    assert all(name in out for name in own)
    assert out.count("knee") >= 4
    found = command.json("metrics hopper --set thigh_length=0.3")
    assert set(found) == {"name", "design", "metrics", "torque_margins"}
    assert list(found["metrics"]) == own
    assert found["metrics"]["leg_length"] == pytest.approx(0.5)
    assert found["metrics"]["accepted"] is True
    assert set(found["torque_margins"]) == {"hip", "knee"}


def test_a_refused_design_has_what_needs_no_model(command: Command) -> None:
    asked = "metrics quadruped --set actuators.leg.peak_torque=600"
    assert "metrics that need a compiled model are omitted" in command(asked, code=1).out
    found = command.json(asked, code=1)["metrics"]
    assert found["accepted"] is False
    assert found["payload_peak"] > 0
    assert found["foot_inertia"] is None


def test_joints_that_hold_nothing_say_so(command: Command) -> None:
    assert "no load" in command("metrics humanoid").out
    assert command.json("metrics humanoid")["torque_margins"]["left_hip_yaw"] is None


@pytest.mark.parametrize("option", ["--design bear", "--set thigh_length=0.3"])
def test_numbers_without_a_robot_are_an_error(option: str, command: Command) -> None:
    assert command.refuses(f"metrics {option}") == (
        "error: --design, --set, --payload and --learned need a robot\n"
        "  name one: draft metrics quadruped --design bear\n"
    )


def test_show_tells_what_a_robot_carries_and_how_long_it_stands(command: Command) -> None:
    lines = command("show quadruped:cheetah").out.splitlines()
    (rated,) = [line.split() for line in lines if line.startswith("rated torque")]
    assert rated[2] == "24.78"
    for words in ("payload for an hour", "payload for ten seconds", "battery, usual for its mass"):
        (line,) = [line for line in lines if line.startswith(words)]
        assert " .. " in line
    assert any(line.startswith("standing on it") for line in lines)


@pytest.mark.parametrize(
    ("file", "old", "new", "law"),
    [
        ("parameters.yaml", "population:", "population:", "by median structural mass / volume"),
        ("parameters.yaml", "structure: paper", "", "by calibrated: density = 306.7 V^-0.5 L^1.93"),
        ("root.yaml", "density: population", "density: 400", "by its stated density"),
    ],
)
def test_show_tells_which_law_the_trunk_weighs_by(
    file: str, old: str, new: str, law: str, command: Command
) -> None:
    command("new mine --like quadruped")
    edit(Path("mine"), file, old, new)
    out = command("show mine").out
    assert f"trunk {law}" in out
    errors = {"median": "quadrupeds err by 1.18", "calibrated:": "quadrupeds err by 1.14"}
    assert errors.get(law.split()[1], "") in out


def test_a_time_that_ends_is_shown_in_seconds(command: Command) -> None:
    loaded = "metrics giraffe"
    seconds = command.json(loaded)["metrics"]["hold_time"]
    assert f" {seconds:.4g} " in command(loaded).out
    assert "no limit" in command("metrics humanoid").out
