"""Cost of transport, endurance and range of roll-outs, against closed forms."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import draft
from draft.cli.display.evaluation import show
from draft.laws.limits import limits
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.measuring.energy import NAMES, add_energy, supply, supply_record
from draft.learn.measuring.scalars import Worlds, curves, electrical_power, scalars
from draft.learn.measuring.summary import Summary
from draft.metrics import travel
from tests.learn.measuring.columns import worlds
from tests.learn.small import member

ROBOT = replace(member(), mass=20.0, battery=(500.0, 500.0, 500.0), electronics=(50.0,))


def rolled(*rows: dict[str, float], test: str = "speed") -> Worlds:
    """Roll-outs that drive with 120 W, brake with 20 W and give off 80 W of heat."""
    usual = {"mechanical": 140.0, "driving": 120.0, "copper": 80.0, "speed": 1.5}
    return worlds(test, [usual | row for row in rows])


def test_electrical_power_is_driving_power_and_heat_and_braking_counts_as_zero() -> None:
    assert electrical_power(rolled({})) == pytest.approx(200.0)
    assert electrical_power(rolled({}), regeneration=1.0) == pytest.approx(180.0)
    assert electrical_power(rolled({}), regeneration=0.5) == pytest.approx(190.0)


def test_power_is_the_median_of_those_that_did_not_fall() -> None:
    rows = [{"copper": heat} for heat in (10.0, 80.0, 200.0)] + [{"copper": 1e6, "fell": True}] * 3
    assert electrical_power(rolled(*rows)) == pytest.approx(200.0)
    assert electrical_power(rolled({"fell": True})) is None


def test_cost_of_transport_endurance_and_range_are_those_of_the_closed_form() -> None:
    found = curves(rolled({}))
    add_energy(found, ROBOT)
    speed = found["speed"]
    # 500 Wh at 200 W of the motors and 50 W of electronics last 2 h, 10.8 km at 1.5 m/s.
    assert speed.get("endurance") == [pytest.approx(2.0)]
    assert speed.get("range") == [pytest.approx(10_800)]
    assert speed.get("cost_of_transport") == [pytest.approx(250 / (20 * 9.81 * 1.5))]


def test_the_payload_is_moved_too_and_costs_no_range() -> None:
    found = curves(rolled({}))
    add_energy(found, ROBOT, payload=10.0)
    assert found["speed"].get("cost_of_transport") == [pytest.approx(250 / (30 * 9.81 * 1.5))]
    assert found["speed"].get("range") == [pytest.approx(10_800)]


@pytest.mark.parametrize("row", [{"speed": -0.1}, {"speed": 0.0}, {"fell": True}])
def test_a_robot_that_does_not_move_forwards_has_no_range_and_says_so(
    row: dict[str, float],
) -> None:
    found = curves(rolled(row, test="walk"))
    add_energy(found, ROBOT)
    assert [found["walk"].get(name) for name in NAMES] == [[None]] * 3
    told = scalars(found, 0.48)
    assert told.values["walk_range"] is None
    assert told.reasons["walk_range"] in ("all fell", "it does not move forwards, or uses no power")


def test_at_top_speed_the_numbers_are_those_of_its_level() -> None:
    levels = [{"level": 1.0, "speed": 0.9}, {"level": 2.0, "speed": 1.8, "copper": 280.0}]
    found = curves(rolled(*levels))
    add_energy(found, ROBOT)
    told = scalars(found, 0.48).values
    assert (told["top_speed"], told["endurance"]) == (1.8, pytest.approx(500 / 450))
    assert told["range"] == pytest.approx(500 / 450 * 3600 * 1.8)
    assert told["cost_of_transport"] == pytest.approx(450 / (20 * 9.81 * 1.8))


def test_the_battery_is_the_designs_own_and_its_band_is_told() -> None:
    spec = draft.load("quadruped")
    design = spec.resolve("cheetah")
    energy, band, stated = supply(member())
    law = limits().energy_share
    assert (energy, stated) == (pytest.approx(law(float(design.mass))), False)
    assert band == pytest.approx((energy / law.band(0.9), energy * law.band(0.9)))
    found = curves(rolled({}))
    add_energy(found, member())
    assert found["speed"].get("range") == [pytest.approx(travel(design, 200, 1.5).range)]


def stating(folder: Path, battery: str) -> LeggedRobot:
    """The shipped quadruped with a stated battery."""
    import shutil

    shutil.copytree(Path(draft.__file__).parent / "robots" / "quadruped", folder)
    file = folder / "parameters.yaml"
    text = file.read_text(encoding="utf-8")
    file.write_text(f"{text}\nbattery: {battery}\n", encoding="utf-8")
    return legged_robot(draft.load(folder).resolve())


def test_a_stated_battery_is_kept_in_the_run(tmp_path: Path) -> None:
    energy = stating(tmp_path / "energy", "{energy: 600}")
    assert energy.battery == (600, 600, 600)
    again = LeggedRobot.from_dict(json.loads(json.dumps(energy.as_dict())))
    assert again == energy
    assert supply_record(again)["origin"] == "stated"
    mass = stating(tmp_path / "mass", "{mass: 4}")
    middle, low, high = mass.battery
    law = limits().specific_energy
    assert middle == pytest.approx(4 * law.coefficient)
    assert (middle / low, high / middle) == pytest.approx((law.band(0.9), law.band(0.9)))


def test_robots_without_what_was_added_are_recorded_as_before() -> None:
    assert not {"battery", "corner_speed"} & member().as_dict().keys()
    cornered = replace(member(), corner_speed=(5.0,) * 12)
    assert LeggedRobot.from_dict(json.loads(json.dumps(cornered.as_dict()))) == cornered


def test_a_table_tells_range_and_what_it_rests_on(capsys: pytest.CaptureFixture[str]) -> None:
    found = curves(rolled({}, test="walk"))
    add_energy(found, member())
    told = scalars(found, 0.48)
    summary = {
        **{"stage": "base", "design": "quadruped:cheetah", "arm": "nominal", "seed": 0},
        **{"format": 2, "protocol": "walking", "payload": 10.0},
        **{"scalars": told.values, "reasons": told.reasons},
        "supply": supply_record(member()),
    }
    show([Summary.model_validate(summary)])
    said = " ".join(capsys.readouterr().out.split())
    assert "cheetah seed 0 with 10 kg" in said
    assert "walking cost of transport walking lasts [h] walking range [m]" in said
    assert "on a battery of 531 Wh (90 % band 257 .. 1096), usual for its mass" in said


def test_powers_of_a_joint_that_drives_and_brakes_by_turns() -> None:
    torch = pytest.importorskip("torch")
    pytest.importorskip("mjlab")
    from draft.learn.measuring.rollout.measure import powers

    time = 2 * np.pi * (np.arange(4000) + 0.5) / 4000
    # Torque and speed a quarter of a period apart: as much braking as driving.
    torque, speed = (torch.tensor(f(time))[:, None] for f in (np.sin, np.cos))
    line, loss = torch.full_like(torque, 0.25), torch.full_like(torque, 0.1)
    found = powers(3 * torque, 2 * speed, line, loss)
    mechanical, heat, copper, driving = (x.mean().item() for x in found)
    assert mechanical == pytest.approx(6 / np.pi, rel=1e-5)
    assert driving == pytest.approx(mechanical / 2)
    assert heat == pytest.approx(9 / 2 * 0.25)
    assert copper == pytest.approx(9 / 2 * 0.1)
