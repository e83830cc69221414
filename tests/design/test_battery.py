"""A battery is in the trunk's mass once, and its energy is stated or usual with a band."""

from __future__ import annotations

import pytest

import draft
from draft.design.battery import battery
from draft.design.report import report
from draft.laws.limits import limits
from draft.metrics import of_design, travel

QUADRUPED = draft.load("quadruped")


def with_battery(text: str, density: str = "population") -> draft.Spec:
    """The shipped quadruped with a battery in its parameters.yaml."""
    files = {name: file.read_bytes().decode() for name, file in QUADRUPED.files.items()}
    files["parameters.yaml"] += f"\nbattery: {text}\n"
    stated = files["root.yaml"].replace("density: population", f"density: {density}")
    return draft.Spec.parse(files | {"root.yaml": stated})


def test_without_a_stated_battery_it_is_usual_and_adds_nothing() -> None:
    design = QUADRUPED.resolve()
    found = battery(design)
    assert found.energy == pytest.approx(limits().energy_share.coefficient * design.mass)
    assert found.mass == pytest.approx(limits().battery_share.coefficient * design.mass)
    low, high = found.band
    assert high / found.energy == pytest.approx(limits().energy_share.band(0.9))
    assert low < found.energy < high


def test_a_stated_energy_weighs_by_the_specific_energy() -> None:
    design = with_battery("{energy: 600}").resolve()
    found = battery(design)
    assert (found.energy, found.band) == (600, (600, 600))
    assert found.mass == pytest.approx(600 / limits().specific_energy.coefficient)


def test_a_stated_mass_has_the_usual_energy_with_its_band() -> None:
    found = battery(with_battery("{mass: 4}").resolve())
    assert found.mass == 4
    assert found.energy == pytest.approx(4 * limits().specific_energy.coefficient)
    assert found.law is limits().specific_energy


def test_a_stated_battery_replaces_the_usual_one_in_the_trunk() -> None:
    bare = QUADRUPED.resolve()
    usual = limits().battery_share.coefficient * float(bare.mass)
    for mass in (1.0, usual, 9.0):
        design = with_battery(f"{{mass: {mass}}}").resolve()
        assert design.mass == pytest.approx(float(bare.mass) + mass - usual)
        model = design.build().mujoco
        assert model.body_subtreemass[1] == pytest.approx(design.mass, rel=1e-6)
        loaded = with_battery(f"{{mass: {mass}}}").resolve({"payload": 10})
        assert loaded.mass == pytest.approx(float(design.mass) + 10)


def test_a_trunk_of_stated_density_keeps_its_mass() -> None:
    stated = with_battery("{mass: 9}", density="500").resolve()
    assert stated.trunk.density == 500
    assert stated.mass < with_battery("{mass: 9}").resolve().mass


def test_the_report_tells_the_energy_its_band_and_its_source() -> None:
    record = report(QUADRUPED.resolve())["battery"]
    assert record["origin"] == "trend"
    assert record["n"] == 19
    assert record["band_of_energy_wh"]["90"][0] < record["energy_wh"]
    assert "legged_batteries.csv" in record["source"]


def test_standing_lasts_until_the_battery_is_spent_on_heat_and_electronics() -> None:
    design = with_battery("{energy: 500}\nelectronics_power: 70").resolve()
    found = of_design(design, ["endurance_standing", "cost_of_standing"])
    watts = float(found["cost_of_standing"]) * float(design.mass) + 70
    assert found["endurance_standing"] == pytest.approx(500 / watts)


def test_range_is_speed_times_endurance() -> None:
    design = with_battery("{energy: 500}\nelectronics_power: 50").resolve()
    found = travel(design, 200.0, 2.0)
    assert found.endurance == 2.0
    assert found.range == 2 * 3600 * 2.0
    assert found.cost_of_transport == pytest.approx(250 / (float(design.mass) * 9.81 * 2))
    with pytest.raises(draft.DraftError, match="give numbers above zero"):
        travel(design, 0.0, 1.0)
