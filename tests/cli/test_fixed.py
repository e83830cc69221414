"""Commands on robots whose base is bolted to the world: no word of them is about legs."""

from __future__ import annotations

from pathlib import Path

import pytest

from draft.metrics import METRICS
from tests import fixed
from tests.commands import Command

OWN = (
    *("mass", "mass_low", "mass_high", "structure_mass", "actuator_share"),
    *("reach", "payload_rated", "payload_peak", "payload_hour", "hold_time", "payload_peak_time"),
    *("tip_force", "tip_speed", "manipulability", "workspace_volume", "accepted"),
    "reflected_mass",
)
CLOSED = {*OWN} - {"accepted", "workspace_volume", "reflected_mass"}


@pytest.fixture(autouse=True)
def robots(robot: Path) -> None:
    """The folders `bench_arm` and `bench_hand`, each of two files, beside the robot with a leg."""
    for name, files in (("bench_arm", fixed.ARM), ("bench_hand", fixed.HAND)):
        Path(name).mkdir()
        for file, text in files.items():
            (Path(name) / file).write_text(text, encoding="utf-8")


def test_check_and_metrics_agree_on_what_it_is(command: Command) -> None:
    for name, kind in (
        ("bench_arm", "fixed arm, 18.1 kg"),
        ("bench_hand", "hand of 4 fingers on a fixed base"),
    ):
        verdict = f"{name.replace('bench', 'tester')} (default): accepted, {kind}"
        assert verdict in command(f"check {name}").out
        found = command(f"metrics {name}").out
        assert verdict in found
        assert "-" not in [word for line in found.splitlines() for word in line.split()[1:2]]
        assert command.json(f"check {name}")["machine"] in kind


def test_a_robot_without_legs_that_floats_is_not_judged_by_either(command: Command) -> None:
    tree = Path("robot/tree.yaml")
    tree.write_text(tree.read_text().replace(", site: foot", ""))
    verdict = "not judged, floating robot without legs"
    assert verdict in command("check robot", code=1).out
    found = command("metrics robot").out
    assert verdict in found
    (accepted,) = [line.split() for line in found.splitlines() if line.startswith("accepted")]
    assert accepted[1:3] == ["not", "judged"]


def test_metrics_of_legs_are_absent_and_not_without_a_value(command: Command) -> None:
    found = command.json("metrics bench_arm")
    assert tuple(found["metrics"]) == OWN
    assert None not in found["metrics"].values()
    bases = {one["name"]: one["base"] for one in command.json("metrics")}
    assert bases["mass"] == "any"
    assert bases["learned.top_speed"] == "floating"
    assert bases["tip_force"] == "arm or hand"
    assert {name for name in METRICS if bases[name] in ("any", "arm", "floating or arm")} >= {
        name for name in OWN if bases[name] != "arm or hand"
    }
    hand = command.json("metrics bench_hand")["metrics"]
    assert {"pinch_force", "opposability", "fingertip_force", "grasp_largest"} <= {*hand}
    assert not {"reach", "payload_peak", "workspace_volume"} & {*hand}
    assert None not in [x for name, x in hand.items() if name != "hold_time"]


@pytest.mark.parametrize("name", ["bench_arm", "bench_hand"])
def test_it_is_shown_built_and_exported(command: Command, name: str) -> None:
    shown = command(f"show {name}").out
    assert "stand" not in shown
    assert "payload" not in shown
    assert "trunk" not in shown
    command(f"build {name} --out model")
    command(f"export {name} --out out")
    assert {"robot.urdf", "robot.glb", "scene.xml"} <= {path.name for path in Path("out").iterdir()}
    assert "not simulated" not in command(f"check {name} --simulate").out
    report = command.json(f"build {name} --out other")
    assert report["name"] == name.replace("bench", "tester")


def test_a_weak_arm_is_refused_by_what_it_must_hold(command: Command) -> None:
    said = command("check bench_arm --set actuators.large.peak_torque=12", code=1).out
    assert "cannot_hold holding the home pose takes" in said
    assert "at 'lift'" in said
    assert "refused, fixed arm" in said


def test_searches_over_its_parameters_take_its_metrics(command: Command) -> None:
    pytest.importorskip("optuna")
    pytest.importorskip("pyarrow")
    vary = "--vary pedestal_mass=0:40 actuators.large.peak_torque=30:200"
    screen = command.json(
        f"screen bench_arm {vary} --n 64 --where 'accepted and mass < 18' --out s.parquet"
    )
    assert 0 < screen["rows"] < 64
    where = "--where 'reach > 0.9 and payload_peak > 5'"
    few = command.json(
        f"screen bench_arm {vary} forearm_length=0.2:0.6 --n 64 {where} --out u.parquet"
    )
    assert 0 < few["rows"] < 64
    vary_hand = "--vary actuators.servo.peak_torque=1:3"
    few = command.json(
        f"screen bench_hand {vary_hand} --n 16 --where 'pinch_force > 37' --out v.parquet"
    )
    assert 0 < few["rows"] < 16
    assert command.json(f"sweep bench_arm {vary} --n 4 --out t")["designs"] == 4
    command(f"optimise bench_arm {vary} --minimise mass --maximise payload_peak --trials 8 --out o")
    assert "'top_speed' is of robots on a floating base" in command.refuses(
        f"optimise bench_arm {vary} --maximise top_speed --out p"
    )
    table = command.json("sensitivity bench_arm")
    assert {*table["metrics"]} >= CLOSED


def test_it_is_compared_with_a_robot_on_legs_by_what_both_have(command: Command) -> None:
    pytest.importorskip("plotly")
    found = command("compare bench_arm robot").out
    assert "mass" in found
    assert "jump_height" not in found
    command("report bench_arm robot bench_hand --out page.html")
    page = Path("page.html").read_text(encoding="utf-8")
    assert "tester_arm" in page
    assert "not judged" not in page
