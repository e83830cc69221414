"""Bands of capabilities by predicted masses are those of the real robots that were measured."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from draft.learn.measuring.bands import FILE, mass_band, mass_bands
from draft.learn.policy.validity import FAMILY_NAME

ROBOTS = Path(__file__).parents[3] / "examples/results/real_robots"


@pytest.mark.parametrize(
    ("capability", "name"),
    [
        ("top_speed", "top_speed"),
        ("kick", "kick"),
        ("step", "step_up"),
        ("walk_cost_of_transport", "cost_of_transport"),
    ],
)
def test_a_band_holds_the_share_of_the_robots_that_it_claims(capability: str, name: str) -> None:
    ratios = []
    for path in ROBOTS.glob("*.json"):
        one = json.loads(path.read_text(encoding="utf-8"))
        if one["policy"] != FAMILY_NAME:
            continue
        values = [one[arm].get(name, {}).get("value") for arm in ("predicted", "maker")]
        if all(values):
            ratios.append(values[0] / values[1])
    band = mass_band(capability)
    assert band is not None
    inside = [abs(math.log(ratio)) <= math.log(band.fold) + 1e-4 for ratio in ratios]
    assert band.robots == len(ratios) >= 10
    assert sum(inside) / len(inside) >= band.share


def test_the_sentence_names_capabilities_and_robots() -> None:
    words = mass_bands(["eta", "top_speed", "step"])
    assert words.startswith("masses are predictions, for nine of ten real quadrupeds good to: ")
    folds = json.loads(FILE.read_text(encoding="utf-8"))
    for label, name in (("top speed", "top_speed"), ("step", "step_up")):
        assert f"{label} within {folds[name]['fold_90']:.2f}" in words
    assert "η" not in words
    # No robot was measured at its top speed.
    assert mass_bands(["eta", "cost_of_transport"]) == ""
