"""The numbers of docs/limits.md are those that the code gives."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import draft
from draft.design.battery import battery
from draft.laws.limits import limits
from draft.metrics import of_design, payload_for
from draft.metrics.heat import hold_time_fold
from draft.values import Value, scalar

TEXT = " ".join(
    (Path(__file__).resolve().parents[2] / "docs" / "limits.md").read_text(encoding="utf-8").split()
)
QUADRUPED = draft.load("quadruped")
DESIGNS = ("cheetah", "bear", "giraffe")
HOUR, TEN_SECONDS = 3600.0, 10.0


def _kg(value: Value) -> str:
    return f"{scalar(value):.0f}"


@pytest.mark.parametrize("name", DESIGNS)
def test_the_loads_of_the_shipped_designs_are_told(name: str) -> None:
    design = QUADRUPED.resolve(name)
    of = of_design(design, ("standing_torque_rated", "payload_rated", "payload_peak"))
    cells = [f"{of['standing_torque_rated']:.2f}", f"{_kg(of['payload_rated'])} kg"]
    for seconds in (HOUR, TEN_SECONDS):
        mass, low, high = payload_for(design, seconds)
        ends = [_kg(low), _kg(high)]
        if scalar(mass) < 0:
            cells.append(f"none (.. {ends[1]})")
        else:
            cells.append(f"{_kg(mass)} ({ends[0]} .. {ends[1]})")
    assert f"| {name} | {' | '.join(cells)} | {_kg(of['payload_peak'])} |" in TEXT


@pytest.mark.parametrize("name", DESIGNS)
def test_what_a_corner_does_to_the_shipped_designs_is_told(name: str) -> None:
    names = ("jump_height", "top_speed", "cost_of_standing")
    line, trend = (
        of_design(QUADRUPED.resolve(name, {"actuators.leg.corner_speed": corner}), names)
        for corner in (None, "trend")
    )
    jumps = [f"{of['jump_height']:.2f}".replace("0.00", "0") + " m" for of in (line, trend)]
    assert line["top_speed"] == trend["top_speed"]
    assert line["cost_of_standing"] == pytest.approx(trend["cost_of_standing"])
    assert f"| {name} | {', '.join(jumps)} |" in TEXT
    assert (
        f"| {line['top_speed']:.2f} m/s, the same | {line['cost_of_standing']:.2f} W/kg, the same |"
        in TEXT
    )


def test_the_laws_are_told() -> None:
    laws = limits()
    stalled, energy, share = laws.stalled, laws.specific_energy, laws.battery_share
    assert f"time = {stalled.coefficient:.0f} s ((torque" in TEXT
    assert f"- 1)^{stalled.exponent:.2f}" in TEXT
    assert f"90 % of the points are within {hold_time_fold():.1f}" in TEXT
    assert f"the corner is {laws.corner.coefficient:.2f} of the no-load speed" in TEXT
    for name, law in (
        (f"energy = {energy.coefficient:.0f} Wh per kg of battery", energy),
        (f"mass = {share.coefficient:.3f} of the robot's", share),
        (f"energy = {laws.energy_share.coefficient:.1f} Wh per kg of robot", laws.energy_share),
    ):
        (held_out,) = law.held_out.values()
        assert f"| {name} | {law.n} | {held_out:.2f} | {law.band(0.9):.2f} |" in TEXT


def test_the_humanoids_negative_payload_is_told() -> None:
    design = draft.load("humanoid").resolve()
    assert f"The shipped humanoid has {of_design(design)['payload_rated']:.1f} kg" in TEXT


def test_a_usual_battery_is_known_to_a_factor_of_two() -> None:
    found = battery(QUADRUPED.resolve("cheetah"))
    fold = math.sqrt(scalar(found.band[1]) / scalar(found.band[0]))
    assert f"{fold:.2f}" == "2.07"
    assert "| 1.43 | 2.07 |" in TEXT
