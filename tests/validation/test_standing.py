"""Loads of a standing robot from MuJoCo's own statics, against the closed form."""

from __future__ import annotations

import pytest

import draft
from draft.design import Design
from draft.learn.bodies.legged import legged_robot
from draft.metrics import of_design
from draft.validation.standing import standing


def shipped(name: str) -> Design:
    if name == "humanoid":
        return draft.load("humanoid").resolve()
    return draft.load("quadruped").resolve(name)


@pytest.mark.parametrize("name", ["cheetah", "bear", "giraffe", "humanoid"])
def test_loads_are_those_of_the_metrics(name: str) -> None:
    design = shipped(name)
    held = standing(legged_robot(design), design)
    wanted = of_design(design, ["payload_peak", "payload_rated", "cost_of_standing"])
    found = (held.payload(held.peak), held.payload(held.rated), held.heat / design.mass)
    assert found == pytest.approx(tuple(wanted.values()), rel=1e-6)
